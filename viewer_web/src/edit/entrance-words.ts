/** What is said of entrances and doors, all in one place. */
import { t } from '../language/language.ts';

export const ENTRANCE_WORDS = {
  entranceTool: t('Entrance'),
  entranceHint: t('Click the floor where the crew enters: the route begins at the first entrance.'),
  entranceNeedsFloor: t('An entrance is on a walkable floor: click on one.'),
  setEntrance: t('set an entrance'),
  entrance: t('Entrance'),
  entranceSet: t('Entrance set'),
  entranceRemoved: t('Entrance removed'),
  routeBegins: (floor: string): string => t('the route begins here, {floor}', { floor }),
  remove: t('Remove'),
  doorTool: t('Doors'),
  doorHint: t('Click a door. It counts when the plan is made again.'),
  noDoors: t('No door is drawn: the scene file marks none, or those that are open have no frame.'),
  doorNeedsDoor: t('No door there: click on one.'),
  doorStates: t('State of the clicked door'),
  open: t('Open'),
  shut: t('Shut'),
  asPlanned: t('As planned'),
  doorNow: (door: string, state: DoorState): string =>
    state === 'open' ? t('{door}: open', { door }) : t('{door}: shut', { door }),
  door: t('Door'),
  markDoor: (state: DoorState): string => (state === 'open' ? t('mark a door as open') : t('mark a door as shut')),
  isMarked: (state: DoorState): string =>
    state === 'open' ? t('This door is marked as open already.') : t('This door is marked as shut already.'),
  doorMarked: (state: DoorState): string => (state === 'open' ? t('Door marked as open') : t('Door marked as shut')),
  doorAsPlanned: t('Door as planned again'),
  doorDetail: (floor: string): string => t('in the next plan, {floor}', { floor }),
  otherDoors: t('Other doors are open in the two plans: figures are compared, not what is seen of each surface.'),
  doorsNote: t('Live figures take doors as planned until you plan again.'),
} as const;

export type DoorState = 'open' | 'shut';

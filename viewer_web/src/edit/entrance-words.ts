/** What is said of entrances and doors, all in one place. */
export const ENTRANCE_WORDS = {
  entranceTool: 'Entrance',
  entranceHint: 'Click the floor where the crew enters: the route begins at the first entrance.',
  entranceNeedsFloor: 'An entrance is on a walkable floor: click on one.',
  setEntrance: 'set an entrance',
  entrance: 'Entrance',
  entranceSet: 'Entrance set',
  entranceRemoved: 'Entrance removed',
  routeBegins: (floor: string): string => `the route begins here, ${floor}`,
  remove: 'Remove',
  doorTool: 'Doors',
  doorHint: 'Click a door. It counts when the plan is made again.',
  noDoors: 'No door is drawn: the scene file marks none, or those that are open have no frame.',
  doorNeedsDoor: 'No door there: click on one.',
  doorStates: 'State of the clicked door',
  open: 'Open',
  shut: 'Shut',
  asPlanned: 'As planned',
  door: 'Door',
  markDoor: (state: DoorState): string => `mark a door as ${state}`,
  isMarked: (state: DoorState): string => `This door is marked as ${state} already.`,
  doorMarked: (state: DoorState): string => `Door marked as ${state}`,
  doorAsPlanned: 'Door as planned again',
  doorDetail: (floor: string): string => `in the next plan, ${floor}`,
  doorsNote: 'Live figures take doors as planned until you plan again.',
} as const;

export type DoorState = 'open' | 'shut';

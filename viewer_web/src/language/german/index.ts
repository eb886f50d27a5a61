/** German: each English text with its translation, by the folder that says it. */
import { API } from './api.ts';
import { COMPARE } from './compare.ts';
import { DRAWING } from './drawing.ts';
import { EDIT } from './edit.ts';
import { ELEMENTS } from './elements.ts';
import { FIELD } from './field.ts';
import { FILES } from './files.ts';
import { FLOORS } from './floors.ts';
import { GHOST } from './ghost.ts';
import { HEAT } from './heat.ts';
import { LANGUAGE } from './language.ts';
import { LOAD } from './load.ts';
import { MEASURE } from './measure.ts';
import { NETWORK } from './network.ts';
import { PANELS } from './panels.ts';
import { REVIEW } from './review.ts';
import { ROOMS } from './rooms.ts';
import { ROUTE } from './route.ts';
import { RUNS } from './runs.ts';
import { SCENE } from './scene.ts';
import { SECTION } from './section.ts';
import { SHARE } from './share.ts';
import { SHARED } from './shared.ts';
import { SHORTFALLS } from './shortfalls.ts';
import { SIGHTS } from './sights.ts';
import { STATIONS } from './stations.ts';
import { UNSEEN } from './unseen.ts';
import { WALK } from './walk.ts';

export const GERMAN = {
  ...API,
  ...COMPARE,
  ...DRAWING,
  ...EDIT,
  ...ELEMENTS,
  ...FIELD,
  ...FILES,
  ...FLOORS,
  ...GHOST,
  ...HEAT,
  ...LANGUAGE,
  ...LOAD,
  ...MEASURE,
  ...NETWORK,
  ...PANELS,
  ...REVIEW,
  ...ROOMS,
  ...ROUTE,
  ...RUNS,
  ...SCENE,
  ...SECTION,
  ...SHARE,
  ...SHARED,
  ...SHORTFALLS,
  ...SIGHTS,
  ...STATIONS,
  ...UNSEEN,
  ...WALK,
} as const;

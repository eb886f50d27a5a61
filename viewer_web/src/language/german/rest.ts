/** German of what comes with the whole plan, and with the drawing. */
import { DRAWING } from './drawing.ts';
import { EDIT } from './edit.ts';
import { ELEMENTS } from './elements.ts';
import { FILES } from './files.ts';
import { FLOORS } from './floors.ts';
import { GHOST } from './ghost.ts';
import { MEASURE } from './measure.ts';
import { REVIEW } from './review.ts';
import { ROUTE } from './route.ts';
import { RUNS } from './runs.ts';
import { SECTION } from './section.ts';
import { SHARE } from './share.ts';
import { SHORTFALLS } from './shortfalls.ts';
import { STATIONS } from './stations.ts';
import { UNSEEN } from './unseen.ts';
import { VIEWS } from './views.ts';
import { WALK } from './walk.ts';

export const REST = {
  ...DRAWING,
  ...EDIT,
  ...ELEMENTS,
  ...FILES,
  ...FLOORS,
  ...GHOST,
  ...MEASURE,
  ...REVIEW,
  ...ROUTE,
  ...RUNS,
  ...SECTION,
  ...SHARE,
  ...SHORTFALLS,
  ...STATIONS,
  ...UNSEEN,
  ...VIEWS,
  ...WALK,
} as const;

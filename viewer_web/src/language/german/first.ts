/** German of the page's first part, which is all that the field view runs: folders with a text in it. */
import { API } from './api.ts';
import { COMPARE } from './compare.ts';
import { FIELD } from './field.ts';
import { HEAT } from './heat.ts';
import { LANGUAGE } from './language.ts';
import { LOAD } from './load.ts';
import { NETWORK } from './network.ts';
import { PANELS } from './panels.ts';
import { ROOMS } from './rooms.ts';
import { SCENE } from './scene.ts';
import { SHARED } from './shared.ts';
import { SIGHTS } from './sights.ts';

export const FIRST = {
  ...API,
  ...COMPARE,
  ...FIELD,
  ...HEAT,
  ...LANGUAGE,
  ...LOAD,
  ...NETWORK,
  ...PANELS,
  ...ROOMS,
  ...SCENE,
  ...SHARED,
  ...SIGHTS,
} as const;

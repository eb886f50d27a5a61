/** German: each English text with its translation, by the folder that says it. Pages load the parts. */
import { FIRST } from './first.ts';
import { REST } from './rest.ts';

export const GERMAN = { ...FIRST, ...REST } as const;

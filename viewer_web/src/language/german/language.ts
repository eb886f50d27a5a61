/** German of the texts in src/language. */
export const LANGUAGE = {
  Language: 'Sprache',
} as const;

/** German of the texts in src/files. */
export const FILES = {
  Files: 'Dateien',
} as const;

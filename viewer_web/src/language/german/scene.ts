/** German of the texts in src/scene. */
export const SCENE = {
  'Needs the 3D picture, which this browser does not show': 'Braucht das 3D-Bild, das dieser Browser nicht zeigt',
} as const;

/** German of the texts in src/floors. */
export const FLOORS = {
  'not in this plan': 'nicht in diesem Plan',
  'Coverage of scannable area': 'Abdeckung der erfassbaren Fläche',
  'Spread floors apart': 'Stockwerke auseinanderziehen',
  'Hide ceilings and roofs': 'Decken und Dächer ausblenden',
  'Cut above floor': 'Schnitt über dem Boden',
  'Height of the cut above the floor': 'Höhe des Schnitts über dem Boden',
} as const;

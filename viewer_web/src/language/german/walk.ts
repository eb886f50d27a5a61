/** German of the texts in src/walk. */
export const WALK = {
  'Turn left': 'Nach links drehen',
  'Go forward': 'Vorwärts gehen',
  'Turn right': 'Nach rechts drehen',
  'Go left': 'Nach links gehen',
  'Go back': 'Rückwärts gehen',
  'Go right': 'Nach rechts gehen',
  'Walk-through': 'Rundgang',
  'W A S D or arrows: move. Drag: look around. Click a floor: go there. Escape: leave.':
    'W A S D oder Pfeile: gehen. Ziehen: umsehen. Boden anklicken: dorthin gehen. Escape: beenden.',
  'Eye height': 'Augenhöhe',
  'Eye height above the floor': 'Augenhöhe über dem Boden',
  'Leave walk-through': 'Rundgang beenden',
  'Nobody can stand there.': 'Dort kann niemand stehen.',
} as const;

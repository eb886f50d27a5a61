/** German of the texts in src/views. */
export const VIEWS = {
  'The side to the left': 'Die Seite links davon',
  'The side to the right': 'Die Seite rechts davon',
  'View cube': 'Ansichtswürfel',
  'View from above': 'Ansicht von oben',
  'View from {side}': 'Ansicht von {side}',
  'the north': 'Norden',
  'the northeast': 'Nordosten',
  'the east': 'Osten',
  'the southeast': 'Südosten',
  'the south': 'Süden',
  'the southwest': 'Südwesten',
  'the west': 'Westen',
  'the northwest': 'Nordwesten',
} as const;

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
  '{n} views are kept, and no more: delete one first.':
    'Mehr als {n} Ansichten werden nicht aufbewahrt: Löschen Sie erst eine.',
  'This view hides too many files to be kept.': 'Diese Ansicht blendet zu viele Dateien aus, um aufbewahrt zu werden.',
  'The views that this browser keeps cannot be read.':
    'Die Ansichten, die dieser Browser aufbewahrt, sind nicht lesbar.',
  'The browser has no room for it, or keeps nothing.': 'Der Browser hat keinen Platz dafür oder bewahrt nichts auf.',
  'Saved views': 'Gespeicherte Ansichten',
  'Copy link to {name}': 'Link zu {name} kopieren',
  'Rename {name}': '{name} umbenennen',
  'Delete {name}': '{name} löschen',
  'Floor, camera, colours, sections and what is shown, kept by this browser.':
    'Stockwerk, Kamera, Farben, Schnitte und was gezeigt wird; dieser Browser bewahrt sie auf.',
  'Name of the view': 'Name der Ansicht',
  'Save this view': 'Ansicht speichern',
  'New name': 'Neuer Name',
  Rename: 'Umbenennen',
  Views: 'Ansichten',
  'Views: save this one, come back to another': 'Ansichten: diese speichern, zu einer anderen zurückkehren',
} as const;

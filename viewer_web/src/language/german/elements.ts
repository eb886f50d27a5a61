/** German of the texts in src/elements. */
export const ELEMENTS = {
  Elements: 'Bauteile',
  '{n} found': '{n} gefunden',
  'Search elements': 'Bauteile suchen',
  'Name, class or GlobalId': 'Name, Klasse oder GlobalId',
  'Elements found': 'Gefundene Bauteile',
  '{n} more: type another word.': '{n} weitere: Geben Sie noch ein Wort ein.',
  'Id in the file': 'Kennung in der Datei',
  GlobalId: 'GlobalId',
  Copy: 'Kopieren',
  Copied: 'Kopiert',
  'Select it to copy': 'Zum Kopieren markieren',
  Isolate: 'Allein zeigen',
  'X-ray': 'Durchleuchten',
} as const;

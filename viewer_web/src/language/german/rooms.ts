/** German of the texts in src/rooms. */
export const ROOMS = {
  'Region {n}': 'Bereich {n}',
  'Coverage by room': 'Abdeckung je Raum',
  '{percent} and more': '{percent} und mehr',
  less: 'weniger',
  'in no room': 'in keinem Raum',
  'not scannable: {area} {reason}': 'nicht erfassbar: {area} {reason}',
  Rooms: 'Räume',
  '{n}, least covered first': '{n}, am wenigsten abgedeckte zuerst',
  'The file has no rooms: these are regions of free floor between doorways.':
    'Die Datei hat keine Räume: Dies sind Bereiche freien Bodens zwischen Türöffnungen.',
  'Show all {n} rooms': 'Alle {n} Räume zeigen',
  'No rooms on this floor.': 'Keine Räume auf diesem Stockwerk.',
  'Names of rooms in the picture': 'Raumnamen im Bild',
  'unseen: {area} {reason}': 'nicht erfasst: {area} {reason}',
  'Coverage of the {area} of the room that are scannable': 'Abdeckung der {area} des Raums, die erfassbar sind',
} as const;

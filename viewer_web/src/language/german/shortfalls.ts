/** German of the texts in src/shortfalls. */
export const SHORTFALLS = {
  'What falls short': 'Was nicht erreicht ist',
  'Show the next one in the building; red areas mark all of them':
    'Das nächste im Gebäude zeigen; rote Flächen markieren alle',
  'Show what is unseen': 'Zeigen, was nicht erfasst ist',
  'Show the network': 'Netz zeigen',
  'Not reachable · {area}': 'Nicht erreichbar · {area}',
  'one area': 'einem Bereich',
  'Not scannable: {area} of {total} in scope, from no valid tripod position':
    'Nicht erfassbar: {area} von {total} im Umfang, von keiner gültigen Stativposition',
  'Not scannable as required: {area} that valid positions see, beside the {counted} that count':
    'Nicht wie gefordert erfassbar: {area}, von gültigen Positionen gesehen, neben den {counted}, die zählen',
  'Not planned: {area} of floor that can’t be reached on foot, in {where}':
    'Nicht geplant: {area} Boden, der zu Fuß nicht erreichbar ist, in {where}',
} as const;

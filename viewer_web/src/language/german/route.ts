/** German of the texts in src/route. */
export const ROUTE = {
  Route: 'Route',
  'No route was computed for this plan.': 'Für diesen Plan wurde keine Route berechnet.',
  'Field time': 'Zeit im Feld',
  'Walking, setup and scans': 'Wege, Aufstellen und Scans',
  'Not reachable on foot': 'Zu Fuß nicht erreichbar',
  'No path inside the model leads there': 'Im Modell führt kein Weg dorthin',
  'The entrance is on ground that this plan does not reach: the route begins wherever it is shortest. Plan again to begin there, or move the entrance.':
    'Der Eingang liegt auf Boden, den dieser Plan nicht erreicht: Die Route beginnt, wo sie am kürzesten ist. Planen Sie neu, um dort zu beginnen, oder versetzen Sie den Eingang.',
  'Show route': 'Route zeigen',
  '‹ Previous': '‹ Zurück',
  '{n} stops': '{n} Halte',
  'stop {n} of {all}': 'Halt {n} von {all}',
  'Next ›': 'Weiter ›',
  'The route starts at {station}.': 'Die Route beginnt bei {station}.',
  'the entrance': 'dem Eingang',
  'No path inside the model leads from {source} to {station}.': 'Im Modell führt kein Weg von {source} nach {station}.',
  '{length} from {source} to {station}, by the stairs.': '{length} von {source} nach {station}, über die Treppe.',
  '{length} from {source} to {station}.': '{length} von {source} nach {station}.',
} as const;

/** German of the texts in src/sights. */
export const SIGHTS = {
  'What {id} sees is known with live editing only.': 'Was {id} erfasst, ist nur mit Live-Bearbeitung bekannt.',
  'Asking which stations see it …': 'Standpunkte, die sie erfassen, werden erfragt …',
  'Stations that see it': 'Standpunkte, die sie erfassen',
  'Seen, but not as required': 'Erfasst, aber nicht wie gefordert',
  'not as required': 'nicht wie gefordert',
  'Its points lie closest there: least range / cos(incidence)':
    'Seine Punkte liegen dort am dichtesten: kleinste Entfernung / cos(Auftreffwinkel)',
  'Open the station': 'Standpunkt öffnen',
  best: 'beste',
  '{n} more.': '{n} weitere.',
  'Range and incidence at the point.': 'Entfernung und Auftreffwinkel am Punkt.',
  'As near to this point as a tripod can stand': 'So nah an diesem Punkt, wie ein Stativ stehen kann',
  'Add a station here': 'Hier einen Standpunkt hinzufügen',
} as const;

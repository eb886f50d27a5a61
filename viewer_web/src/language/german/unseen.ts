/** German of the texts in src/unseen. */
export const UNSEEN = {
  'An older version made this plan: plan again to see what stays unseen, and why.':
    'Eine ältere Version hat diesen Plan erstellt: Planen Sie neu, um zu sehen, was nicht erfasst ist und warum.',
  'Unseen surface by reason': 'Nicht erfasste Fläche nach Grund',
  area: 'Fläche',
  'All unseen surfaces': 'Alle nicht erfassten Flächen',
  '{n}, largest first': '{n}, größte zuerst',
  'Nothing unseen here.': 'Hier ist alles erfasst.',
  'Show {n} more': '{n} weitere zeigen',
  'This floor is not part of the plan.': 'Dieses Stockwerk gehört nicht zum Plan.',
  'Of the edited plan. What no candidate can see does not depend on the stations.':
    'Vom bearbeiteten Plan. Was von keiner möglichen Position sichtbar ist, hängt nicht von den Standpunkten ab.',
  'Of the plan before your edits: live editing is off, so what the edits leave unseen is unknown.':
    'Vom Plan vor Ihren Änderungen: Die Live-Bearbeitung ist aus; was danach nicht erfasst ist, ist unbekannt.',
  'Computing the last changes …': 'Die letzten Änderungen werden berechnet …',
  'What another station would cover': 'Was ein weiterer Standpunkt abdecken würde',
  'What no candidate can see': 'Was von keiner möglichen Position sichtbar ist',
  'Reason: {reason}.': 'Grund: {reason}.',
  'Previous piece': 'Voriges Stück',
  'piece {k} of {n} (the largest of {all}):': 'Stück {k} von {n} (die größten von {all}):',
  'piece {k} of {n}:': 'Stück {k} von {n}:',
  'Next piece': 'Nächstes Stück',
  'Best position {place}: sees': 'Beste Position {place}: erfasst',
  'of it and': 'davon und',
  'Show it in the building': 'Im Gebäude zeigen',
  'of all unseen surface.': 'aller nicht erfassten Fläche.',
} as const;

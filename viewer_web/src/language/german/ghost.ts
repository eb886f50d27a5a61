/** German of the texts in src/ghost. */
export const GHOST = {
  'One more station': 'Ein weiterer Standpunkt',
  'Proposed station': 'Vorgeschlagener Standpunkt',
  Sees: 'Erfasst',
  Adds: 'Kommt hinzu',
  'Surface that no other station covers': 'Fläche, die kein anderer Standpunkt abdeckt',
  'Registers with': 'Registrierbar mit',
  '+1 station: {before} groups become {after}': '+1 Standpunkt: aus {before} Gruppen werden {after}',
  '+1 station: it registers with none, {after} groups': '+1 Standpunkt: mit keinem registrierbar, {after} Gruppen',
  '+1 station: all stay connected': '+1 Standpunkt: alle bleiben verbunden',
  '+1 station: {after} groups as before': '+1 Standpunkt: {after} Gruppen wie zuvor',
  'Add this station': 'Diesen Standpunkt hinzufügen',
} as const;

/** German of the texts in src/load. */
export const LOAD = {
  'Reading the plan': 'Plan wird gelesen',
  'Loading the building': 'Gebäude wird geladen',
  'Loading the coverage': 'Abdeckung wird geladen',
  'Preparing the building': 'Gebäude wird vorbereitet',
  '{file}: {n} bytes, expected {expected}. Write the plan again.':
    '{file}: {n} Bytes, erwartet {expected}. Schreiben Sie den Plan neu.',
  '{file}: too short for bit {bit}. Write the plan again.':
    '{file}: zu kurz für Bit {bit}. Schreiben Sie den Plan neu.',
  'viewer/patches.u8: {n} patches, expected at least {needed} for viewer/stage.usdc. Write the plan again with `tlsplan plan`.':
    'viewer/patches.u8: {n} Flächenstücke, erwartet mindestens {needed} für viewer/stage.usdc. Schreiben Sie den Plan mit `tlsplan plan` neu.',
  '{path}: the server does not answer. Is `tlsplan view` still running?':
    '{path}: Der Server antwortet nicht. Läuft `tlsplan view` noch?',
  '{path}: the server answered 404. The plan folder is not complete; write it again.':
    '{path}: Der Server antwortete mit 404. Der Planordner ist nicht vollständig; schreiben Sie ihn neu.',
  '{path}: the server answered {status}. {text}': '{path}: Der Server antwortete mit {status}. {text}',
  '{path}: not JSON ({why}). Write the plan again.': '{path}: kein JSON ({why}). Schreiben Sie den Plan neu.',
  "The building can't be prepared: {why}.": 'Das Gebäude lässt sich nicht vorbereiten: {why}.',
  'the browser runs no module workers': 'Der Browser führt keine Modul-Worker aus',
  'viewer/layers.json: {part} is {found}, expected {expected}. Write the plan again with `tlsplan plan`.':
    'viewer/layers.json: {part} ist {found}, erwartet {expected}. Schreiben Sie den Plan mit `tlsplan plan` neu.',
  'the whole file': 'die ganze Datei',
  '{file}: {n} bytes, expected {expected} for {rows} x {columns} beams. Write the plan again with `tlsplan plan`.':
    '{file}: {n} Bytes, erwartet {expected} für {rows} x {columns} Strahlen. Schreiben Sie den Plan mit `tlsplan plan` neu.',
  '{file}: damaged, or the connection broke. Load the page again, or write the plan again.':
    '{file}: beschädigt, oder die Verbindung riss ab. Laden Sie die Seite neu, oder schreiben Sie den Plan neu.',
  'Write the plan again with this version of tlsplan.': 'Schreiben Sie den Plan mit dieser Version von tlsplan neu.',
  'Write the plan again with `tlsplan plan`.': 'Schreiben Sie den Plan mit `tlsplan plan` neu.',
  '{file}: {n} bytes, expected {expected} for {patches} patches. Write the plan again with `tlsplan plan`.':
    '{file}: {n} Bytes, erwartet {expected} für {patches} Flächenstücke. Schreiben Sie den Plan mit `tlsplan plan` neu.',
} as const;

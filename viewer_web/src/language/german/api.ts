/** German of the texts in src/api. */
export const API = {
  'The server does not answer. Is `tlsplan view` still running? Changes made now are not kept.':
    'Der Server antwortet nicht. Läuft `tlsplan view` noch? Änderungen von jetzt werden nicht gespeichert.',
  'The server was started again, or this is another browser: open the address that `tlsplan view` printed.':
    'Der Server wurde neu gestartet, oder dies ist ein anderer Browser: Öffnen Sie die Adresse, die `tlsplan view` ausgegeben hat.',
  'The server answered {status}.': 'Der Server antwortete mit {status}.',
  "The server's answer can't be read. Reload the page; the server may be of another version.":
    'Die Antwort des Servers ist nicht lesbar. Laden Sie die Seite neu; der Server hat vielleicht eine andere Version.',
  'the verdict on station': 'das Urteil über Standpunkt',
  'the progress of station': 'der Fortschritt von Standpunkt',
  comment: 'Kommentar',
  zone: 'Zone',
  'forbidden position': 'gesperrte Position',
  'floor mark': 'Bodenmarkierung',
  'the sign-off': 'die Freigabe',
  '{by} changed {object} {time}': '{by} hat {time} geändert: {object}',
  '{changes}. Your change was not applied.': '{changes}. Ihre Änderung wurde nicht übernommen.',
  'on {date} at {clock}': 'am {date} um {clock}',
  "The server's answer can't be read: {what}. Reload the page; the server may be of another version.":
    'Die Antwort des Servers ist nicht lesbar: {what}. Laden Sie die Seite neu; der Server hat vielleicht eine andere Version.',
  'The plan was replaced by another one since this page was loaded. Reload the page.':
    'Der Plan wurde seit dem Laden dieser Seite durch einen anderen ersetzt. Laden Sie die Seite neu.',
  '{n} bytes': '{n} Bytes',
  'a head of {length} in {n} bytes': 'ein Kopf von {length} in {n} Bytes',
  'a head that is not JSON': 'ein Kopf, der kein JSON ist',
  '{n} bytes for {patches} patches': '{n} Bytes für {patches} Flächenstücke',
} as const;

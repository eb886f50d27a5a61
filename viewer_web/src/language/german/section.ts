/** German of the texts in src/section. */
export const SECTION = {
  West: 'Westen',
  South: 'Süden',
  Bottom: 'Unten',
  '{side} side of the section box': 'Seite {side} des Schnittquaders',
  '{side}: drag, or arrow keys': '{side}: ziehen oder Pfeiltasten',
  Box: 'Quader',
  'Line on the plan': 'Linie im Grundriss',
  'Click both ends of the line. What lies to the left of it is kept. Keys: arrows and Enter.':
    'Klicken Sie beide Enden der Linie an. Was links davon liegt, bleibt. Tasten: Pfeile und Eingabe.',
  'Box: drag its sides. Line: a vertical section along it, seen squarely.':
    'Quader: Ziehen Sie seine Seiten. Linie: ein lotrechter Schnitt entlang der Linie, senkrecht betrachtet.',
  'Look at it squarely, to scale': 'Senkrecht betrachten, maßstäblich',
  'Look the other way': 'Blickrichtung umkehren',
  'Sides of the box, scene coordinates': 'Seiten des Quaders, Szenenkoordinaten',
} as const;

/** German of the texts in src/drawing. */
export const DRAWING = {
  'The drawing with its walls, doors and windows. Drag to shift, scroll to zoom, click a wall or an opening to choose it.':
    'Die Zeichnung mit Wänden, Türen und Fenstern. Ziehen verschiebt, Scrollen zoomt, ein Klick wählt eine Wand oder Öffnung.',
  Properties: 'Eigenschaften',
  'Draw a wall': 'Wand zeichnen',
  'Click where it begins and where it ends. Esc ends the row of walls.':
    'Anfang und Ende anklicken. Esc beendet die Folge von Wänden.',
  Thickness: 'Dicke',
  Passage: 'Durchgang',
  Fit: 'Einpassen',
  'The whole storey': 'Das ganze Geschoss',
  'Then: tlsplan plan {file}': 'Danach: tlsplan plan {file}',
  'Add a door': 'Tür hinzufügen',
  'Add a window': 'Fenster hinzufügen',
  'Click a wall.': 'Eine Wand anklicken.',
  Width: 'Breite',
  'Set north': 'Norden setzen',
  'Click two points, the second one to the north of the first.':
    'Zwei Punkte anklicken, den zweiten nördlich vom ersten.',
  'The true length has to be a thousandth to a thousandfold of the drawn one.':
    'Die wahre Länge muss ein Tausendstel bis das Tausendfache der gezeichneten sein.',
  'Set the scale': 'Maßstab setzen',
  'Click two points of a known distance, then give it. All storeys are enlarged alike.':
    'Zwei Punkte mit bekanntem Abstand anklicken, dann diesen eingeben. Alle Geschosse werden gleich vergrößert.',
  'True distance': 'Wahrer Abstand',
  'Set scale': 'Maßstab setzen',
  'Its doors and windows would not fit: move or delete them first.':
    'Ihre Türen und Fenster würden nicht passen: erst verschieben oder löschen.',
  'Wall {id}': 'Wand {id}',
  'No straight piece: it can be moved and deleted. Draw a wall in its place to shape it.':
    'Kein gerades Stück: Es lässt sich verschieben und löschen. Zum Formen eine Wand an seiner Stelle zeichnen.',
  'Drag it across, or one of its ends. Arrow keys move it by 1 cm, with Shift by 10 cm.':
    'Quer ziehen, oder eines der Enden. Pfeiltasten verschieben um 1 cm, mit Umschalt um 10 cm.',
  Length: 'Länge',
  Window: 'Fenster',
  'Gap {id}': 'Lücke {id}',
  'The wall has no room for this width.': 'Die Wand hat keinen Platz für diese Breite.',
  'Nothing in the drawing shows what it is. What is it?': 'Nichts in der Zeichnung zeigt, was es ist. Was ist es?',
  Kind: 'Art',
  'Drag it along its wall, or into another one.': 'An der Wand entlang ziehen, oder in eine andere.',
  'Delete (Del)': 'Löschen (Entf)',
  'To check': 'Zu prüfen',
  'Gaps in walls without a door or a window:': 'Lücken in Wänden ohne Tür oder Fenster:',
  Storey: 'Geschoss',
  '{n, plural, one {# room} other {# rooms}}': '{n, plural, one {# Raum} other {# Räume}}',
  'Floor at': 'Boden auf',
  'Wall height': 'Wandhöhe',
  'Storeys above are raised by as much.': 'Geschosse darüber werden um ebenso viel gehoben.',
  'Its walls enclose no room. Close the gaps, or mark them as open.':
    'Die Wände umschließen keinen Raum. Lücken schließen oder als offen kennzeichnen.',
  Building: 'Gebäude',
  'Names of rooms': 'Namen der Räume',
  'A number, a name, or both, such as 101 Office.': 'Eine Nummer, ein Name oder beides, etwa 101 Büro.',
  'Room {name}': 'Raum {name}',
  'Door height': 'Türhöhe',
  'Sill height': 'Brüstungshöhe',
  'Window head': 'Fenstersturz',
  'Doubtful gaps and stairs': 'Zweifelhafte Lücken und Treppen',
  'count as open': 'gelten als offen',
  'count as walls': 'gelten als Wände',
  'North is not set.': 'Norden ist nicht gesetzt.',
  'North: {angle}° clockwise from up.': 'Norden: {angle}° im Uhrzeigersinn von oben.',
  'Drawings: {names}': 'Zeichnungen: {names}',
  'This plan was made from a model, or its drawing file is no longer beside it.':
    'Dieser Plan entstand aus einem Modell, oder seine Zeichnungsdatei liegt nicht mehr daneben.',
  Drawing: 'Zeichnung',
  'Undo (Ctrl+Z)': 'Rückgängig (Strg+Z)',
  'Redo (Ctrl+Y)': 'Wiederholen (Strg+Y)',
  Saved: 'Gespeichert',
  'Saving …': 'Wird gespeichert …',
  'Not saved': 'Nicht gespeichert',
  'Corrected drawing': 'Berichtigte Zeichnung',
  'Makes the building anew from the drawing as corrected, and plans it beside this plan':
    'Erzeugt das Gebäude neu aus der berichtigten Zeichnung und plant es neben diesem Plan',
  'Load the newer ones': 'Die neueren laden',
  'Correct the drawing': 'Zeichnung berichtigen',
  '{n, plural, one {# gap to check} other {# gaps to check}}':
    '{n, plural, one {# Lücke zu prüfen} other {# Lücken zu prüfen}}',
  'Click a straight wall that is at least as long as this is wide.':
    'Eine gerade Wand anklicken, die mindestens so lang ist, wie dies breit ist.',
  'Click two points that are apart.': 'Zwei Punkte anklicken, die auseinanderliegen.',
} as const;

/** Which markers are drawn as dots: where too many numbers meet, not even those moved aside can be read. */

export interface PlacedMarker {
  readonly id: string;
  readonly x: number;
  readonly y: number;
}

/** A number needs this much room, in CSS pixels. */
const WIDTH = 30;
const HEIGHT = 22;

/**
 * Ids of markers that lie on `most` or more numbers that come before them: those are dots; those named first keep their
 * numbers.
 */
export function crowdedMarkers(markers: readonly PlacedMarker[], most: number): Set<string> {
  const crowded = new Set<string>();
  // Cells as large as a marker: only markers of neighbouring cells can touch.
  const kept = new Map<string, PlacedMarker[]>();
  for (const marker of markers) {
    const [column, row] = [Math.floor(marker.x / WIDTH), Math.floor(marker.y / HEIGHT)];
    let nUnder = 0;
    for (let i = column - 1; i <= column + 1; i++) {
      for (let j = row - 1; j <= row + 1; j++) {
        const near = kept.get(`${i} ${j}`) ?? [];
        nUnder += near.filter(({ x, y }) => Math.abs(x - marker.x) < WIDTH && Math.abs(y - marker.y) < HEIGHT).length;
      }
    }
    if (nUnder >= most) {
      crowded.add(marker.id);
      continue;
    }
    const key = `${column} ${row}`;
    const own = kept.get(key);
    if (own === undefined) kept.set(key, [marker]);
    else own.push(marker);
  }
  return crowded;
}

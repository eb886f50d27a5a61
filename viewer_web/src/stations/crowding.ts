/** Which markers of many are drawn as dots: numbers on top of each other nobody reads. */

export interface PlacedMarker {
  readonly id: string;
  readonly x: number;
  readonly y: number;
}

/** A number needs this much room, in CSS pixels. */
const WIDTH = 30;
const HEIGHT = 22;

/** Ids of markers that lie on one that comes before them; those named first keep their numbers. */
export function crowdedMarkers(markers: readonly PlacedMarker[]): Set<string> {
  const crowded = new Set<string>();
  // Cells as large as a marker: only markers of neighbouring cells can touch.
  const kept = new Map<string, PlacedMarker[]>();
  for (const marker of markers) {
    const [column, row] = [Math.floor(marker.x / WIDTH), Math.floor(marker.y / HEIGHT)];
    let isOn = false;
    for (let i = column - 1; i <= column + 1 && !isOn; i++) {
      for (let j = row - 1; j <= row + 1 && !isOn; j++) {
        const near = kept.get(`${i} ${j}`) ?? [];
        isOn = near.some(({ x, y }) => Math.abs(x - marker.x) < WIDTH && Math.abs(y - marker.y) < HEIGHT);
      }
    }
    if (isOn) {
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

/** Which names can stand in the picture without covering each other. */

export interface NameBox {
  readonly number: number;
  /** Middle of its upper edge, pixels. */
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
  /** Higher ones go first. */
  readonly rank: number;
}

const GAP_PX = 4;

export function namesWithRoom(boxes: readonly NameBox[]): NameBox[] {
  const kept: NameBox[] = [];
  for (const box of [...boxes].sort((a, b) => b.rank - a.rank || a.number - b.number)) {
    const isFree = kept.every(
      (other) =>
        Math.abs(box.x - other.x) > (box.width + other.width) / 2 + GAP_PX ||
        Math.abs(box.y - other.y) > (box.height + other.height) / 2 + GAP_PX,
    );
    if (isFree) kept.push(box);
  }
  return kept;
}

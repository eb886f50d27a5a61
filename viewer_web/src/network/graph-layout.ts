/** Where the graph draws stations: as they stand in plan, floor above floor, so that it reads like a map. */
import type { ShownStation } from '../stations/shown.ts';

export interface GraphPlace {
  readonly id: string;
  readonly number: number;
  readonly x: number;
  readonly y: number;
}

export interface GraphFloor {
  readonly id: string;
  /** Where its strip begins. */
  readonly y: number;
}

export interface GraphLayout {
  readonly width: number;
  readonly height: number;
  readonly places: ReadonlyMap<string, GraphPlace>;
  readonly floors: readonly GraphFloor[];
}

/** Room around the stations of a floor, and above them for its name. */
const MARGIN = 18;
const NAME = 14;
/** Strips keep some height where all stations stand in a row. */
const LEAST_HEIGHT = 24;

/** Lay out in a width; stations of the highest floor come first, north is up. Nearer than `gap` they are pushed apart. */
export function layOut(
  stations: readonly ShownStation[],
  floorsHighestFirst: readonly string[],
  { width, gap }: { readonly width: number; readonly gap: number },
): GraphLayout {
  const xs = stations.map(({ positionM }) => positionM[0]);
  const ys = stations.map(({ positionM }) => positionM[1]);
  const [left, right] = [Math.min(...xs), Math.max(...xs)];
  const [south, north] = [Math.min(...ys), Math.max(...ys)];
  // A long building lies across: its longer side takes the width.
  const isTurned = north - south > right - left;
  const longM = Math.max(right - left, north - south, 1);
  const scale = (width - 2 * MARGIN) / longM;
  const across = ([x, y]: readonly number[]): number => (isTurned ? y - south : x - left) * scale;
  const down = ([x, y]: readonly number[]): number => (isTurned ? x - left : north - y) * scale;
  const stripHeight = Math.max(LEAST_HEIGHT, (isTurned ? right - left : north - south) * scale);
  const places = new Map<string, GraphPlace>();
  const floors: GraphFloor[] = [];
  let top = 0;
  for (const floorId of floorsHighestFirst) {
    const onFloor = stations.filter((station) => station.floorId === floorId);
    if (onFloor.length === 0) continue;
    floors.push({ id: floorId, y: top });
    const placed = onFloor.map(({ id, number, positionM }) => ({
      id,
      number,
      x: MARGIN + across(positionM),
      y: top + NAME + MARGIN + down(positionM),
    }));
    pushApart(placed, gap, { minX: MARGIN, maxX: width - MARGIN });
    for (const one of placed) places.set(one.id, one);
    top = Math.max(top + NAME + 2 * MARGIN + stripHeight, ...placed.map(({ y }) => y + MARGIN));
  }
  return { width, height: top, places, floors };
}

/** A few rounds of moving what overlaps apart; in a fixed order, so that the same stations always lie the same. */
function pushApart(
  places: { readonly id: string; x: number; y: number }[],
  gap: number,
  { minX, maxX }: { readonly minX: number; readonly maxX: number },
): void {
  for (let round = 0; round < 30; round++) {
    for (let i = 0; i < places.length; i++) {
      for (let j = i + 1; j < places.length; j++) {
        const [a, b] = [places[i], places[j]];
        // Two at one place part along a direction that depends on their order alone.
        const dx = b.x - a.x || 0.01 * (j - i);
        const dy = b.y - a.y || 0.013 * (j - i);
        const distance = Math.hypot(dx, dy);
        if (distance >= gap) continue;
        const push = (gap - distance) / 2 / distance;
        a.x = Math.min(maxX, Math.max(minX, a.x - push * dx));
        b.x = Math.min(maxX, Math.max(minX, b.x + push * dx));
        a.y -= push * dy;
        b.y += push * dy;
      }
    }
  }
}

/**
 * The ground of one floor as cells: where a tripod may stand, and the place there that is nearest to a pointer.
 *
 * Cell (column, row) begins at origin + (column, row) * cell; scene frame, metres. The server has the last word on a place: this only
 * keeps a dragged station out of walls while it is under way.
 */

import type { ApiClient } from '../api/client.ts';
import type { GroundHead } from '../api/documents.ts';
import { t } from '../language/language.ts';

export const GROUND = { nothing: 0, walkable: 1, admissible: 2, keptOut: 3 } as const;

export type Place = readonly [number, number];

/** So far from the border of its cell stays a place that was moved there: on the border rounding decides. */
const MARGIN_CELLS = 0.02;

export class GroundMap {
  readonly floorId: string;
  readonly nAdmissible: number;

  constructor(
    readonly head: GroundHead,
    /** Row by row, from the lowest y. */
    readonly values: Uint8Array,
  ) {
    const n = head.width * head.height;
    if (values.length < n)
      throw new RangeError(
        t('ground of {floor}: {n} cells, expected {expected}', { floor: head.floor, n: values.length, expected: n }),
      );
    this.floorId = head.floor;
    let nAdmissible = 0;
    for (let i = 0; i < n; i++) if (values[i] === GROUND.admissible) nAdmissible++;
    this.nAdmissible = nAdmissible;
  }

  /** What the cell at a place is; `nothing` outside the map. */
  at([x, y]: Place): number {
    const [column, row] = this.cellOf(x, y);
    return this.isInside(column, row) ? this.values[row * this.head.width + column] : GROUND.nothing;
  }

  /**
   * The admissible place nearest to a pointer: the pointer's own where it may stand, else the nearest point of the nearest
   * admissible cell, so that a station dragged against a wall slides along it. Null where the floor has none.
   */
  nearestAdmissible([x, y]: Place): Place | null {
    if (this.nAdmissible === 0) return null;
    if (this.at([x, y]) === GROUND.admissible) return [x, y];
    const { width, height } = this.head;
    // From the cell of the map nearest to the pointer, ring by ring; a ring further than the best found can't better it.
    const [column, row] = this.cellOf(x, y);
    const start: Place = [clamp(column, 0, width - 1), clamp(row, 0, height - 1)];
    const outsideM = Math.hypot(...this.toCell(x, y, ...start));
    let best: Place | null = null;
    let bestM = Number.POSITIVE_INFINITY;
    for (let ring = 0; ring <= Math.max(width, height); ring++) {
      if ((ring - 1) * this.head.cell_m - outsideM > bestM) break;
      this.forRing(start, ring, (c, r) => {
        const [dx, dy] = this.toCell(x, y, c, r);
        const distanceM = Math.hypot(dx, dy);
        if (distanceM >= bestM) return;
        bestM = distanceM;
        best = [x + dx, y + dy];
      });
    }
    return best;
  }

  /** Call `visit` for the admissible cells whose larger offset from `start` is `ring`. */
  private forRing(start: Place, ring: number, visit: (column: number, row: number) => void): void {
    const { width, height } = this.head;
    const [firstRow, lastRow] = [Math.max(0, start[1] - ring), Math.min(height - 1, start[1] + ring)];
    for (let r = firstRow; r <= lastRow; r++) {
      const isEnd = r === start[1] - ring || r === start[1] + ring;
      const step = isEnd || ring === 0 ? 1 : 2 * ring;
      for (let c = start[0] - ring; c <= start[0] + ring; c += step) {
        if (c >= 0 && c < width && this.values[r * width + c] === GROUND.admissible) visit(c, r);
      }
    }
  }

  /** The way from a place to the nearest point of a cell, short of the cell's border. */
  private toCell(x: number, y: number, column: number, row: number): [number, number] {
    const { origin, cell_m } = this.head;
    const half = (0.5 - MARGIN_CELLS) * cell_m;
    const [cx, cy] = [origin[0] + (column + 0.5) * cell_m, origin[1] + (row + 0.5) * cell_m];
    return [clamp(x, cx - half, cx + half) - x, clamp(y, cy - half, cy + half) - y];
  }

  private cellOf(x: number, y: number): Place {
    const { origin, cell_m } = this.head;
    return [Math.floor((x - origin[0]) / cell_m), Math.floor((y - origin[1]) / cell_m)];
  }

  private isInside(column: number, row: number): boolean {
    return column >= 0 && row >= 0 && column < this.head.width && row < this.head.height;
  }
}

/** As the review leaves it; where the live side computes. */
export async function fetchGround(client: ApiClient, floorId: string): Promise<GroundMap> {
  const { head, body } = await client.framed<GroundHead>(`live/ground/${encodeURIComponent(floorId)}`);
  return new GroundMap(head, new Uint8Array(body));
}

const clamp = (value: number, low: number, high: number): number => Math.min(high, Math.max(low, value));

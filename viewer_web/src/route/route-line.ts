/** The route in three.js: all of it, and the leg that is looked at. */
import { Group } from 'three';
import { type Slice, sliceOfFloor } from '../floors/cut.ts';
import { FatLines } from '../stations/link-lines.ts';
import type { RouteSegment } from './route.ts';

const COLORS = { light: ['#c2410c', '#7a1f00'], dark: ['#fb923c', '#ffd7ad'] } as const;

export class RouteLine {
  readonly group = new Group();
  private readonly all = new FatLines(3);
  private readonly leg = new FatLines(7);

  constructor() {
    this.group.add(this.all.lines, this.leg.lines);
  }

  update(segments: readonly RouteSegment[], slices: readonly Slice[], leg: number | null, isDark: boolean): void {
    const [plain, chosen] = COLORS[isDark ? 'dark' : 'light'];
    this.all.clear();
    this.leg.clear();
    for (const segment of segments) {
      const [from, to] = [sliceOfFloor(slices, segment.fromFloor), sliceOfFloor(slices, segment.toFloor)];
      if (from === undefined || to === undefined) continue;
      const raised = ([x, y, z]: readonly number[], slice: Slice): number[] => [x, y, z + slice.liftM];
      const lines = segment.leg === leg ? this.leg : this.all;
      lines.add([...raised(segment.fromM, from), ...raised(segment.toM, to)], segment.leg === leg ? chosen : plain);
    }
    this.all.show();
    this.leg.show();
  }

  setResolution(width: number, height: number): void {
    this.all.material.resolution.set(width, height);
    this.leg.material.resolution.set(width, height);
  }

  dispose(): void {
    this.all.dispose();
    this.leg.dispose();
  }
}

/** Lines between stations, coloured by how firmly their shared surface holds them together. */
import { Color, Group, Vector2, Vector3 } from 'three';
import { LineMaterial } from 'three/addons/lines/LineMaterial.js';
import { LineSegments2 } from 'three/addons/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/addons/lines/LineSegmentsGeometry.js';
import { type Slice, sliceOfFloor } from '../floors/cut.ts';
import type { PlanLink } from '../load/plan-json.ts';
import { type Counting, counts } from '../network/graph.ts';
import { strengthColor } from '../network/strength.ts';
import type { Store } from '../store.ts';
import type { ShownStation } from './shown.ts';
import { weakGlyph } from './weak-glyph.ts';

const PLAIN_WIDTH = 2.5;
const CHOSEN_WIDTH = 5;

export interface LinksShown {
  readonly stations: readonly ShownStation[];
  readonly links: readonly PlanLink[];
  /** Of the links, that which is chosen. */
  readonly chosen: PlanLink | null;
  readonly isDark: boolean;
}

/** All links that count, those of the chosen station, or the chosen pair's, whether it counts or not. */
export function linksShown(store: Store, counting: Counting): LinksShown {
  const [pair, stationId] = [store.pair.value, store.stationId.value];
  const isOf = (link: PlanLink, id: string): boolean => link.a === id || link.b === id;
  const chosen = store.shownLinks.value.find((link) => pair?.every((id) => isOf(link, id))) ?? null;
  const isAll = store.showLinks.value || (store.tab.value === 'network' && stationId === null);
  const links = store.shownLinks.value.filter(
    (link) => link === chosen || (counts(link, counting) && (isAll || isOf(link, stationId ?? ''))),
  );
  return { stations: store.shownStations.value, links, chosen, isDark: store.isDark.value };
}

export class LinkLines {
  readonly group = new Group();
  private readonly plain = new FatLines(PLAIN_WIDTH);
  /** The chosen link, and how it is held least. */
  private readonly chosen = new FatLines(CHOSEN_WIDTH);

  constructor() {
    this.group.add(this.plain.lines, this.chosen.lines);
    this.group.renderOrder = 2;
  }

  /** Show links between the stations that are shown. */
  update(slices: readonly Slice[], { stations, links, chosen, isDark }: LinksShown): void {
    const places = new Map<string, Vector3>();
    for (const { id, floorId, positionM } of stations) {
      const slice = sliceOfFloor(slices, floorId);
      const [x, y, z] = positionM;
      if (slice !== undefined) places.set(id, new Vector3(x, y, z + slice.liftM));
    }
    this.plain.clear();
    this.chosen.clear();
    for (const link of links) {
      const [from, to] = [places.get(link.a), places.get(link.b)];
      if (from === undefined || to === undefined) continue;
      const color = strengthColor(link.strength, isDark);
      const lines = link === chosen ? this.chosen : this.plain;
      lines.add([...from.toArray(), ...to.toArray()], color);
      const weak = link === chosen ? link.weak_motion : null;
      if (weak !== null) lines.add(weakGlyph(from.clone().lerp(to, 0.5), weak.direction, weak.kind === 'turn'), color);
    }
    this.plain.show();
    this.chosen.show();
  }

  setResolution(width: number, height: number): void {
    this.plain.material.resolution.set(width, height);
    this.chosen.material.resolution.set(width, height);
  }

  dispose(): void {
    this.plain.dispose();
    this.chosen.dispose();
  }
}

/** Lines some pixels wide, drawn over everything. */
export class FatLines {
  readonly lines: LineSegments2;
  readonly material: LineMaterial;
  private ends: number[] = [];
  private colors: number[] = [];

  constructor(widthPixels: number) {
    this.material = new LineMaterial({
      linewidth: widthPixels,
      vertexColors: true,
      depthTest: false,
      transparent: true,
      resolution: new Vector2(1, 1),
    });
    this.lines = new LineSegments2(new LineSegmentsGeometry(), this.material);
    this.lines.frustumCulled = false;
    this.lines.visible = false;
    this.lines.renderOrder = 2;
  }

  clear(): void {
    this.ends = [];
    this.colors = [];
  }

  /** `ends`: both ends of each segment, flat. */
  add(ends: readonly number[], color: string): void {
    const { r, g, b } = new Color(color);
    for (let i = 0; i < ends.length; i += 3) this.colors.push(r, g, b);
    for (const x of ends) this.ends.push(x);
  }

  /** Draw what was added since `clear`. */
  show(): void {
    this.lines.visible = this.ends.length > 0;
    if (this.ends.length === 0) return;
    this.lines.geometry.dispose();
    this.lines.geometry = new LineSegmentsGeometry().setPositions(this.ends).setColors(this.colors);
  }

  dispose(): void {
    this.lines.geometry.dispose();
    this.material.dispose();
  }
}

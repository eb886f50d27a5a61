/** Takes points off the building, by pointer or by a crosshair that keys move, and makes measurements of them. */
import { batch, effect } from '@preact/signals';
import { localOf, sceneOf } from '../edit/draft.ts';
import { floorAt } from '../edit/review-areas.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { PointerConsumer } from '../scene/pointer.ts';
import { cutAlong } from '../section/sections.ts';
import type { Store } from '../store.ts';
import { type Surroundings, surroundingsOf, wallsAround } from './set-up.ts';
import { type Measurement, type MeasurePoint, POINTS_OF, type SiteTool } from './state.ts';

/** Nearer in the picture than this to a corner of the outline is that corner. */
const SAME_PIXELS = 10;
/** Places nearer than this are one. */
const SAME_M = 0.001;

export class Measurer {
  private readonly endings: (() => void)[];
  private readonly walls: Surroundings;
  private lastId = 0;

  constructor(
    private readonly store: Store,
    private readonly loaded: LoadedPlan,
    private readonly view: PlanView,
  ) {
    this.walls = surroundingsOf(loaded.stage, (ray, farM) => view.firstOfBuilding(ray, farM));
    let release = (): void => undefined;
    this.endings = [
      effect(() => {
        release();
        // Only while it has a tool, and then before all others: its clicks choose nothing.
        release = store.measuring.tool.value === null ? () => undefined : view.onPointer(this.consumer);
      }),
      () => release(),
      effect(() => this.followSetUp()),
    ];
  }

  dispose(): void {
    for (const end of this.endings) end();
  }

  take(tool: SiteTool | null): void {
    const { measuring } = this.store;
    batch(() => {
      measuring.tool.value = tool;
      measuring.points.value = [];
      measuring.next.value = null;
      measuring.cursor.value = null;
    });
  }

  /** A station's sensor is a point too. */
  addStation(stationId: string): void {
    const station = this.store.shownStations.peek().find(({ id }) => id === stationId);
    if (station === undefined) return;
    const sceneM = sceneOf(station.positionM, this.loaded.stage.offsetM);
    this.add({ sceneM, floorId: station.floorId, on: 'station' });
  }

  addAtCursor(): void {
    const { next, tool, cursor } = this.store.measuring;
    const [point, at] = [next.peek(), cursor.peek()];
    const { left, top } = this.view.box;
    if (tool.peek() === 'surface' && at !== null) this.store.pick(this.view.surfaceAt(left + at.x, top + at.y));
    else if (point !== null) this.add(point);
  }

  moveCursor(dx: number, dy: number): void {
    const { cursor } = this.store.measuring;
    const { left, top, width, height } = this.view.box;
    const from = cursor.peek() ?? { x: width / 2, y: height / 2 };
    const [x, y] = [clamp(from.x + dx, width), clamp(from.y + dy, height)];
    batch(() => {
      cursor.value = { x, y };
      this.store.measuring.next.value = this.pointAt(left + x, top + y);
    });
  }

  takeBack(): void {
    const { points } = this.store.measuring;
    points.value = points.peek().slice(0, -1);
  }

  /** The outline is an area, or the points are a measurement. */
  finish(): void {
    const { measuring } = this.store;
    const [kind, points] = [measuring.tool.peek(), measuring.points.peek()];
    if (kind === null || kind === 'surface' || points.length < Math.min(3, POINTS_OF[kind])) return;
    batch(() => {
      measuring.points.value = [];
      if (kind === 'section') {
        const [from, to] = points.map(({ sceneM }) => localOf(sceneM, this.loaded.stage.offsetM));
        cutAlong(this.store, [from[0], from[1]], [to[0], to[1]]);
        this.take(null);
        return;
      }
      this.lastId++;
      const made: Measurement = { id: this.lastId, kind, points, isInPlan: this.store.isPlanView.peek() };
      measuring.done.value = [...measuring.done.peek(), made];
    });
  }

  /** The walls around the chosen station, wherever it is dragged. */
  private followSetUp(): void {
    const { measuring, shownStations, stationId } = this.store;
    const station = shownStations.value.find(({ id }) => id === stationId.value);
    const isShown = measuring.showsSetUp.value && station !== undefined;
    measuring.walls.value = isShown ? wallsAround(station.positionM, this.walls) : [];
  }

  private readonly consumer: PointerConsumer = {
    // On a station's number: the click that follows adds the station, and nothing is dragged.
    onDown: ({ stationId }) => stationId !== null,
    onHover: ({ clientX, clientY }) => {
      batch(() => {
        this.store.measuring.cursor.value = null;
        this.store.measuring.next.value = this.pointAt(clientX, clientY);
      });
    },
    onClick: ({ clientX, clientY }) => {
      // Whoever looks around would do the same, and open floors.
      if (this.store.measuring.tool.peek() === 'surface') {
        this.store.pick(this.view.surfaceAt(clientX, clientY));
        return true;
      }
      const point = this.pointAt(clientX, clientY);
      if (point !== null) this.add(point);
      return true;
    },
  };

  private add(point: MeasurePoint): void {
    const { measuring } = this.store;
    const [tool, points] = [measuring.tool.peek(), measuring.points.peek()];
    if (tool === null || tool === 'surface') return;
    const [first, last] = [points[0], points.at(-1)];
    if (tool === 'area' && points.length >= 3 && first !== undefined && this.isAt(point, first)) {
      this.finish();
      return;
    }
    if (last !== undefined && apartM(point, last) < SAME_M) return;
    // A section stands upright: between places one above the other there is no line in plan.
    if (tool === 'section' && last !== undefined && inPlanM(point, last) < SAME_M) return;
    measuring.points.value = [...points, point];
    if (measuring.points.peek().length === POINTS_OF[tool]) this.finish();
  }

  private isAt(point: MeasurePoint, corner: MeasurePoint): boolean {
    const [a, b] = [point, corner].map(({ sceneM, floorId }) =>
      this.view.project(localOf(sceneM, this.loaded.stage.offsetM), floorId),
    );
    return a !== null && b !== null && Math.hypot(a.x - b.x, a.y - b.y) < SAME_PIXELS;
  }

  private pointAt(clientX: number, clientY: number): MeasurePoint | null {
    const snapped = this.view.snapAt(clientX, clientY);
    const { floors, offsetM } = this.loaded.stage;
    if (snapped === null) return this.besideBuilding(clientX, clientY);
    const { x, y, z } = snapped.pointM;
    const floorId = snapped.slice.floorId ?? floorAt(floors, z);
    return { sceneM: sceneOf([x, y, z], offsetM), floorId, on: snapped.kind };
  }

  /** A section's line may begin and end beside the building, in the plan view. */
  private besideBuilding(clientX: number, clientY: number): MeasurePoint | null {
    const { store, loaded } = this;
    const [floor] = loaded.stage.floors;
    const isPlaced = store.measuring.tool.peek() === 'section' && store.isPlanView.peek();
    const at = isPlaced && floor !== undefined && this.view.levelAt(clientX, clientY, floor.id, floor.elevationM);
    if (!at) return null;
    return { sceneM: sceneOf(at, loaded.stage.offsetM), floorId: store.floorId.peek() ?? floor.id, on: 'surface' };
  }
}

const clamp = (value: number, most: number): number => Math.min(most, Math.max(0, value));
const apartM = (a: MeasurePoint, b: MeasurePoint): number => Math.hypot(...a.sceneM.map((x, k) => x - b.sceneM[k]));
const inPlanM = (a: MeasurePoint, b: MeasurePoint): number =>
  Math.hypot(a.sceneM[0] - b.sceneM[0], a.sceneM[1] - b.sceneM[1]);

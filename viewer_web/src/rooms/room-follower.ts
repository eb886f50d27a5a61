/** Keeps the figures of rooms in step with what stations see and where they stand, edited ones too. */
import { effect, untracked } from '@preact/signals';
import { Ray, Vector3 } from 'three';
import { WHOLE_BUILDING } from '../floors/cut.ts';
import { REASON } from '../heat/layers.ts';
import type { PatchPaint } from '../heat/patch-paint.ts';
import { fetchPatchRooms, fetchPatchValues, type LoadedPlan } from '../load/fetch-plan.ts';
import { patchAt } from '../scene/drawn-surfaces.ts';
import type { SurfacePicker } from '../scene/pick.ts';
import type { ShownStation } from '../stations/shown.ts';
import type { Store } from '../store.ts';
import { ROOM_COVERAGE, roomClasses, roomFigures } from './rooms.ts';

/** Instruments stand lower than this above the ground. */
const MOST_HEIGHT_M = 5;
/** From a surface that is in no room the ray goes on behind it. */
const BEHIND_M = 1e-3;
const DOWN = new Vector3(0, 0, -1);

export class RoomFollower {
  private isDisposed = false;
  private readonly fetching = new AbortController();
  private readonly endings: (() => void)[] = [];

  constructor(
    private readonly store: Store,
    private readonly loaded: LoadedPlan,
    private readonly paint: PatchPaint,
    private readonly picker: SurfacePicker,
  ) {
    void this.begin();
  }

  dispose(): void {
    this.isDisposed = true;
    this.fetching.abort();
    for (const end of this.endings) end();
  }

  private async begin(): Promise<void> {
    const { loaded, store } = this;
    const list = loaded.layers?.rooms?.list;
    if (list === undefined) return;
    try {
      const hasReasons = (loaded.layers?.reasons.length ?? 0) > 0;
      const [roomOfPatch, reasonOfPatch] = await Promise.all([
        fetchPatchRooms(loaded),
        hasReasons ? fetchPatchValues(loaded, REASON, this.fetching.signal) : null,
      ]);
      if (this.isDisposed) return;
      this.endings.push(
        effect(() => {
          store.seenRevision.value;
          untracked(() => {
            const { timesSeen, areas: areasM2 } = this.paint;
            const { seen_from: seenFrom, coverage: required } = loaded.plan.requirements;
            const reasons = loaded.layers?.reasons ?? [];
            const patches = { roomOfPatch, timesSeen, areasM2, reasonOfPatch, reasons, seenFrom };
            const rooms = roomFigures(list, patches);
            store.rooms.value = rooms;
            this.paint.keep(ROOM_COVERAGE, roomClasses(rooms, roomOfPatch, required));
          });
        }),
        effect(() => {
          const stations = new Map<number, string[]>();
          for (const station of store.shownStations.value) {
            if (station.marks.includes('removed')) continue;
            const room = this.roomBelow(station, roomOfPatch);
            if (room !== null) stations.set(room, [...(stations.get(room) ?? []), station.id]);
          }
          store.stationsOfRooms.value = stations;
        }),
      );
    } catch (error) {
      if (!this.isDisposed) store.roomTrouble.value = (error as Error).message;
    }
  }

  /** The room of the first surface below a station that is in one. */
  private roomBelow({ positionM }: ShownStation, roomOfPatch: Uint16Array): number | null {
    const nRooms = this.loaded.layers?.rooms?.list.length ?? 0;
    const ray = new Ray(new Vector3(...positionM), DOWN);
    for (let farM = MOST_HEIGHT_M; farM > 0; ) {
      const hit = this.picker.firstHit(ray, [WHOLE_BUILDING], farM);
      if (hit === null) return null;
      const room = roomOfPatch[patchAt(this.loaded.stage.triangles, hit)];
      if (room < nRooms) return room;
      farM -= hit.distanceM + BEHIND_M;
      ray.origin.z -= hit.distanceM + BEHIND_M;
    }
    return null;
  }
}

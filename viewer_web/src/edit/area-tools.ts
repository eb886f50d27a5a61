/** Tools that mark places: zones corner by corner, forbidden places, ground, and where a comment is pinned. */

import { batch, untracked } from '@preact/signals';
import type { ZoneKind } from '../api/documents.ts';
import type { ReviewClient } from '../api/review-client.ts';
import { t } from '../language/language.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import type { StageFloor } from '../load/stage.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { PointerConsumer, PointerPlace } from '../scene/pointer.ts';
import type { Picked } from '../scene/state.ts';
import type { Store } from '../store.ts';
import { addEntrance, addZone, forbid, pickGround, setDoor } from './changes.ts';
import { coplanarRegion, isSteep } from './coplanar-region.ts';
import { type Door, doorAt, doorsOf } from './doors.ts';
import { localOf, sceneOf } from './draft.ts';
import { ENTRANCE_WORDS } from './entrance-words.ts';
import type { Place } from './ground-map.ts';
import { nothingToPick, standingOn } from './ground-state.ts';
import { faultOf, NEAREST_CORNERS_M } from './outline.ts';
import { toolInHand } from './readiness.ts';
import { floorAt } from './review-areas.ts';
import { stationsOf } from './review-stations.ts';

/** A click so near to the first corner closes the outline. */
const CLOSING_PIXELS = 14;

export class AreaTools {
  private doors: readonly Door[] | null = null;

  constructor(
    private readonly store: Store,
    private readonly reviewClient: ReviewClient,
    private readonly view: PlanView,
    private readonly loaded: LoadedPlan,
    private readonly addStationAt: (floorId: string, at: Place, groundM: number) => Promise<void>,
  ) {}

  readonly consumer: PointerConsumer = {
    onClick: (place) => {
      const tool = untracked(() => toolInHand(this.store));
      if (tool === null || tool === 'select') return false;
      this.click(place);
      return true;
    },
  };

  /** Commit the outline that is drawn, where it is an area. */
  async finishOutline(): Promise<void> {
    const { editing } = this.store;
    const [tool, outline, floor] = [editing.tool.peek(), editing.outline.peek(), editing.outlineFloor.peek()];
    if ((tool !== 'keep_out' && tool !== 'priority') || floor === null) return;
    const fault = faultOf(outline);
    const coverage = tool === 'priority' ? shareOf(editing.priorityPercent.peek()) : null;
    if (fault !== null || (tool === 'priority' && coverage === null)) {
      this.reviewClient.warn(fault ?? t('Priority zone: the required coverage is a percentage up to 100.'));
      return;
    }
    const name = editing.zoneName.peek().trim();
    const isDone = await this.reviewClient.commit(zoneInWords(tool), [
      addZone({ kind: tool, outline, floor, name, coverage }),
    ]);
    if (isDone) this.dropOutline();
  }

  takeCornerBack(): void {
    const { outline } = this.store.editing;
    outline.value = outline.peek().slice(0, -1);
  }

  dropOutline(): void {
    batch(() => {
      this.store.editing.outline.value = [];
      this.store.editing.outlineFloor.value = null;
      this.store.editing.zoneName.value = '';
    });
  }

  private click(place: PointerPlace): void {
    const tool = this.store.editing.tool.peek();
    if (tool === 'keep_out' || tool === 'priority') {
      this.addCorner(place);
      return;
    }
    const picked = this.view.surfaceAt(place.clientX, place.clientY);
    // Where the cut opens a door it is a door all the same.
    if (picked === null || (picked.isSection && tool !== 'doors')) {
      this.reviewClient.warn(t('No surface under the pointer: click on one.'));
      return;
    }
    if (tool === 'ground') void this.pickGround(picked);
    else if (tool === 'forbid') void this.forbid(picked);
    else if (tool === 'add') this.addStation(picked);
    else if (tool === 'entrance') void this.setEntrance(picked);
    else if (tool === 'doors') void this.markDoor(picked);
    else this.pinComment(picked);
  }

  private addCorner(place: PointerPlace): void {
    const { editing } = this.store;
    const { clientX, clientY } = place;
    const floorId = editing.outlineFloor.peek() ?? this.floorUnder(clientX, clientY);
    const floor = this.loaded.stage.floors.find(({ id }) => id === floorId);
    const at = floor && this.view.levelAt(clientX, clientY, floor.id, floor.elevationM);
    if (floor === undefined || !at) {
      this.reviewClient.warn(t('Click on the floor of the zone.'));
      return;
    }
    const corners = editing.outline.peek();
    if (corners.length >= 3 && this.isAtFirstCorner(place, floor)) {
      void this.finishOutline();
      return;
    }
    const [x, y] = sceneOf(at, this.loaded.stage.offsetM);
    const last = corners.at(-1);
    if (last !== undefined && Math.hypot(x - last[0], y - last[1]) < NEAREST_CORNERS_M) return;
    batch(() => {
      editing.outline.value = [...corners, [x, y]];
      editing.outlineFloor.value = floor.id;
    });
  }

  private isAtFirstCorner({ clientX, clientY, event }: PointerPlace, { id, elevationM }: StageFloor): boolean {
    const [first] = this.store.editing.outline.peek();
    const { offsetM } = this.loaded.stage;
    const at = this.view.project([first[0] - offsetM[0], first[1] - offsetM[1], elevationM], id);
    const box = (event.target as Element).getBoundingClientRect();
    return at !== null && Math.hypot(at.x + box.left - clientX, at.y + box.top - clientY) < CLOSING_PIXELS;
  }

  private floorUnder(clientX: number, clientY: number): string | null {
    const chosen = this.store.floorId.peek();
    if (chosen !== null) return chosen;
    const picked = this.view.surfaceAt(clientX, clientY);
    return picked === null ? null : this.floorOf(picked);
  }

  private floorOf({ groundOf, pointM }: Picked): string {
    const { floors, offsetM } = this.loaded.stage;
    return groundOf ?? this.store.floorId.peek() ?? floorAt(floors, pointM[2] - offsetM[2]);
  }

  private async pickGround(picked: Picked): Promise<void> {
    if (isSteep(this.loaded.stage.triangles.cornersM, picked.triangle)) {
      this.reviewClient.warn(t('This surface is too steep to stand on: click on a level one.'));
      return;
    }
    const isGround = this.store.editing.marksGround.peek();
    const floorId = this.store.floorId.peek() ?? '';
    const region = coplanarRegion(this.loaded.stage.triangles.cornersM, picked.triangle);
    const words = nothingToPick(region, this.loaded, this.reviewClient.review.peek(), isGround, floorId);
    if (words !== null) {
      this.reviewClient.notice.value = { kind: 'note', text: words };
      return;
    }
    const label = isGround ? t('mark a walkable floor') : t('mark as not a floor');
    const commit = async (): Promise<void> => {
      await this.reviewClient.commit(label, [pickGround(picked.pointM, isGround, floorId)]);
    };
    const standing = isGround ? [] : standingOn(region, this.loaded, stationsOf(this.store), floorId);
    if (standing.length === 0) return commit();
    this.reviewClient.question.value = {
      title: t('Mark as not a floor?'),
      text: t(
        '{n, plural, one {A station stands} other {# stations stand}} on this floor: {names}. Without it, a plan that is made again has no station there.',
        { n: standing.length, names: standing.join(', ') },
      ),
      yes: t('Not a floor'),
      onYes: () => void commit(),
    };
  }

  private async forbid(picked: Picked): Promise<void> {
    const radiusM = this.store.editing.forbidRadiusM.peek();
    await this.reviewClient.commit(t('forbid a position'), [forbid(picked.pointM, radiusM, this.floorOf(picked))]);
  }

  private async setEntrance({ groundOf, pointM }: Picked): Promise<void> {
    if (groundOf === null) this.reviewClient.warn(ENTRANCE_WORDS.entranceNeedsFloor);
    else await this.reviewClient.commit(ENTRANCE_WORDS.setEntrance, [addEntrance(pointM, groundOf)]);
  }

  private async markDoor({ element, pointM }: Picked): Promise<void> {
    const { stage } = this.loaded;
    this.doors ??= doorsOf(stage);
    const door = doorAt(this.doors, element, localOf(pointM, stage.offsetM));
    const state = this.store.editing.doorState.peek();
    if (door === null) {
      this.reviewClient.warn(this.doors.length === 0 ? ENTRANCE_WORDS.noDoors : ENTRANCE_WORDS.doorNeedsDoor);
      return;
    }
    const { sourceId } = door.element;
    if (this.reviewClient.review.peek()?.doors[sourceId] === state) {
      this.reviewClient.notice.value = { kind: 'note', text: ENTRANCE_WORDS.isMarked(state) };
    } else await this.reviewClient.commit(ENTRANCE_WORDS.markDoor(state), [setDoor(sourceId, state)]);
  }

  /** As near to a surface as a tripod can stand. */
  addStation(picked: Picked): void {
    const floorId = this.floorOf(picked);
    // A click on a wall or a table means the floor at that place.
    const floor = this.loaded.stage.floors.find(({ id }) => id === floorId);
    const isGround = picked.groundOf !== null;
    const groundM = isGround ? picked.pointM[2] : (floor?.elevationM ?? 0) + this.loaded.stage.offsetM[2];
    void this.addStationAt(floorId, [picked.pointM[0], picked.pointM[1]], groundM);
  }

  private pinComment(picked: Picked): void {
    batch(() => {
      this.store.editing.commentSpot.value = {
        target: picked.element.sceneIndex,
        positionM: picked.pointM,
        title: picked.element.name || t('a surface'),
      };
      this.store.editing.tool.value = 'select';
      this.store.tab.value = 'review';
    });
  }
}

export function zoneInWords(kind: ZoneKind): string {
  return kind === 'keep_out' ? t('keep-out') : t('priority zone');
}

/** "98" or "98 %" as a fraction; null: no percentage. */
export function shareOf(typed: string): number | null {
  const value = Number(typed.replace('%', '').replace(',', '.').trim());
  return value > 0 && value <= 100 ? value / 100 : null;
}

/** The proposed station over the picture: a dashed ring, and lines to the stations that it registers with. */

import { useEffect, useRef } from 'preact/hooks';
import type { Point } from '../api/documents.ts';
import { localOf } from '../edit/draft.ts';
import { t } from '../language/language.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { countingOf, counts } from '../network/graph.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { dropGhost } from './ghosts.ts';
import './ghost.css';

interface GhostMarkerProps {
  readonly store: Store;
  readonly loaded: LoadedPlan;
  readonly view: PlanView;
}

export function GhostMarker({ store, loaded, view }: GhostMarkerProps) {
  const ring = useRef<HTMLSpanElement>(null);
  const lines = useRef(new Map<string, SVGLineElement>());
  const ghost = store.ghost.value;
  useDropping(store);
  useEffect(() => {
    if (ghost === null) return undefined;
    const local = localOf(ghost.positionM, loaded.stage.offsetM);
    view.frame(placesAround(store, loaded, local), ghost.floorId);
    return view.onFrame(() => {
      const at = view.project(local, ghost.floorId);
      if (ring.current !== null) {
        ring.current.hidden = at === null;
        if (at !== null) ring.current.style.transform = `translate(-50%, -50%) translate(${at.x}px, ${at.y}px)`;
      }
      for (const [id, line] of lines.current) {
        const station = store.shownStations.peek().find((one) => one.id === id);
        const to = station === undefined ? null : view.project(station.positionM, station.floorId);
        line.style.display = at === null || to === null ? 'none' : '';
        if (at === null || to === null) continue;
        for (const [name, value] of Object.entries({ x1: at.x, y1: at.y, x2: to.x, y2: to.y }))
          line.setAttribute(name, value.toFixed(1));
      }
    });
  }, [ghost, view, loaded, store]);
  if (ghost === null) return null;
  const counting = countingOf(loaded.plan);
  const linked = (ghost.head?.links ?? []).filter((link) => counts(link, counting)).map(({ b }) => b);
  return (
    <div class="ghost-layer">
      <svg aria-hidden="true">
        {linked.map((id) => (
          <line
            key={id}
            ref={(line) => {
              if (line === null) lines.current.delete(id);
              else lines.current.set(id, line);
            }}
          />
        ))}
      </svg>
      <span class="ghost-marker" role="img" aria-label={t('Proposed station')} ref={ring}>
        +1
      </span>
    </div>
  );
}

const AROUND_M = 2.5;

/** What the picture has to have in it: the ground around the station, and the surface that it is for. */
function placesAround(store: Store, { stage }: LoadedPlan, [x, y, z]: Point): Point[] {
  const focus = store.unseenFocus.peek();
  const box = focus?.surface.pieces[focus.piece]?.box ?? [];
  return [
    [x - AROUND_M, y - AROUND_M, z],
    [x + AROUND_M, y + AROUND_M, z],
    ...box.map((corner) => localOf(corner, stage.offsetM)),
  ];
}

/** A proposal is of the plan as it was when it was made, and of the tab that it was made on. */
function useDropping(store: Store): void {
  const [tab, revision] = [store.tab.value, store.reviewClient?.review.value?.revision ?? 0];
  const [stationId, pair] = [store.stationId.value, store.pair.value];
  const isFirst = useRef(true);
  useEffect(() => {
    if (!isFirst.current) dropGhost(store);
    isFirst.current = false;
  }, [tab, revision, stationId, pair, store]);
}

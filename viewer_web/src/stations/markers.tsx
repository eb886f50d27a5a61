/** Numbered markers over the canvas: buttons of constant size, moved with every frame. */

import { useEffect, useRef } from 'preact/hooks';
import { t } from '../language/language.ts';
import { groupColor } from '../network/groups.ts';
import { type ProgressState, progressOf, stateInWords } from '../review/progress.ts';
import { ProgressSign } from '../review/progress-sign.tsx';
import type { MarkerPlace } from '../scene/marker-place.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { type Box, besidePanels, coverByPanels, panelsOver } from './beside-panels.ts';
import { coveredAmong, isSameCovered } from './covered.ts';
import { crowdedMarkers } from './crowding.ts';
import { clickStation } from './select.ts';
import type { ShownStation } from './shown.ts';
import { NOWHERE, type Offset, Spreader } from './spreading.ts';

export function Markers({ store, view }: { store: Store; view: PlanView }) {
  const layer = useRef<HTMLDivElement>(null);
  const buttons = useRef(new Map<string, HTMLButtonElement>());
  const stems = useRef(new Map<string, HTMLElement>());
  const placed = useRef<ReadonlyMap<string, PlacedMarker>>(new Map());
  useEffect(() => {
    const spreader = new Spreader();
    let dots: ReadonlySet<string> = new Set();
    view.onMarkers = (all) => {
      const dragged = store.editing.underWay.peek()?.stationId ?? null;
      const pinned = dragged ?? store.stationId.peek();
      // Behind a wall of its own floor a marker is dimmed; behind another floor it would seem to stand there.
      const through = [pinned, ...(store.pair.peek() ?? [])].filter((id) => id !== null);
      const places = new Map([...all].filter(([id, { coveredBy }]) => coveredBy === null || through.includes(id)));
      tellCovered(store, all, through, layer.current);
      dots = dotsAmong(places, pinned, dots);
      const panels = layer.current === null ? [] : panelsOver(layer.current);
      placed.current = placeMarkers(places, { pinned, dragged, dots, panels }, spreader);
      for (const [id, button] of buttons.current) moveButton(button, placed.current.get(id), layer.current);
      for (const [id, stem] of stems.current) moveStem(stem, placed.current.get(id));
    };
    return () => {
      view.onMarkers = () => undefined;
    };
  }, [view]);
  const stations = store.shownStations.value;
  const progress = progressOf(store);
  const isChosen = (id: string): boolean => store.stationId.value === id || store.selection.value.has(id);
  /** On the tab of the network, that of its group. */
  const colorOf = (id: string): { background?: string } => {
    const group = store.tab.value === 'network' && !isChosen(id) ? store.groupOf.value.get(id) : undefined;
    return group === undefined ? {} : { background: groupColor(group) };
  };
  /** How far beside its station a number was pressed: dragged, the station must not jump to the pointer. */
  const gripOf = (event: PointerEvent, id: string): Offset => {
    const [box, place] = [layer.current?.getBoundingClientRect(), placed.current.get(id)];
    if (box === undefined || place === undefined) return { x: 0, y: 0 };
    return { x: event.clientX - box.left - place.x, y: event.clientY - box.top - place.y };
  };
  return (
    <div class="markers" ref={layer}>
      {stations.map(({ id }) => (
        <i key={id} class="marker-stem" aria-hidden="true" hidden ref={(stem) => keep(stems.current, id, stem)} />
      ))}
      {stations.map((station) => (
        <button
          key={station.id}
          type="button"
          class={[
            'marker',
            ...station.marks.map((mark) => `marker-${mark}`),
            isChosen(station.id) ? 'marker-chosen' : '',
          ]
            .join(' ')
            .trim()}
          style={colorOf(station.id)}
          aria-label={nameOf(station, store.showRoute.value, progress[station.id]?.state)}
          aria-pressed={isChosen(station.id)}
          data-station={station.id}
          ref={(button) => keep(buttons.current, station.id, button)}
          onPointerDown={(event) => view.pointer.down(event, station.id, gripOf(event, station.id))}
          onClick={(event) => clickStation(store, station.id, event)}
        >
          {station.number}
          {store.showRoute.value && <i class="marker-order">{station.order}</i>}
          {progress[station.id] !== undefined && <ProgressSign state={progress[station.id].state} />}
        </button>
      ))}
    </div>
  );
}

/** With what is written on it: who speaks to the page reads it from there. */
function nameOf({ number, id, order }: ShownStation, hasOrder: boolean, state: ProgressState | undefined): string {
  const name = t('{number}, station {id}', { number, id });
  const onRoute = hasOrder ? t('{station}, {order} on the route', { station: name, order }) : name;
  return state === undefined ? onRoute : `${onRoute}, ${stateInWords(state)}`;
}

function tellCovered(
  store: Store,
  places: ReadonlyMap<string, MarkerPlace>,
  chosenIds: readonly string[],
  layer: HTMLElement | null,
): void {
  const isWhole = store.floorId.peek() === null && !store.isSpread.peek();
  const picture = { width: layer?.clientWidth ?? 0, height: layer?.clientHeight ?? 0, isWhole };
  const found = coveredAmong(places, store.shownStations.peek(), chosenIds, picture);
  if (!isSameCovered(found, store.covered.peek())) store.covered.value = found;
}

function keep<T>(held: Map<string, T>, id: string, element: T | null): void {
  if (element) held.set(id, element);
  else held.delete(id);
}

/** A station's place on the canvas, and how far beside it its number is drawn. */
interface PlacedMarker extends MarkerPlace {
  readonly offset: Offset;
  readonly isDot: boolean;
  readonly isUnderPanel: boolean;
}

/** Above this many, numbers that cover each other become dots: moved aside they would fill the picture with lines. */
const MANY_MARKERS = 60;
/** Of fewer, so many numbers are read around one spot; what is more are dots. */
const MOST_AT_ONE_SPOT = 7;

/** Those that are dots; the pinned one keeps its number, then those that nothing hides, then those that had theirs. */
function dotsAmong(
  places: ReadonlyMap<string, MarkerPlace>,
  pinned: string | null,
  before: ReadonlySet<string>,
): Set<string> {
  const rank = (id: string, { isHidden }: MarkerPlace): number =>
    id === pinned ? 0 : (isHidden ? 3 : 1) + (before.has(id) ? 1 : 0);
  const ranked = [...places].sort(([a, p], [b, q]) => rank(a, p) - rank(b, q));
  const most = places.size > MANY_MARKERS ? 1 : MOST_AT_ONE_SPOT;
  return crowdedMarkers(
    ranked.map(([id, { x, y }]) => ({ id, x, y })),
    most,
  );
}

interface MarkerRules {
  /** Keeps its place: the others make room. */
  readonly pinned: string | null;
  /** Follows the pointer, also under a panel. */
  readonly dragged: string | null;
  readonly dots: ReadonlySet<string>;
  readonly panels: readonly Box[];
}

/** Where markers are drawn; not those that a panel covers in part, of which too little would be left to hit. */
function placeMarkers(
  places: ReadonlyMap<string, MarkerPlace>,
  { pinned, dragged, dots, panels }: MarkerRules,
  spreader: Spreader,
): Map<string, PlacedMarker> {
  const beside = new Map(
    [...places].map(([id, place]) => [id, id === dragged ? NOWHERE : besidePanels(place, panels)]),
  );
  const numbers = [...places].filter(([id]) => !dots.has(id));
  const spread = spreader.offsets(
    numbers.map(([id, { x, y }]) => {
      const from = beside.get(id) ?? NOWHERE;
      return { id, x: x + from.x, y: y + from.y, isPinned: id === pinned };
    }),
  );
  const placed = new Map<string, PlacedMarker>();
  for (const [id, place] of places) {
    const [first, second] = [beside.get(id) ?? NOWHERE, spread.get(id) ?? NOWHERE];
    const offset = { x: first.x + second.x, y: first.y + second.y };
    const at = { x: place.x + offset.x, y: place.y + offset.y };
    const cover = id === dragged ? 'none' : coverByPanels(at, panels);
    if (cover !== 'part') placed.set(id, { ...place, offset, isDot: dots.has(id), isUnderPanel: cover === 'whole' });
  }
  return placed;
}

/** Styles set from a script, not written into the page: the content security policy allows only those. */
function moveButton(button: HTMLButtonElement, place: PlacedMarker | undefined, layer: HTMLElement | null): void {
  button.hidden = place === undefined;
  if (place === undefined) return;
  const [x, y] = [place.x + place.offset.x, place.y + place.offset.y];
  button.style.transform = `translate(-50%, -50%) translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
  // Tab must not lead to what is beside the picture or under a panel; the list of stations has all of them.
  const isBeside = layer !== null && (x < 0 || y < 0 || x > layer.clientWidth || y > layer.clientHeight);
  button.tabIndex = isBeside || place.isUnderPanel ? -1 : 0;
  button.classList.toggle('marker-behind', place.isHidden);
  button.classList.toggle('marker-through', place.coveredBy !== null);
  button.classList.toggle('marker-dot', place.isDot);
}

/** A line from the station to its number, where that is beside it. */
function moveStem(stem: HTMLElement, place: PlacedMarker | undefined): void {
  const length = place === undefined ? 0 : Math.hypot(place.offset.x, place.offset.y);
  stem.hidden = length < 1;
  if (place === undefined || stem.hidden) return;
  const angle = Math.atan2(place.offset.y, place.offset.x);
  stem.style.width = `${length.toFixed(1)}px`;
  stem.style.transform = `translate(${place.x.toFixed(1)}px, ${(place.y - 1).toFixed(1)}px) rotate(${angle.toFixed(3)}rad)`;
  stem.classList.toggle('marker-behind', place.isHidden);
}

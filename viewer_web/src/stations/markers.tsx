/** Numbered markers over the canvas: buttons of constant size, moved with every frame. */
import { useEffect, useRef } from 'preact/hooks';
import type { MarkerPlace, PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { crowdedMarkers, type PlacedMarker } from './crowding.ts';

export function Markers({ store, view }: { store: Store; view: PlanView }) {
  const buttons = useRef(new Map<string, HTMLButtonElement>());
  useEffect(() => {
    view.onMarkers = (places) => {
      const crowded = crowdedMarkers(numbersFirst(places, store.stationId.peek()));
      for (const [id, button] of buttons.current) move(button, places.get(id), crowded.has(id));
    };
    return () => {
      view.onMarkers = () => undefined;
    };
  }, [view]);
  const stations = store.shownStations.value;
  const isChosen = (id: string): boolean => store.stationId.value === id;
  return (
    <div class="markers">
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
          aria-label={`Station ${station.id}`}
          aria-pressed={isChosen(station.id)}
          data-station={station.id}
          ref={(button) => {
            if (button) buttons.current.set(station.id, button);
            else buttons.current.delete(station.id);
          }}
          onPointerDown={(event) => view.pointer.down(event, station.id)}
          onClick={() => store.chooseStation(station.id)}
        >
          {station.order}
        </button>
      ))}
    </div>
  );
}

/** Above this many, numbers that cover each other become dots. */
const MANY_MARKERS = 40;

/** In the order in which they keep their numbers: the chosen one, then those that nothing hides. */
function numbersFirst(places: ReadonlyMap<string, MarkerPlace>, chosen: string | null): PlacedMarker[] {
  if (places.size <= MANY_MARKERS) return [];
  const rank = (id: string, { isHidden }: MarkerPlace): number => (id === chosen ? 0 : isHidden ? 2 : 1);
  return [...places].sort(([a, p], [b, q]) => rank(a, p) - rank(b, q)).map(([id, { x, y }]) => ({ id, x, y }));
}

/** Styles set from a script, not written into the page: the content security policy allows only those. */
function move(button: HTMLButtonElement, place: MarkerPlace | undefined, isCrowded: boolean): void {
  button.hidden = place === undefined;
  if (place === undefined) return;
  button.style.transform = `translate(-50%, -50%) translate(${place.x.toFixed(1)}px, ${place.y.toFixed(1)}px)`;
  button.classList.toggle('marker-behind', place.isHidden);
  button.classList.toggle('marker-dot', isCrowded);
}

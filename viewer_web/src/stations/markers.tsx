/** Numbered markers over the canvas: buttons of constant size, moved with every frame. */
import { useEffect, useRef } from 'preact/hooks';
import type { MarkerPlace, PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';

export function Markers({ store, view }: { store: Store; view: PlanView }) {
  const buttons = useRef(new Map<string, HTMLButtonElement>());
  useEffect(() => {
    view.onMarkers = (places) => {
      for (const [id, button] of buttons.current) move(button, places.get(id));
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

/** Styles set from a script, not written into the page: the content security policy allows only those. */
function move(button: HTMLButtonElement, place: MarkerPlace | undefined): void {
  button.hidden = place === undefined;
  if (place === undefined) return;
  button.style.transform = `translate(-50%, -50%) translate(${place.x.toFixed(1)}px, ${place.y.toFixed(1)}px)`;
  button.classList.toggle('marker-behind', place.isHidden);
}

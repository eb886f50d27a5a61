/** From the stations that see the clicked surface to it; the best one's line is the widest, of those not counted it is dashed. */
import { sceneOf } from '../edit/draft.ts';
import type { PointM } from '../measure/geometry.ts';
import { type Framed, type LayerProps, Lines, type Place } from '../measure/svg-parts.tsx';

export function SightLines({
  store,
  loaded,
  place,
}: LayerProps & Framed & { place(sceneM: PointM, floorId: string): Place | null }) {
  const [state, picked] = [store.sights.value, store.picked.value];
  if (state.kind !== 'shown' || picked === null) return null;
  const stations = new Map(store.shownStations.value.map((station) => [station.id, station]));
  const [best] = state.sights;
  // Drawn where its own floor is: a surface of another floor is lifted with that.
  const to = best && place(picked.pointM, picked.drawnOn ?? stations.get(best.stationId)?.floorId ?? '');
  if (!to) return null;
  return (
    <g class="measured sight-lines">
      {state.sights.map(({ stationId, isBest, shortfall }) => {
        const station = stations.get(stationId);
        const from = station && place(sceneOf(station.positionM, loaded.stage.offsetM), station.floorId);
        const name = isBest ? 'sight-best' : shortfall !== null ? 'sight-short' : '';
        return from ? <Lines key={stationId} places={[from, to]} name={name} /> : null;
      })}
      <circle cx={to.x} cy={to.y} r="4" />
    </g>
  );
}

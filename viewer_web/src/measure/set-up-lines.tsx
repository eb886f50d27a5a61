/** From a station to the walls around it: lines with their lengths, and the same as a list. */

import { sceneOf } from '../edit/draft.ts';
import { t } from '../language/language.ts';
import { lengthWords } from '../panels/figures.ts';
import { Figure } from '../panels/section.tsx';
import type { Store } from '../store.ts';
import type { PointM } from './geometry.ts';
import { FARTHEST_M } from './set-up.ts';
import { type Framed, Label, type LayerProps, Lines, type Place } from './svg-parts.tsx';

/** On a shorter line there is no room for its length. */
const SHORT_PIXELS = 110;
const BEYOND_PIXELS = 32;

export function SetUpLines({
  store,
  loaded,
  place,
}: LayerProps & Framed & { place(sceneM: PointM, floorId: string): Place | null }) {
  const station = store.shownStations.value.find(({ id }) => id === store.stationId.value);
  if (station === undefined) return null;
  const { offsetM } = loaded.stage;
  const from = place(sceneOf(station.positionM, offsetM), station.floorId);
  return (
    <g class="measured set-up">
      {store.measuring.walls.value.map(({ footM, distanceM }) => {
        const to = place(sceneOf(footM, offsetM), station.floorId);
        if (from === null || to === null) return null;
        const [dx, dy] = [to.x - from.x, to.y - from.y];
        const pixels = Math.hypot(dx, dy);
        // Nearer to the wall, or behind it: at the station its number is in the way.
        const share = pixels > SHORT_PIXELS ? 0.62 : 1 + BEYOND_PIXELS / Math.max(1, pixels);
        const [x, y] = [from.x + share * dx, from.y + share * dy];
        return (
          <g key={`${footM}`}>
            <Lines places={[from, to]} />
            <circle cx={to.x} cy={to.y} r="3.5" />
            <Label x={x} y={y} words={lengthWords(distanceM, 3)} />
          </g>
        );
      })}
    </g>
  );
}

/** A box that shows them, and what they are. */
export function SetUpDistances({ store }: { store: Store }) {
  const { showsSetUp, walls } = store.measuring;
  return (
    <div class="set-up-distances">
      <label class="check">
        <input
          type="checkbox"
          checked={showsSetUp.value}
          onChange={(event) => {
            showsSetUp.value = event.currentTarget.checked;
          }}
        />
        {t('Distances to walls')}
      </label>
      {showsSetUp.value && walls.value.length === 0 && (
        <p class="muted">
          {t('No wall is met squarely within {length} at this height.', { length: lengthWords(FARTHEST_M, 0) })}
        </p>
      )}
      {showsSetUp.value && walls.value.length > 0 && (
        <dl class="figures" data-testid="set-up-distances" aria-label={t('Distances to walls')}>
          {walls.value.map(({ name, distanceM, footM }) => (
            <Figure
              key={`${footM}`}
              name={name || t('Wall')}
              value={lengthWords(distanceM, 3)}
              hint={t('Level, at instrument height, square to the wall')}
            />
          ))}
        </dl>
      )}
    </div>
  );
}

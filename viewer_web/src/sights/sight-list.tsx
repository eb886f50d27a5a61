/** In the card of a clicked surface: the stations that see it, the best first, and another one here. */

import { canEdit, isLive, whyNotLive } from '../edit/readiness.ts';
import { decimal, t } from '../language/language.ts';
import { lengthWords } from '../panels/figures.ts';
import type { Picked } from '../scene/state.ts';
import type { Store } from '../store.ts';
import type { Sight } from './sights.ts';
import './sights.css';

/** More are told by their number. */
const MOST_SIGHTS = 8;

export function SightList({ store }: { store: Store }) {
  const state = store.sights.value;
  if (state.kind === 'none') return null;
  if (state.kind === 'failed') return <p class="note-warn">{state.message}</p>;
  if (state.kind === 'loading') return <p class="muted">{t('Asking which stations see it …')}</p>;
  const counted = state.sights.filter(({ shortfall }) => shortfall === null);
  const others = state.sights.filter(({ shortfall }) => shortfall !== null);
  if (state.sights.length === 0) return null;
  return (
    <>
      <Sights store={store} title={t('Stations that see it')} sights={counted} />
      <Sights store={store} title={t('Seen, but not as required')} sights={others} />
      <p class="muted">{t('Range and incidence at the point.')}</p>
    </>
  );
}

function Sights({ store, title, sights }: { store: Store; title: string; sights: readonly Sight[] }) {
  if (sights.length === 0) return null;
  return (
    <>
      <h3>{title}</h3>
      <ul class="sights" aria-label={title}>
        {sights.slice(0, MOST_SIGHTS).map(({ stationId, rangeM, incidenceRad, isBest, shortfall }) => (
          <li key={stationId}>
            <button
              type="button"
              class="sight"
              title={isBest ? t('Its points lie closest there: least range / cos(incidence)') : t('Open the station')}
              onClick={() => store.chooseStation(stationId)}
            >
              <span>{stationId}</span>
              <span>{lengthWords(rangeM)}</span>
              <span>{decimal((incidenceRad * 180) / Math.PI, 0)}°</span>
              {isBest && <span class="badge badge-good">{t('best')}</span>}
              {shortfall !== null && <span class="sight-reason">{shortfall}</span>}
            </button>
          </li>
        ))}
      </ul>
      {sights.length > MOST_SIGHTS && <p class="muted">{t('{n} more.', { n: sights.length - MOST_SIGHTS })}</p>}
    </>
  );
}

/** Only where the plan can be changed. */
export function AddStationHere({ store, picked }: { store: Store; picked: Picked }) {
  const editor = store.editing.editor.value;
  if (editor === null || !canEdit(store) || picked.isSection) return null;
  return (
    <div class="chips">
      <button
        type="button"
        class="chip chip-strong"
        disabled={!isLive(store)}
        title={whyNotLive(store) ?? t('As near to this point as a tripod can stand')}
        onClick={() => {
          store.tab.value = 'edit';
          editor.areas.addStation(picked);
        }}
      >
        {t('Add a station here')}
      </button>
    </div>
  );
}

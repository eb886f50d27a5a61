/** What the clouds are coloured by, and what of them is shown. */
import { t } from '../language/language.ts';
import { counted, whole } from '../panels/figures.ts';
import type { Store } from '../store.ts';
import { shareInWords } from './cloud-share.ts';
import type { CloudPaint, CloudState } from './state.ts';

const PAINTS: readonly [CloudPaint, string][] = [
  ['range', t('Range')],
  ['incidence', t('Incidence')],
  ['intensity', t('Intensity')],
  ['station', t('Station')],
];

export function CloudControl({ store }: { store: Store }) {
  const cloud = store.cloud.value;
  if (cloud.kind === 'none') return null;
  const detail = detailInWords(store);
  return (
    <div class="cloud" data-testid="cloud" data-state={cloud.kind}>
      <div>
        <p class={cloud.kind === 'failed' ? 'note note-warn' : 'muted'} role="status">
          {inWords(cloud)}
        </p>
        {detail !== null && (
          <p class="muted" role="status" data-testid="cloud-detail">
            {detail}
          </p>
        )}
      </div>
      <label class="cloud-paint">
        <span class="muted">{t('by')}</span>
        <select
          aria-label={t('Colour of the cloud')}
          value={store.cloudPaint.value}
          onChange={(event) => {
            store.chosenPaint.value = event.currentTarget.value as CloudPaint;
          }}
        >
          {PAINTS.map(([paint, label]) => (
            <option key={paint} value={paint}>
              {label}
            </option>
          ))}
        </select>
      </label>
    </div>
  );
}

function inWords(cloud: CloudState): string {
  if (cloud.kind === 'loading') {
    return cloud.of === 1 ? t('Loading the cloud …') : t('Loading clouds: {n} of {of} …', { n: cloud.n, of: cloud.of });
  }
  if (cloud.kind === 'failed') return cloud.message;
  if (cloud.kind === 'none') return '';
  const n = whole(cloud.nReturns);
  const share = shareInWords(cloud.nBeams, cloud.nScanned);
  if (cloud.nStations === 1) return t('{n} returns: {share} drawn', { n, share });
  return t('{n} returns from {stations}: {share} drawn', { n, stations: counted(cloud.nStations, 'station'), share });
}

/** Of the part that is looked at closely. */
function detailInWords({ cloud, cloudDetail }: Store): string | null {
  const detail = cloudDetail.value;
  if (detail === null || cloud.value.kind !== 'shown') return null;
  return t('Closer, from {id}: {share}', {
    id: detail.stationId,
    share: shareInWords(detail.nBeams, detail.nScanned),
  });
}

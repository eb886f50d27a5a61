/** What the colours mean. */
import type { Store } from '../store.ts';
import { metres } from './figures.ts';

export function Legend({ store }: { store: Store }) {
  const rangeMaxM = store.loaded.value?.plan.scanner.range_max_m ?? 0;
  if (store.cloud.value.kind === 'shown') {
    const isRange = store.cloudPaint.value === 'range';
    return (
      <figure class="legend" aria-label="Legend">
        <figcaption>{isRange ? 'Range of the return' : 'Incidence: bright is head-on'}</figcaption>
        <div class={isRange ? 'legend-ramp legend-range' : 'legend-ramp legend-intensity'} />
        <div class="legend-ends">
          <span>{isRange ? metres(0, 0) : 'grazing'}</span>
          <span>{isRange ? metres(rangeMaxM, 0) : 'head-on'}</span>
        </div>
      </figure>
    );
  }
  if (store.paint.value === 'plain') return null;
  return (
    <figure class="legend" aria-label="Legend">
      <figcaption>Seen by stations</figcaption>
      <ul>
        {['1', '2', '3', '4+'].map((label, i) => (
          <li key={label}>
            <i class={`swatch swatch-seen-${i + 1}`} />
            {label}
          </li>
        ))}
      </ul>
      <ul>
        <li>
          <i class="swatch swatch-unseen" />
          unseen
        </li>
        <li>
          <i class="swatch swatch-none" />
          not achievable
        </li>
      </ul>
    </figure>
  );
}

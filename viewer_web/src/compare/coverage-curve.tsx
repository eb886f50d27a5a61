/** The diagram of coverage against stations. */
import { t } from '../language/language.ts';
import { askedPercent, counted, percent, reachedPercent } from '../panels/figures.ts';
import { type Curve, type Frame, pointsOf, scaleOf, stationTicks } from './curve.ts';
import './compare.css';

const FRAME: Frame = { width: 300, height: 150, left: 34, bottom: 28, top: 8, right: 8 };
const FRACTIONS = [0, 0.25, 0.5, 0.75, 1];

export function CoverageCurve({ curves, required }: { curves: readonly Curve[]; required: number }) {
  const known = curves.filter(({ fractions }) => fractions.length > 0);
  if (known.length === 0) return <p class="muted">{t('This plan has no coverage curve.')}</p>;
  const scale = scaleOf(known, FRAME);
  const ends = known.map(({ title, fractions }) => {
    const last = fractions.filter((fraction) => fraction !== null).at(-1) ?? 0;
    return `${title}: ${counted(fractions.length, 'station')}, ${reachedPercent(last, required)}`;
  });
  return (
    <figure>
      <svg class="curve" viewBox={`0 0 ${FRAME.width} ${FRAME.height}`} role="img" aria-label={ends.join('; ')}>
        {FRACTIONS.map((fraction) => (
          <g key={fraction}>
            <line
              class="curve-grid"
              x1={scale.x(0)}
              x2={scale.x(scale.mostStations)}
              y1={scale.y(fraction)}
              y2={scale.y(fraction)}
            />
            <text x={FRAME.left - 5} y={scale.y(fraction) + 3} text-anchor="end">
              {percent(fraction, 0)}
            </text>
          </g>
        ))}
        {stationTicks(scale.mostStations).map((n) => (
          <text key={n} x={scale.x(n)} y={FRAME.height - FRAME.bottom + 12} text-anchor="middle">
            {n}
          </text>
        ))}
        <text x={scale.x(scale.mostStations / 2)} y={FRAME.height - 3} text-anchor="middle">
          {t('stations')}
        </text>
        <line
          class="curve-grid curve-other"
          x1={scale.x(0)}
          x2={scale.x(scale.mostStations)}
          y1={scale.y(required)}
          y2={scale.y(required)}
        />
        {known.map((curve) => (
          <polyline key={curve.title} class={`curve-line curve-${curve.look}`} points={pointsOf(curve, scale)} />
        ))}
      </svg>
      <figcaption class="muted">
        {t('Coverage of all together; line: {required} required', { required: askedPercent(required) })}
      </figcaption>
      <ul class="curve-key">
        {known.map(({ title, look }) => (
          <li key={title}>
            <svg viewBox="0 0 22 4" aria-hidden="true">
              <line class={`curve-line curve-${look}`} x1="0" x2="22" y1="2" y2="2" />
            </svg>
            {title}
          </li>
        ))}
      </ul>
    </figure>
  );
}

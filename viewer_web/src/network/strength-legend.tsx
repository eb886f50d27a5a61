/** What the colours of links mean. */
import { plain, t } from '../language/language.ts';
import { askedPercent } from '../panels/figures.ts';
import { overlapColor, STRENGTH_ENDS, strengthColor } from './strength.ts';

export function StrengthLegend({ isDark }: { isDark: boolean }) {
  const [weak, strong] = STRENGTH_ENDS;
  const steps = [...Array(24).keys()];
  return (
    <div class="strength-legend">
      <span class="legend-name">{t('Strength')}</span>
      <span class="muted">{t('weak {strength}', { strength: plain(weak) })}</span>
      <svg viewBox="0 0 24 1" preserveAspectRatio="none" shape-rendering="crispEdges" aria-hidden="true">
        {steps.map((i) => (
          <rect key={i} x={i} width="1.1" height="1" fill={strengthColor(weak * (strong / weak) ** (i / 23), isDark)} />
        ))}
      </svg>
      <span class="muted">{t('{strength} strong', { strength: plain(strong) })}</span>
    </div>
  );
}

/** What the colours above the diagonal of the matrix mean, and from which overlap on a link counts. */
export function OverlapLegend({ isDark, threshold }: { isDark: boolean; threshold: number }) {
  const steps = [...Array(24).keys()];
  return (
    <div class="strength-legend" data-testid="overlap-legend">
      <span class="legend-name">{t('Overlap')}</span>
      <span class="muted">0 %</span>
      <svg viewBox="0 0 24 1" preserveAspectRatio="none" shape-rendering="crispEdges" aria-hidden="true">
        {steps.map((i) => (
          <rect key={i} x={i} width="1.1" height="1" fill={overlapColor(i / 23, isDark)} />
        ))}
      </svg>
      <span class="muted">
        {threshold > 0 ? t('100 %; links count from {required}', { required: askedPercent(threshold) }) : '100 %'}
      </span>
    </div>
  );
}

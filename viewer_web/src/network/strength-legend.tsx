/** What the colours of links mean. */
import { STRENGTH_ENDS, strengthColor } from './strength.ts';

export function StrengthLegend({ isDark }: { isDark: boolean }) {
  const [weak, strong] = STRENGTH_ENDS;
  const steps = [...Array(24).keys()];
  return (
    <div class="strength-legend">
      <span class="muted">weak {weak}</span>
      <svg viewBox="0 0 24 1" preserveAspectRatio="none" shape-rendering="crispEdges" aria-hidden="true">
        {steps.map((i) => (
          <rect key={i} x={i} width="1.1" height="1" fill={strengthColor(weak * (strong / weak) ** (i / 23), isDark)} />
        ))}
      </svg>
      <span class="muted">{strong} strong</span>
    </div>
  );
}

/** Over the canvas while walking: how to move, buttons for fingers, the height of the eye, the way out. */
import { t } from '../language/language.ts';
import { lengthWords } from '../panels/figures.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import type { Move } from './walk-mode.ts';

const BUTTONS: readonly [Move, string, string][] = [
  ['turnLeft', '↺', t('Turn left')],
  ['forward', '↑', t('Go forward')],
  ['turnRight', '↻', t('Turn right')],
  ['left', '←', t('Go left')],
  ['back', '↓', t('Go back')],
  ['right', '→', t('Go right')],
];

export function WalkPanel({ store, view }: { store: Store; view: PlanView }) {
  if (!store.isWalking.value) return null;
  return (
    <section class="walk" aria-label={t('Walk-through')}>
      <div class="walk-pad">
        {BUTTONS.map(([move, sign, name]) => (
          <button
            key={move}
            type="button"
            class="icon"
            aria-label={name}
            onPointerDown={(event) => {
              event.currentTarget.setPointerCapture(event.pointerId);
              view.walk.hold(move, true);
            }}
            onPointerUp={() => view.walk.hold(move, false)}
            onPointerCancel={() => view.walk.hold(move, false)}
          >
            {sign}
          </button>
        ))}
      </div>
      <div>
        <p class="muted">{t('W A S D or arrows: move. Drag: look around. Click a floor: go there. Escape: leave.')}</p>
        <label class="slider">
          <span>{t('Eye height')}</span>
          <output>{lengthWords(view.walk.eyeHeightM)}</output>
          <input
            type="range"
            aria-label={t('Eye height above the floor')}
            min={0.5}
            max={3}
            step={0.05}
            value={view.walk.eyeHeightM}
            onInput={(event) => {
              view.walk.eyeHeightM = event.currentTarget.valueAsNumber;
            }}
          />
        </label>
        <button type="button" class="chip chip-strong" onClick={() => view.walk.leave()}>
          {t('Leave walk-through')}
        </button>
      </div>
    </section>
  );
}

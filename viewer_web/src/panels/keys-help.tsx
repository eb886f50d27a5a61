/** What the keys do, and the choice to do without those of one character (WCAG 2.1.4). */
import { t } from '../language/language.ts';
import { chooseCharacterKeys, hasCharacterKeys } from './character-keys.ts';
import { Section } from './section.tsx';

const KEYS: readonly (readonly [string, string])[] = [
  ['0, 1 … 9', t('all floors, a floor')],
  ['H, T, P', t('whole building, top view, plan view')],
  ['M, W', t('measure, walk')],
  ['Q, E, R, F', t('turn and tilt the building')],
  ['+, −', t('closer, away')],
  [t('Up, down'), t('the next floor')],
  [t('Left, right'), t('the next station')],
  [t('Escape'), t('lets go')],
];

export function KeysHelp() {
  const hint = t(
    'Off: letters, digits, + and − do nothing, as for those who speak to the computer. Arrows, Enter and Escape stay.',
  );
  return (
    <Section title={t('Keys')}>
      <label class="check" title={hint}>
        <input
          type="checkbox"
          checked={hasCharacterKeys.value}
          onChange={({ currentTarget: { checked } }) => chooseCharacterKeys(window.localStorage, checked)}
        />
        {t('Keys of one character')}
      </label>
      <p class="hint">{hint}</p>
      <details>
        <summary>{t('What the keys do')}</summary>
        <dl class="figures">
          {KEYS.map(([key, does]) => (
            <div key={key} class="figure">
              <dt>{key}</dt>
              <dd>{does}</dd>
            </div>
          ))}
        </dl>
      </details>
    </Section>
  );
}

/** What the keys do, and the choice to do without those of one character (WCAG 2.1.4). */
import { chooseCharacterKeys, hasCharacterKeys } from './character-keys.ts';
import { Section } from './section.tsx';

const WORDS = {
  title: 'Keys',
  show: 'What the keys do',
  choice: 'Keys of one character',
  hint: 'Off: letters, digits, + and − do nothing, as for those who speak to the computer. Arrows, Enter and Escape stay.',
  keys: [
    ['0, 1 … 9', 'all floors, a floor'],
    ['H, T, P', 'whole building, top view, plan view'],
    ['M, W', 'measure, walk'],
    ['Q, E, R, F', 'turn and tilt the building'],
    ['+, −', 'closer, away'],
    ['Up, down', 'the next floor'],
    ['Left, right', 'the next station'],
    ['Escape', 'lets go'],
  ],
} as const;

export function KeysHelp() {
  return (
    <Section title={WORDS.title}>
      <label class="check" title={WORDS.hint}>
        <input
          type="checkbox"
          checked={hasCharacterKeys.value}
          onChange={({ currentTarget: { checked } }) => chooseCharacterKeys(window.localStorage, checked)}
        />
        {WORDS.choice}
      </label>
      <p class="hint">{WORDS.hint}</p>
      <details>
        <summary>{WORDS.show}</summary>
        <dl class="figures">
          {WORDS.keys.map(([key, does]) => (
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

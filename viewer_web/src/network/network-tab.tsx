/** The tab "Network": how the stations register with each other. */
import { percent } from '../panels/figures.ts';
import { Section } from '../panels/section.tsx';
import type { Store } from '../store.ts';

export function NetworkTab({ store }: { store: Store }) {
  const links = [...store.shownLinks.value].sort((a, b) => b.overlap - a.overlap);
  return (
    <Section title="Links" aside="overlap">
      <ul class="rows" aria-label="Links">
        {links.map(({ a, b, overlap }) => (
          <li key={`${a} ${b}`}>
            <button
              type="button"
              class="row"
              onClick={() => {
                store.pair.value = [a, b];
              }}
            >
              <span>
                {a} – {b}
              </span>
              <span>{percent(overlap, 0)}</span>
            </button>
          </li>
        ))}
      </ul>
    </Section>
  );
}

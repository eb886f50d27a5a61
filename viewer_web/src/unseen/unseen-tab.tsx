/** The tab "Unseen": what no station sees, largest first. */
import { kindInWords, squareMetres } from '../panels/figures.ts';
import { Section } from '../panels/section.tsx';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';

export function UnseenTab({ store }: { store: Store; view: PlanView | null }) {
  const unseen = store.loaded.value?.plan.unseen ?? [];
  return (
    <Section title="Unseen" aside="area">
      <ul class="rows" aria-label="Unseen surfaces">
        {unseen.map((part) => (
          <li key={`${part.element} ${part.floor}`} class="row">
            <span class="row-main">
              <span class="row-name">{part.name}</span>
              <span class="muted">{kindInWords(part.kind)}</span>
            </span>
            <span>{squareMetres(part.unseen_area_m2)}</span>
          </li>
        ))}
      </ul>
    </Section>
  );
}

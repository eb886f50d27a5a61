/** What was clicked in the building. */
import type { Picked, Store } from '../store.ts';
import { Card } from './card.tsx';
import { counted, kindInWords } from './figures.ts';
import { Figure } from './section.tsx';

export function SurfaceCard({ store }: { store: Store }) {
  const picked = store.picked.value;
  const floors = store.loaded.value?.plan.floors ?? [];
  if (picked === null) return null;
  const floorName = (id: string): string => floors.find((floor) => floor.id === id)?.name ?? id;
  const { element, groundOf } = picked;
  return (
    <Card
      title={element.name || 'Unnamed element'}
      subtitle={kindInWords(element.kind)}
      name="Clicked surface"
      onClose={() => store.pick(null)}
    >
      <dl class="figures" data-testid="surface-figures">
        {groundOf !== null && <Figure name="Ground of" value={floorName(groundOf)} />}
        {groundOf === null && element.floorId !== '' && <Figure name="Floor" value={floorName(element.floorId)} />}
        <Figure
          name="Seen here"
          value={seenInWords(picked)}
          hint="The patch under the pointer. Not achievable: no admissible position sees it"
        />
        <Figure
          name="At"
          value={picked.pointM.map((x) => x.toFixed(2)).join(', ')}
          hint="Scene coordinates x, y, z in metres"
        />
      </dl>
    </Card>
  );
}

function seenInWords({ isSection, timesSeen }: Picked): string {
  if (isSection) return 'cut open';
  if (timesSeen === null) return 'not achievable';
  return timesSeen === 0 ? 'by no station' : `by ${counted(timesSeen, 'station')}`;
}

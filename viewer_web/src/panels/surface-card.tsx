/** What was clicked in the building. */
import type { ElementCoverage } from '../heat/element-coverage.ts';
import { NOT_ASKED_CLASS } from '../heat/layers.ts';
import { siteOf, siteWords } from '../measure/site.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { Picked } from '../scene/state.ts';
import { AddStationHere, SightList } from '../sights/sight-list.tsx';
import type { Store } from '../store.ts';
import { Card } from './card.tsx';
import { areaWords, coordinatesWords, counted, kindInWords, percent, unitName } from './figures.ts';
import { Figure } from './section.tsx';

export function SurfaceCard({ store, view }: { store: Store; view: PlanView | null }) {
  const picked = store.picked.value;
  const floors = store.loaded.value?.plan.floors ?? [];
  if (picked === null) return null;
  const floorName = (id: string): string => floors.find((floor) => floor.id === id)?.name ?? id;
  const { element, groundOf } = picked;
  const scene = store.loaded.value?.plan.scene;
  const site = scene === undefined ? null : siteOf(scene);
  // The layer may have changed since the click.
  const isLayerShown = store.layerState.value.kind === 'shown';
  const shown = isLayerShown ? (view?.layerAt(picked.patch) ?? null) : null;
  return (
    <Card
      title={element.name || 'Unnamed element'}
      subtitle={kindInWords(element.kind)}
      name="Clicked surface"
      onClose={() => store.pick(null)}
    >
      <dl class="figures" data-testid="surface-figures" data-patch={picked.patch}>
        {groundOf !== null && <Figure name="Walkable floor" value={floorName(groundOf)} />}
        {groundOf === null && element.floorId !== '' && <Figure name="Floor" value={floorName(element.floorId)} />}
        <Figure
          name="Seen from"
          value={seenInWords(picked)}
          hint="The surface under the pointer. Not scannable: no candidate position sees it"
        />
        {shown !== null && !picked.isSection && <Figure name={shown.title} value={shown.words} />}
        {view !== null && <Coverage coverage={view.coverageOf(picked.elementIndex)} />}
        <Figure
          name="Position"
          value={coordinatesWords(picked.pointM)}
          hint={`Scene coordinates x, y, z in ${unitName()}`}
        />
        {site !== null && <Figure name="Site" value={siteWords(site, picked.pointM)} hint={site.name} />}
      </dl>
      <SightList store={store} />
      <AddStationHere store={store} picked={picked} />
    </Card>
  );
}

/** Of the whole element. */
function Coverage({ coverage: { areaM2, askedM2, achievableM2, seenM2 } }: { coverage: ElementCoverage }) {
  const none = askedM2 > 0 ? 'not scannable' : NOT_ASKED_CLASS.label;
  return (
    <>
      <Figure
        name="Coverage"
        value={achievableM2 > 0 ? `${percent(seenM2 / achievableM2)} of ${areaWords(achievableM2)}` : none}
        hint="Of the element’s surface that at least one candidate position sees"
      />
      <Figure name="Total surface" value={areaWords(areaM2)} hint="Insides and undersides included" />
    </>
  );
}

function seenInWords({ isSection, isAsked, timesSeen }: Picked): string {
  if (isSection) return 'cut section';
  if (!isAsked) return NOT_ASKED_CLASS.label;
  if (timesSeen === null) return 'not scannable';
  return timesSeen === 0 ? 'no station' : counted(timesSeen, 'station');
}

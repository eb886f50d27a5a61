/** What was clicked in the building. */

import { IsolationButtons, SourceId } from '../elements/element-parts.tsx';
import type { ElementCoverage } from '../heat/element-coverage.ts';
import { NOT_ASKED_CLASS } from '../heat/layers.ts';
import { t } from '../language/language.ts';
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
      title={element.name || t('Unnamed element')}
      subtitle={kindInWords(element.kind)}
      name={t('Clicked surface')}
      onClose={() => store.pick(null)}
    >
      <dl class="figures" data-testid="surface-figures" data-patch={picked.patch}>
        {groundOf !== null && <Figure name={t('Walkable floor')} value={floorName(groundOf)} />}
        {groundOf === null && element.floorId !== '' && <Figure name={t('Floor')} value={floorName(element.floorId)} />}
        <Figure
          name={t('Seen from')}
          value={seenInWords(picked)}
          hint={t('The surface under the pointer. Not scannable: no candidate position sees it')}
        />
        {shown !== null && !picked.isSection && <Figure name={shown.title} value={shown.words} />}
        {view !== null && <Coverage coverage={view.coverageOf(picked.elementIndex)} />}
        <SourceId key={element.sourceId} id={element.sourceId} isIfc={scene?.format === 'ifc'} />
        <Figure
          name={t('Position')}
          value={coordinatesWords(picked.pointM)}
          hint={t('Scene coordinates x, y, z in {unit}', { unit: unitName() })}
        />
        {site !== null && <Figure name={t('Site')} value={siteWords(site, picked.pointM)} hint={site.name} />}
      </dl>
      <IsolationButtons store={store} />
      <SightList store={store} />
      <AddStationHere store={store} picked={picked} />
    </Card>
  );
}

/** Of the whole element. */
function Coverage({ coverage: { areaM2, askedM2, achievableM2, seenM2 } }: { coverage: ElementCoverage }) {
  const none = askedM2 > 0 ? t('not scannable') : NOT_ASKED_CLASS.label;
  return (
    <>
      <Figure
        name={t('Coverage')}
        value={
          achievableM2 > 0
            ? t('{percent} of {area}', { percent: percent(seenM2 / achievableM2), area: areaWords(achievableM2) })
            : none
        }
        hint={t('Of the element’s surface that at least one candidate position sees')}
      />
      <Figure name={t('Total surface')} value={areaWords(areaM2)} hint={t('Insides and undersides included')} />
    </>
  );
}

function seenInWords({ isSection, isAsked, timesSeen }: Picked): string {
  if (isSection) return t('cut section');
  if (!isAsked) return NOT_ASKED_CLASS.label;
  if (timesSeen === null) return t('not scannable');
  return timesSeen === 0 ? t('no station') : counted(timesSeen, 'station');
}

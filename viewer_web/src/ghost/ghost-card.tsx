/** The card of a proposed station: what it would be worth, and the button that adds it. */

import type { PreviewHead } from '../api/documents.ts';
import { addStation } from '../edit/changes.ts';
import { canEdit, isLive, whyNoEditing, whyNotLive } from '../edit/readiness.ts';
import { signedPoints } from '../edit/totals.ts';
import { totalsBeside } from '../edit/totals-beside.ts';
import { t } from '../language/language.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { countingOf, counts, linkPercent } from '../network/graph.ts';
import { Card } from '../panels/card.tsx';
import { areaWords, reachedPercent } from '../panels/figures.ts';
import { Figure } from '../panels/section.tsx';
import type { Store } from '../store.ts';
import { dropGhost } from './ghosts.ts';
import type { Ghost } from './state.ts';
import './ghost.css';

export function GhostCard({ store, loaded }: { store: Store; loaded: LoadedPlan }) {
  const ghost = store.ghost.value;
  if (ghost === null) return null;
  const floor = loaded.plan.floors.find(({ id }) => id === ghost.floorId)?.name ?? ghost.floorId;
  return (
    <Card title={t('One more station')} subtitle={floor} name={t('Proposed station')} onClose={() => dropGhost(store)}>
      {ghost.head === null ? <Waiting store={store} /> : <Worth store={store} loaded={loaded} head={ghost.head} />}
      <Add store={store} ghost={ghost} />
    </Card>
  );
}

function Waiting({ store }: { store: Store }) {
  const why = store.reviewClient === null ? whyNoEditing(store) : whyNotLive(store);
  return <p class="muted">{why ?? t('Computing …')}</p>;
}

function Worth({ store, loaded, head }: { store: Store; loaded: LoadedPlan; head: PreviewHead }) {
  const totals = totalsBeside(store);
  const before = totals === null ? null : (totals.edited ?? totals.planned);
  const counting = countingOf(loaded.plan);
  const links = head.links.filter((link) => counts(link, counting));
  if (!head.admissible)
    return <p class="note note-warn">{t('No valid tripod position there: {reason}.', { reason: head.reason })}</p>;
  return (
    <>
      {before !== null && <p class="ghost-groups">{groupsInWords(before.nNetworks, head.registration.n_networks)}</p>}
      <dl class="figures" data-testid="ghost-figures">
        <Figure name={t('Sees')} value={areaWords(head.station.covered_area_m2)} />
        <Figure
          name={t('Adds')}
          value={areaWords(head.station.own_area_m2)}
          hint={t('Surface that no other station covers')}
        />
        <Figure
          name={t('Coverage')}
          value={`${reachedPercent(head.coverage.fraction_of_achievable, loaded.plan.requirements.coverage)} ${
            before === null ? '' : signedPoints(head.coverage.fraction_of_achievable - before.coverage)
          }`.trimEnd()}
        />
        <Figure
          name={t('Registers with')}
          value={links.map((link) => `${link.b} ${linkPercent(link, counting)}`).join(', ') || t('no station')}
        />
      </dl>
    </>
  );
}

/** "+1 station: 5 groups become 4". */
function groupsInWords(before: number, after: number): string {
  if (after < before) return t('+1 station: {before} groups become {after}', { before, after });
  if (after > before) return t('+1 station: it registers with none, {after} groups', { after });
  return after === 1 ? t('+1 station: all stay connected') : t('+1 station: {after} groups as before', { after });
}

function Add({ store, ghost }: { store: Store; ghost: Ghost }) {
  const { reviewClient } = store;
  if (reviewClient === null) return null;
  if (!canEdit(store)) return <p class="muted">{whyNoEditing(store)}</p>;
  const add = async (): Promise<void> => {
    const { positionM, heightM, floorId } = ghost;
    const before = new Set(Object.keys(reviewClient.review.peek()?.stations ?? {}));
    const pose = { position_m: positionM, instrument_height_m: heightM, floor: floorId };
    dropGhost(store);
    if (!(await reviewClient.commit(t('add a station'), [addStation(pose)]))) return;
    const added = Object.keys(reviewClient.review.peek()?.stations ?? {}).find((id) => !before.has(id));
    if (added !== undefined) store.chooseStation(added);
  };
  return (
    <button
      type="button"
      class="button"
      disabled={!isLive(store) || ghost.head === null || !ghost.head.admissible}
      onClick={() => void add()}
    >
      {t('Add this station')}
    </button>
  );
}

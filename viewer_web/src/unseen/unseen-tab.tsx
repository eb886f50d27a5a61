/** The tab "Unseen": what no station sees, largest first, why, and a flight to each piece of it. */

import { useState } from 'preact/hooks';
import type { Point } from '../api/documents.ts';
import { floorAt } from '../edit/review-areas.ts';
import { isPlanned } from '../floors/planned.ts';
import { proposeFor } from '../ghost/ghosts.ts';
import { themed } from '../heat/colors.ts';
import { reasonColor, reasonInWords } from '../heat/layers.ts';
import { Swatch } from '../heat/legend.tsx';
import { separator, t } from '../language/language.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import type { UnseenSurface } from '../load/plan-json.ts';
import { areaWords, coordinateWords, kindInWords, whole } from '../panels/figures.ts';
import { Section } from '../panels/section.tsx';
import type { Store } from '../store.ts';
import {
  type ReasonSum,
  sumsByReason,
  surfacesShown,
  type UnseenOf,
  type UnseenShown,
  unseenShown,
} from './surfaces.ts';

/** More rows at once are no list any more, and slow. */
const ROWS_A_PAGE = 60;

export function UnseenTab({ store }: { store: Store }) {
  const [reason, setReason] = useState<string | null>(null);
  const [nRows, setRows] = useState(ROWS_A_PAGE);
  const unseen = unseenShown(store);
  if (unseen === null) {
    return (
      <Section title={t('Unseen')}>
        <p class="note">{t('An older version made this plan: plan again to see what stays unseen, and why.')}</p>
      </Section>
    );
  }
  const onFloor = surfacesShown(unseen.surfaces, { floorId: store.floorId.value, reason: null });
  const sums = sumsByReason(onFloor);
  // Reasons come and go with the edits.
  const chosen = sums.some((sum) => sum.reason === reason) ? reason : null;
  const shown = surfacesShown(onFloor, { floorId: null, reason: chosen });
  const choose = (next: string | null): void => {
    setReason(next);
    setRows(ROWS_A_PAGE);
  };
  return (
    <>
      <Section title={t('Unseen surface by reason')} aside={t('area')}>
        <OfWhich unseen={unseen} />
        <Reasons sums={sums} chosen={chosen} onChoose={choose} isDark={store.isDark.value} />
      </Section>
      <Section
        title={chosen === null ? t('All unseen surfaces') : capital(reasonInWords(chosen))}
        aside={t('{n}, largest first', { n: whole(shown.length) })}
      >
        <ul class="rows" aria-label={t('Unseen surfaces')}>
          {shown.slice(0, nRows).map((surface) => (
            <SurfaceRow key={keyOf(surface)} store={store} surface={surface} />
          ))}
        </ul>
        {shown.length === 0 && <p class="muted">{isInScope(store) ? t('Nothing unseen here.') : OUT_OF_SCOPE}</p>}
        {shown.length > nRows && (
          <button type="button" class="more" onClick={() => setRows(nRows + ROWS_A_PAGE)}>
            {t('Show {n} more', { n: Math.min(ROWS_A_PAGE, shown.length - nRows) })}
          </button>
        )}
      </Section>
    </>
  );
}

const OUT_OF_SCOPE = t('This floor is not part of the plan.');

const capital = (words: string): string => words.charAt(0).toUpperCase() + words.slice(1);

function isInScope({ floorId, loaded }: Store): boolean {
  const plan = loaded.value?.plan;
  const floor = plan?.floors.find(({ id }) => id === floorId.value);
  return floor === undefined || isPlanned(floor, plan?.requirements.floors);
}

const OF_WHICH: Readonly<Record<UnseenOf, string>> = {
  plan: '',
  edited: t('Of the edited plan. What no candidate can see does not depend on the stations.'),
  'not edited': t('Of the plan before your edits: live editing is off, so what the edits leave unseen is unknown.'),
};

/** Of which plan the list is, where there are two. */
function OfWhich({ unseen: { of, isStale } }: { unseen: UnseenShown }) {
  if (of === 'plan') return null;
  return (
    <p class={of === 'edited' ? 'note' : 'note note-warn'} role="status" data-testid="unseen-of">
      {OF_WHICH[of]}
      {isStale && ` ${t('Computing the last changes …')}`}
    </p>
  );
}

const keyOf = ({ element, floor, reason, room }: UnseenSurface): string =>
  `${element} ${floor} ${reason} ${room?.name}`;

interface ReasonsProps {
  readonly sums: readonly ReasonSum[];
  readonly chosen: string | null;
  readonly onChoose: (reason: string | null) => void;
  readonly isDark: boolean;
}

/** Buttons that part the list by reason. */
function Reasons({ sums, chosen, onChoose, isDark }: ReasonsProps) {
  const groups: [string, ReasonSum[]][] = [
    [t('What another station would cover'), sums.filter(({ isMendable }) => isMendable)],
    [t('What no candidate can see'), sums.filter(({ isMendable }) => !isMendable)],
  ];
  return (
    <>
      {groups
        .filter(([, ofGroup]) => ofGroup.length > 0)
        .map(([title, ofGroup]) => (
          <div key={title} class="reasons">
            <h3>{title}</h3>
            <ul class="rows" aria-label={title}>
              {ofGroup.map(({ reason, areaM2 }) => (
                <li key={reason}>
                  <button
                    type="button"
                    class={chosen === reason ? 'row row-reason row-chosen' : 'row row-reason'}
                    aria-pressed={chosen === reason}
                    onClick={() => onChoose(chosen === reason ? null : reason)}
                  >
                    <Swatch color={themed(reasonColor(reason), isDark)} />
                    <span class="row-name">{reasonInWords(reason)}</span>
                    <span class="row-area">{areaWords(areaM2)}</span>
                  </button>
                </li>
              ))}
            </ul>
          </div>
        ))}
    </>
  );
}

function SurfaceRow({ store, surface }: { store: Store; surface: UnseenSurface }) {
  const focus = store.unseenFocus.value;
  // By what it is: with every change of the draft its surfaces are other objects.
  const isChosen = focus !== null && keyOf(focus.surface) === keyOf(surface);
  const floors = store.loaded.value?.plan.floors ?? [];
  const floor = floors.find(({ id }) => id === surface.floor)?.name ?? '';
  const place = [kindInWords(surface.kind), surface.room?.name, store.floorId.value === null ? floor : ''];
  return (
    <li class={isChosen ? 'unseen unseen-chosen' : 'unseen'}>
      <button
        type="button"
        class={isChosen ? 'row row-chosen' : 'row'}
        aria-pressed={isChosen}
        onClick={() => store.lookAtUnseen(isChosen ? null : { surface, piece: 0 })}
      >
        <Swatch color={themed(reasonColor(surface.reason), store.isDark.value)} />
        <span class="row-main">
          <span class="row-name" title={surface.name}>
            {surface.name || t('Unnamed element')}
          </span>
          <span class="muted row-place">{place.filter(Boolean).join(' · ')}</span>
        </span>
        <span class="row-area">{areaWords(surface.area_m2)}</span>
      </button>
      {isChosen && <Pieces store={store} surface={surface} piece={Math.min(focus.piece, surface.pieces.length - 1)} />}
    </li>
  );
}

/** What of the surface is looked at, and how to look at the rest. */
function Pieces({ store, surface, piece }: { store: Store; surface: UnseenSurface; piece: number }) {
  const n = surface.pieces.length;
  const spot = surface.best_spot;
  const step = (by: number): void => store.lookAtUnseen({ surface, piece: (piece + by + n) % n });
  return (
    <div class="unseen-detail">
      <p>{t('Reason: {reason}.', { reason: reasonInWords(surface.reason) })}</p>
      {n > 1 && (
        <p class="piece-steps">
          <button type="button" class="chip" aria-label={t('Previous piece')} onClick={() => step(-1)}>
            ‹
          </button>
          {surface.n_pieces > n
            ? t('piece {k} of {n} (the largest of {all}):', { k: piece + 1, n, all: whole(surface.n_pieces) })
            : t('piece {k} of {n}:', { k: piece + 1, n })}{' '}
          <span class="figure-word">{areaWords(surface.pieces[piece].area_m2)}</span>
          <button type="button" class="chip" aria-label={t('Next piece')} onClick={() => step(1)}>
            ›
          </button>
        </p>
      )}
      {spot !== null && (
        <p>
          {t('Best position {place}: sees', { place: spot.position.map((x) => coordinateWords(x)).join(separator) })}{' '}
          <span class="figure-word">{areaWords(spot.sees_m2)}</span> {t('of it and')}{' '}
          <span class="figure-word">{areaWords(spot.adds_m2)}</span> {t('of all unseen surface.')}{' '}
          {store.loaded.value !== null && (
            <ShowSpot store={store} loaded={store.loaded.value} positionM={spot.position} />
          )}
        </p>
      )}
    </div>
  );
}

interface ShowSpotProps {
  readonly store: Store;
  readonly loaded: LoadedPlan;
  readonly positionM: Point;
}

/** The position as a station that is proposed; its floor need not be that of the surface. */
function ShowSpot({ store, loaded, positionM }: ShowSpotProps) {
  const { floors, offsetM } = loaded.stage;
  const floorId = floorAt(floors, positionM[2] - offsetM[2]);
  return (
    <button type="button" class="link" onClick={() => void proposeFor(store, loaded, positionM, floorId)}>
      {t('Show it in the building')}
    </button>
  );
}

/** Choosing a plan to compare with, the figures of both side by side, and their curves. */

import { batch } from '@preact/signals';
import { ENTRANCE_WORDS } from '../edit/entrance-words.ts';
import { draftTotals, planTotals, type Totals } from '../edit/totals.ts';
import { t } from '../language/language.ts';
import { OWN_PLAN } from '../load/plan-base.ts';
import { Section } from '../panels/section.tsx';
import type { Store } from '../store.ts';
import { figureRows, hasSameDoors, steepestCurve, titleOfBase } from './comparison.ts';
import { CoverageCurve } from './coverage-curve.tsx';
import type { Curve } from './curve.ts';
import { DIFFERENCE_ID } from './difference.ts';
import { floorsInWords } from './floors-compared.ts';
import './compare.css';

const NOTHING = '(nothing)';

export function CompareSection({ store }: { store: Store }) {
  const plan = store.loaded.value?.plan;
  if (plan === undefined) return null;
  const runs = store.reviewClient?.runs.value.filter((run) => run.plan !== null) ?? [];
  const bases = [OWN_PLAN, ...runs.map((run) => run.plan as string)];
  const comparison = store.comparison.value;
  const base = store.compareBase.value;
  const known = base === null || bases.includes(base) ? bases : [...bases, base];
  return (
    <Section title={t('Compare')}>
      <label class="field">
        {t('{plan} compared with', { plan: titleOfShown(store) })}
        <select value={base ?? NOTHING} onChange={(event) => compareWith(store, event.currentTarget.value)}>
          <option value={NOTHING}>{t('nothing')}</option>
          {known.map((each) => (
            <option key={each} value={each}>
              {nameOf(store, each)}
            </option>
          ))}
        </select>
      </label>
      {comparison.kind === 'loading' && (
        <p class="hint">{t('Loading {plan} …', { plan: titleOfBase(comparison.base) })}</p>
      )}
      {comparison.kind === 'failed' && <p class="note note-warn">{comparison.message}</p>}
      <Figures store={store} />
      <CoverageCurve curves={curvesOf(store)} required={plan.requirements.coverage} />
    </Section>
  );
}

function compareWith(store: Store, value: string): void {
  const base = value === NOTHING ? null : value;
  if (base === null) store.compareBase.value = null;
  else showDifference(store, base);
}

function nameOf(store: Store, base: string): string {
  if (base === OWN_PLAN) return t('the original plan');
  const run = store.reviewClient?.runs.value.find(({ plan }) => plan === base);
  return run?.title ? `${run.id}: ${run.title}` : titleOfBase(base);
}

/** Compare with another plan, and show the difference at once: a chosen station's cloud would stand before it. */
export function showDifference(store: Store, base: string): void {
  batch(() => {
    store.chooseStation(null);
    store.compareBase.value = base;
    store.layerId.value = DIFFERENCE_ID;
  });
}

/** What the picture shows, in words. */
function titleOfShown(store: Store): string {
  if (store.planBase.value !== OWN_PLAN) return titleOfBase(store.planBase.value);
  return store.draft.value === null ? t('The plan') : t('The edited plan');
}

function shownTotals(store: Store): Totals | null {
  const plan = store.loaded.value?.plan;
  if (plan === undefined) return null;
  const figures = store.reviewClient?.figures.value ?? null;
  return store.draft.value !== null && figures !== null ? draftTotals(plan, figures) : planTotals(plan);
}

function Figures({ store }: { store: Store }) {
  const comparison = store.comparison.value;
  const shown = shownTotals(store);
  if (comparison.kind !== 'shown' || shown === null) return null;
  const rows = figureRows(shown, planTotals(comparison.other.plan));
  return (
    <>
      <PlansNote store={store} />
      <table class="comparison" data-testid="comparison">
        <thead>
          <tr>
            <td />
            <th scope="col">{titleOfShown(store)}</th>
            <th scope="col">{comparison.other.title}</th>
          </tr>
        </thead>
        <tbody>
          {rows.map(({ name, shown: here, other }) => (
            <tr key={name}>
              <th scope="row">{name}</th>
              <td>{here}</td>
              <td>{other}</td>
            </tr>
          ))}
        </tbody>
      </table>
    </>
  );
}

/** Said where the two are not of the same floors, or doors. */
function PlansNote({ store }: { store: Store }) {
  const [plan, comparison] = [store.loaded.value?.plan, store.comparison.value];
  if (plan === undefined || comparison.kind !== 'shown') return null;
  const words = [
    floorsInWords({ title: titleOfShown(store), plan }, comparison.other),
    hasSameDoors(plan, comparison.other.plan) ? null : ENTRANCE_WORDS.otherDoors,
  ].filter((said) => said !== null);
  return words.length === 0 ? null : <p class="note note-warn">{words.join(' ')}</p>;
}

function curvesOf(store: Store): Curve[] {
  const plan = store.loaded.value?.plan;
  if (plan === undefined) return [];
  const own = store.planBase.value === OWN_PLAN ? t('The plan') : titleOfBase(store.planBase.value);
  const curves: Curve[] = [{ title: own, fractions: steepestCurve(plan), look: 'shown' }];
  const comparison = store.comparison.value;
  if (comparison.kind === 'shown' && comparison.other.base !== store.planBase.value) {
    curves.push({ title: comparison.other.title, fractions: steepestCurve(comparison.other.plan), look: 'other' });
  }
  const figures = store.reviewClient?.figures.value ?? null;
  if (store.draft.value !== null && figures !== null) {
    curves.push({ title: t('The edited plan'), fractions: figures.curve, look: 'draft' });
  }
  return curves;
}

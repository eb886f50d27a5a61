/** What is loaded: the plan folder that the page shows. */

import { type Signal, signal } from '@preact/signals';
import type { extentsOf } from '../floors/cut.ts';
import { t } from '../language/language.ts';
import type { FieldPlan, LoadedPlan } from './fetch-plan.ts';
import { OWN_PLAN } from './plan-base.ts';

export type Phase =
  | { readonly kind: 'loading'; readonly step: string; readonly fraction: number | null }
  | { readonly kind: 'failed'; readonly message: string }
  /** There is no plan yet, but the drawing that it will be made from. */
  | { readonly kind: 'drawing' }
  | { readonly kind: 'ready' };

export type Extents = ReturnType<typeof extentsOf>;

export interface LoadState {
  readonly phase: Signal<Phase>;
  readonly loaded: Signal<LoadedPlan | null>;
  /** Of a page that was opened in the field: the rest follows with the full plan. */
  readonly fieldPlan: Signal<FieldPlan | null>;
  readonly extents: Signal<Extents | null>;
  /** Folder of the plan that is shown; `OWN_PLAN` is the one the page was started for. */
  readonly planBase: Signal<string>;
}

export function createLoadState(): LoadState {
  return {
    phase: signal<Phase>({ kind: 'loading', step: t('Reading the plan'), fraction: null }),
    loaded: signal<LoadedPlan | null>(null),
    fieldPlan: signal<FieldPlan | null>(null),
    extents: signal<Extents | null>(null),
    planBase: signal(OWN_PLAN),
  };
}

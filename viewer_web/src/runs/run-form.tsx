/** The form of a run: it begins with what the plan was asked. */

import { useState } from 'preact/hooks';
import type { ReviewClient } from '../api/review-client.ts';
import { t } from '../language/language.ts';
import { OWN_PLAN } from '../load/plan-base.ts';
import { Section } from '../panels/section.tsx';
import type { Store } from '../store.ts';
import { FIELD_RULES, faultsOf, formFrom, type NumberField, type RunForm, requestOf } from './run-request.ts';

const MORE: readonly NumberField[] = ['spacingMm', 'rangeM', 'incidenceDeg', 'noiseMm', 'seenFrom', 'timeLimitS'];
const CHOICES = {
  objective: [
    ['fewest', t('Fewest stations')],
    ['coverage', t('Most coverage, number of stations given')],
    ['time', t('Least field time')],
  ],
  network: [
    ['connected', t('Connected')],
    ['redundant', t('Connected, redundant')],
    ['none', t('Not required')],
  ],
  preAlignment: [
    ['', t('As the scanner has it')],
    ['tracked', t('Tracked by the scanner')],
    ['manual', t('Placed by hand')],
    ['level', t('Level only')],
    ['none', t('None')],
  ],
} as const;

interface FormProps {
  readonly store: Store;
  readonly reviewClient: ReviewClient;
}

export function RunFormSection({ store, reviewClient }: FormProps) {
  const plan = store.loaded.value?.plan;
  const [form, setForm] = useState<RunForm | null>(null);
  const [isSending, setIsSending] = useState(false);
  if (plan === undefined) return null;
  const shown = form ?? formFrom(plan.requirements);
  const faults = faultsOf(shown);
  const obstacle = reviewClient.runObstacle.value;
  const isRunning = reviewClient.runs.value.some(({ state }) => state === 'running');
  const set = (changes: Partial<RunForm>): void => setForm({ ...shown, ...changes });
  const start = async (): Promise<void> => {
    setIsSending(true);
    try {
      await reviewClient.client.post('runs', requestOf(shown));
      await reviewClient.refreshRuns();
      // What was changed meanwhile stays.
      setForm((now) => {
        const meanwhile = now ?? shown;
        return { ...meanwhile, title: meanwhile.title === shown.title ? '' : meanwhile.title };
      });
    } catch (error) {
      reviewClient.warn((error as Error).message);
    }
    setIsSending(false);
  };
  return (
    <Section title={t('Plan again')}>
      <form
        onSubmit={(event) => {
          event.preventDefault();
          void start();
        }}
      >
        <MainFields form={shown} set={set} faults={faults} />
        <details class="run-more">
          <summary>{t('More requirements')}</summary>
          <div class="fields">
            {MORE.map((field) => (
              <NumberInput key={field} form={shown} field={field} set={set} fault={faults[field]} />
            ))}
          </div>
          <FloorChoice store={store} form={shown} set={set} />
        </details>
        <ReviewChoice store={store} form={shown} set={set} />
        <div class="buttons">
          <button
            type="submit"
            class="button button-primary"
            disabled={Object.keys(faults).length > 0 || isSending || isRunning || obstacle !== null}
          >
            {t('Start')}
          </button>
        </div>
        {obstacle !== null && (
          <p class="hint field-fault" role="status">
            {t('No run can be started: {obstacle}', { obstacle })}
          </p>
        )}
        {isRunning && <p class="hint">{t('One run at a time: wait for the one that is running, or cancel it.')}</p>}
      </form>
    </Section>
  );
}

interface PartProps {
  readonly form: RunForm;
  readonly set: (changes: Partial<RunForm>) => void;
}

function MainFields({ form, set, faults }: PartProps & { faults: Partial<Record<NumberField, string>> }) {
  return (
    <>
      <label class="field">
        {t('Title')}
        <input
          type="text"
          maxLength={200}
          placeholder={t('Purpose of this run')}
          value={form.title}
          onInput={(event) => set({ title: event.currentTarget.value })}
        />
      </label>
      <Choice label={t('Objective')} field="objective" form={form} set={set} />
      <div class="fields">
        {form.objective === 'coverage' && (
          <NumberInput form={form} field="maxStations" set={set} fault={faults.maxStations} />
        )}
        <NumberInput form={form} field="coveragePercent" set={set} fault={faults.coveragePercent} />
        <NumberInput form={form} field="overlapPercent" set={set} fault={faults.overlapPercent} />
      </div>
      <Choice label={t('Network')} field="network" form={form} set={set} />
      <Choice
        label={t('Pre-alignment')}
        hint={t('Where registration of two scans starts')}
        field="preAlignment"
        form={form}
        set={set}
      />
      <NumberInput form={form} field="linkProbabilityPercent" set={set} fault={faults.linkProbabilityPercent} />
    </>
  );
}

interface ChoiceProps extends PartProps {
  readonly label: string;
  readonly hint?: string;
  readonly field: keyof typeof CHOICES;
}

function Choice({ form, set, label, hint, field }: ChoiceProps) {
  return (
    <label class="field" title={hint}>
      {label}
      <select value={form[field]} onChange={(event) => set({ [field]: event.currentTarget.value })}>
        {CHOICES[field].map(([value, words]) => (
          <option key={value} value={value}>
            {words}
          </option>
        ))}
      </select>
    </label>
  );
}

function NumberInput({ form, field, set, fault }: PartProps & { field: NumberField; fault: string | undefined }) {
  const { label, unit, hint } = FIELD_RULES[field];
  return (
    <label class="field" title={hint}>
      {label}
      <span class="unit-input">
        <input
          type="text"
          inputMode="decimal"
          aria-invalid={fault !== undefined}
          placeholder={t('any')}
          value={form[field]}
          onInput={(event) => set({ [field]: event.currentTarget.value })}
        />
        {unit}
      </span>
      {fault !== undefined && <span class="field-fault">{fault}</span>}
    </label>
  );
}

function FloorChoice({ store, form, set }: PartProps & { store: Store }) {
  const floors = store.loaded.value?.plan.floors ?? [];
  if (floors.length < 2) return null;
  const chosen = form.floors.length === 0 ? floors.map(({ id }) => id) : form.floors;
  const toggle = (id: string, isOn: boolean): void => {
    const next = floors.map((floor) => floor.id).filter((each) => (each === id ? isOn : chosen.includes(each)));
    set({ floors: next.length === floors.length ? [] : next });
  };
  return (
    <fieldset class="choices">
      <legend>{t('Floors')}</legend>
      {floors.map(({ id, name }) => (
        <label key={id} class="check">
          <input
            type="checkbox"
            checked={chosen.includes(id)}
            disabled={chosen.length === 1 && chosen[0] === id}
            onChange={(event) => toggle(id, event.currentTarget.checked)}
          />
          {name}
        </label>
      ))}
    </fieldset>
  );
}

function ReviewChoice({ store, form, set }: PartProps & { store: Store }) {
  const isOwn = store.planBase.value === OWN_PLAN;
  return (
    <label
      class="check run-more"
      title={t('Uses moved and locked stations, forbidden positions, zones and marked floors')}
    >
      <input
        type="checkbox"
        checked={form.fromReview}
        onChange={(event) => set({ fromReview: event.currentTarget.checked })}
      />
      {isOwn ? t('Keep current stations and edits') : t('Keep stations and edits of the main plan')}
    </label>
  );
}

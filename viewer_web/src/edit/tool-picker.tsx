/** The tools, and what the one in hand needs to know. */

import { batch } from '@preact/signals';
import { t } from '../language/language.ts';
import { lengthWords } from '../panels/figures.ts';
import { Section } from '../panels/section.tsx';
import { whyNoPicture } from '../scene/state.ts';
import type { Store } from '../store.ts';
import { DoorOption } from './entrance-parts.tsx';
import { ENTRANCE_WORDS } from './entrance-words.ts';
import { faultOf } from './outline.ts';
import { isLive } from './readiness.ts';
import type { Tool } from './state.ts';

interface ToolEntry {
  readonly tool: Tool;
  readonly title: string;
  readonly hint: string;
  /** Only with the live side: it knows where a tripod can stand. */
  readonly needsLive: boolean;
}

/** What these do shows in the plan of a floor, too; what the others draw, in the 3D picture alone. */
const IN_PLAN: readonly Tool[] = ['select', 'add'];

const TOOLS: readonly ToolEntry[] = [
  {
    tool: 'select',
    title: t('Move'),
    hint: t('Drag a station: it stays where a tripod can stand.'),
    needsLive: false,
  },
  { tool: 'add', title: t('Add station'), hint: t('Click the floor at the new position.'), needsLive: true },
  {
    tool: 'forbid',
    title: t('Forbid position'),
    hint: t('Click a point that new plans must keep stations away from.'),
    needsLive: false,
  },
  {
    tool: 'keep_out',
    title: t('Keep-out'),
    hint: t('Click the corners of an area to keep out of; close it at its first corner.'),
    needsLive: false,
  },
  {
    tool: 'priority',
    title: t('Priority'),
    hint: t('Click the corners of an area that needs more coverage; close it at its first corner.'),
    needsLive: false,
  },
  {
    tool: 'ground',
    title: t('Floor surface'),
    hint: t('Click a surface to mark its level area for the next plan.'),
    needsLive: false,
  },
  { tool: 'entrance', title: ENTRANCE_WORDS.entranceTool, hint: ENTRANCE_WORDS.entranceHint, needsLive: false },
  {
    tool: 'doors',
    title: ENTRANCE_WORDS.doorTool,
    hint: `${ENTRANCE_WORDS.doorHint} ${ENTRANCE_WORDS.doorsNote}`,
    needsLive: false,
  },
];

export function ToolPicker({ store }: { store: Store }) {
  const { editing } = store;
  const tool = editing.tool.value;
  const offOf = (entry: ToolEntry): string | null => (IN_PLAN.includes(entry.tool) ? null : whyNoPicture(store));
  const chosen = TOOLS.find((entry) => entry.tool === tool);
  const hint =
    tool === 'select' && !isLive(store)
      ? t('Select a station to lock it, remove it, or forbid its position.')
      : chosen?.hint;
  return (
    <Section title={t('Tool')}>
      <div class="tools" role="radiogroup" aria-label={t('Tool')}>
        {TOOLS.map((entry) => (
          // biome-ignore lint/a11y/useSemanticElements: drawn as one button of a palette.
          <button
            key={entry.tool}
            type="button"
            role="radio"
            aria-checked={tool === entry.tool}
            disabled={(entry.needsLive && !isLive(store)) || offOf(entry) !== null}
            title={offOf(entry) ?? undefined}
            onClick={() => choose(store, entry.tool)}
          >
            {entry.tool === 'select' && !isLive(store) ? t('Select') : entry.title}
          </button>
        ))}
      </div>
      <p class="hint">{hint}</p>
      {(tool === 'keep_out' || tool === 'priority') && <OutlineOptions store={store} />}
      {tool === 'forbid' && <RadiusOption store={store} />}
      {tool === 'ground' && <GroundOption store={store} />}
      {tool === 'doors' && <DoorOption store={store} />}
    </Section>
  );
}

function choose(store: Store, tool: Tool): void {
  batch(() => {
    store.editing.tool.value = tool;
    store.editing.editor.peek()?.areas.dropOutline();
    store.editing.showsPlan.value = false;
  });
}

function OutlineOptions({ store }: { store: Store }) {
  const { editing } = store;
  const outline = editing.outline.value;
  const areas = editing.editor.value?.areas;
  return (
    // Enter in a field closes the outline, as it does over the building.
    <form
      onSubmit={(event) => {
        event.preventDefault();
        void areas?.finishOutline();
      }}
    >
      <label class="field">
        {t('Name')}
        <input
          type="text"
          maxLength={100}
          placeholder={editing.tool.value === 'priority' ? t('Plant room') : t('Wet floor')}
          value={editing.zoneName.value}
          onInput={(event) => {
            editing.zoneName.value = event.currentTarget.value;
          }}
        />
      </label>
      {editing.tool.value === 'priority' && (
        <label class="field">
          {t('Required coverage')}
          <span class="unit-input">
            <input
              type="text"
              inputMode="decimal"
              value={editing.priorityPercent.value}
              onInput={(event) => {
                editing.priorityPercent.value = event.currentTarget.value;
              }}
            />
            %
          </span>
        </label>
      )}
      {outline.length > 0 && (
        <>
          <p class="hint" role="status">
            {faultOf(outline) ?? t('{n} corners', { n: outline.length })}
          </p>
          <div class="buttons">
            <button type="submit" class="button button-primary button-small" disabled={faultOf(outline) !== null}>
              {t('Finish')}
            </button>
            <button type="button" class="button button-small" onClick={() => areas?.takeCornerBack()}>
              {t('Remove last corner')}
            </button>
            <button type="button" class="button button-small" onClick={() => areas?.dropOutline()}>
              {t('Cancel')}
            </button>
          </div>
        </>
      )}
    </form>
  );
}

function RadiusOption({ store }: { store: Store }) {
  const radius = store.editing.forbidRadiusM;
  return (
    <label class="slider">
      <span>{t('Radius')}</span>
      <output>{lengthWords(radius.value, 1)}</output>
      <input
        type="range"
        min={0.2}
        max={5}
        step={0.1}
        value={radius.value}
        onInput={(event) => {
          radius.value = event.currentTarget.valueAsNumber;
        }}
      />
    </label>
  );
}

function GroundOption({ store }: { store: Store }) {
  const { marksGround } = store.editing;
  return (
    <div class="segments" role="radiogroup" aria-label={t('Type of the clicked surface')}>
      {[true, false].map((isGround) => (
        // biome-ignore lint/a11y/useSemanticElements: drawn as one segment of a bar.
        <button
          key={String(isGround)}
          type="button"
          role="radio"
          aria-checked={marksGround.value === isGround}
          onClick={() => {
            marksGround.value = isGround;
          }}
        >
          {isGround ? t('Walkable floor') : t('Not a floor')}
        </button>
      ))}
    </div>
  );
}

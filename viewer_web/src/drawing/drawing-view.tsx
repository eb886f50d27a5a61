/** Correcting a drawing: the whole page, with tools above and properties beside. */

import { useEffect, useState } from 'preact/hooks';
import type { Drawn } from '../api/documents.ts';
import { t } from '../language/language.ts';
import '../edit/edit.css';
import { formFrom, requestOf } from '../runs/run-request.ts';
import type { Store } from '../store.ts';
import { DrawingCanvas } from './drawing-canvas.tsx';
import { DrawingPanel } from './drawing-panel.tsx';
import './drawing.css';
import type { DrawingEditor, Tool } from './editor.ts';
import type { Corners } from './geometry.ts';
import { straightOf } from './geometry.ts';
import { listenToDrawingKeys } from './keys.ts';
import type { Sizes } from './pointer.ts';
import { aroundCorners, type ViewBox } from './view-box.ts';

const TOOLS: readonly (readonly [Tool, string])[] = [
  ['select', t('Select')],
  ['wall', t('Wall')],
  ['door', t('Door')],
  ['window', t('Window')],
  ['scale', t('Scale')],
  ['north', t('North')],
];
const USUAL: Sizes = { wallM: 0.15, doorM: 0.9, windowM: 1.2 };

interface ViewProps {
  readonly store: Store;
  readonly editor: DrawingEditor;
}

export function DrawingView({ store, editor }: ViewProps) {
  const [view, setView] = useState<ViewBox | null>(null);
  const [sizes, setSizes] = useState<Sizes | null>(null);
  const mayChange = editor.mayChange.value;
  const drawn = editor.drawn.value;
  const number = editor.storey.value;
  useEffect(() => {
    if (editor.drawn.peek() === null) void editor.open();
  }, [editor]);
  useEffect(() => {
    if (drawn !== null) void editor.loadLines(number);
  }, [editor, drawn === null, number]);
  useEffect(() => listenToDrawingKeys(window, editor, () => mayChange), [editor, mayChange]);
  useEffect(() => {
    const warn = (event: BeforeUnloadEvent): void => {
      if (editor.saving.peek() !== 'saved') event.preventDefault();
    };
    window.addEventListener('beforeunload', warn);
    return () => window.removeEventListener('beforeunload', warn);
  }, [editor]);
  const goTo = (corners: Corners): void => {
    const box = document.querySelector('.drawing-canvas')?.getBoundingClientRect();
    if (box !== undefined) setView({ ...aroundCorners(spread(corners), box.width, box.height) });
  };
  return (
    <main class="drawing-view">
      <Tools store={store} editor={editor} mayChange={mayChange} onStorey={() => setView(null)} />
      <Notice editor={editor} />
      {drawn === null ? (
        <p class="drawing-empty" role="status">
          {editor.message.value ?? t('This plan was made from a model, or its drawing file is no longer beside it.')}
        </p>
      ) : (
        <div class="drawing-body">
          <DrawingCanvas
            editor={editor}
            view={view}
            setView={setView}
            sizes={sizes ?? usualSizes(drawn)}
            mayChange={mayChange}
          />
          <DrawingPanel
            editor={editor}
            drawn={drawn}
            mayChange={mayChange}
            sizes={sizes ?? usualSizes(drawn)}
            setSizes={setSizes}
            goTo={goTo}
          />
        </div>
      )}
    </main>
  );
}

/** A place with three metres around it. */
const spread = (corners: Corners): Corners =>
  corners.flatMap(([x, y]) => [[x - 3, y - 3] as const, [x + 3, y + 3] as const]);

/** New walls are as thick as half of those that there are. */
function usualSizes(drawn: Drawn): Sizes {
  const thick = drawn.storeys
    .flatMap(({ walls }) => walls.map(({ outline }) => straightOf(outline as Corners)?.thicknessM ?? []))
    .flat()
    .sort((a, b) => a - b);
  const wallM = thick[Math.floor(thick.length / 2)];
  return wallM === undefined ? USUAL : { ...USUAL, wallM: Math.round(100 * wallM) / 100 };
}

interface ToolsProps extends ViewProps {
  readonly mayChange: boolean;
  readonly onStorey: () => void;
}

function Tools({ store, editor, mayChange, onStorey }: ToolsProps) {
  const storeys = editor.drawn.value?.storeys ?? [];
  return (
    <div class="drawing-tools" role="toolbar" aria-label={t('Drawing')}>
      {editor.hasPlan.value && (
        <button
          type="button"
          class="button"
          onClick={() => {
            store.page.value = 'plan';
          }}
        >
          {t('Back to the plan')}
        </button>
      )}
      {storeys.length > 1 && (
        <label class="drawing-storey">
          <span class="muted">{t('Storey')}</span>
          <select
            value={String(editor.storey.value)}
            onChange={(event) => {
              editor.storey.value = Number(event.currentTarget.value);
              editor.chosen.value = null;
              editor.begun.value = [];
              onStorey();
            }}
          >
            {storeys
              .map(({ name }, i) => (
                <option key={i} value={String(i)}>
                  {name}
                </option>
              ))
              .reverse()}
          </select>
        </label>
      )}
      <div class="segments drawing-segments" role="radiogroup" aria-label={t('Tool')}>
        {TOOLS.map(([tool, words]) => (
          // biome-ignore lint/a11y/useSemanticElements: drawn as one segment of a bar.
          <button
            key={tool}
            type="button"
            role="radio"
            aria-checked={editor.tool.value === tool}
            disabled={!mayChange && tool !== 'select'}
            onClick={() => {
              editor.tool.value = tool;
              if (tool !== 'select') editor.chosen.value = null;
              editor.begun.value = [];
              editor.message.value = editor.saving.peek() === 'saved' ? null : editor.message.peek();
            }}
          >
            {words}
          </button>
        ))}
      </div>
      <button
        type="button"
        class="button"
        title={t('Undo (Ctrl+Z)')}
        disabled={!mayChange || !editor.canUndo.value}
        onClick={() => editor.undo()}
      >
        {t('Undo')}
      </button>
      <button
        type="button"
        class="button"
        title={t('Redo (Ctrl+Y)')}
        disabled={!mayChange || !editor.canRedo.value}
        onClick={() => editor.redo()}
      >
        {t('Redo')}
      </button>
      <button type="button" class="button" title={t('The whole storey')} onClick={onStorey}>
        {t('Fit')}
      </button>
      <span class="drawing-saving muted" role="status" data-testid="drawing-saving">
        {savingWords(editor)}
      </span>
      <PlanAgain store={store} editor={editor} mayChange={mayChange} />
    </div>
  );
}

function savingWords(editor: DrawingEditor): string {
  const saving = editor.saving.value;
  if (editor.drawn.value === null) return '';
  if (saving === 'saved') return t('Saved');
  return saving === 'saving' ? t('Saving …') : t('Not saved');
}

function PlanAgain({ store, editor, mayChange }: ViewProps & { mayChange: boolean }) {
  const [isSending, setIsSending] = useState(false);
  const { reviewClient } = store;
  const plan = store.loaded.value?.plan;
  if (!editor.hasPlan.value) {
    return <span class="drawing-command">{t('Then: tlsplan plan {file}', { file: editor.file.value })}</span>;
  }
  if (reviewClient === null || plan === undefined) return null;
  const isRunning = reviewClient.runs.value.some(({ state }) => state === 'running');
  const start = async (): Promise<void> => {
    setIsSending(true);
    try {
      if (await editor.settled()) {
        const title = t('Corrected drawing');
        const form = { ...formFrom(plan.requirements), title, fromReview: false };
        await reviewClient.client.post('runs', { ...requestOf(form), from_drawing: true });
        await reviewClient.refreshRuns();
        store.tab.value = 'runs';
        store.isSidebarOpen.value = true;
        store.page.value = 'plan';
      }
    } catch (error) {
      editor.message.value = (error as Error).message;
    }
    setIsSending(false);
  };
  return (
    <button
      type="button"
      class="button button-primary"
      title={t('Makes the building anew from the drawing as corrected, and plans it beside this plan')}
      disabled={!mayChange || isSending || isRunning || editor.drawn.value === null}
      onClick={() => void start()}
    >
      {t('Plan again')}
    </button>
  );
}

function Notice({ editor }: { editor: DrawingEditor }) {
  const message = editor.message.value;
  if (message === null || editor.drawn.value === null) return null;
  return (
    <div class="drawing-notice" role="alert">
      <p>{message}</p>
      {editor.saving.value === 'conflict' && (
        <div class="buttons">
          <button type="button" class="button" onClick={() => void editor.takeTheirs()}>
            {t('Load the newer ones')}
          </button>
          <button type="button" class="button" onClick={() => void editor.keepMine()}>
            {t('Keep mine')}
          </button>
        </div>
      )}
    </div>
  );
}

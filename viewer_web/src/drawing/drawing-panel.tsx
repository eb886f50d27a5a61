/** Beside the drawing: what is chosen, what is to be checked, heights of the storey, and of the building. */

import { useState } from 'preact/hooks';
import type { Drawn, DrawnOpening, DrawnWall } from '../api/documents.ts';
import { plain, t } from '../language/language.ts';
import { LengthField } from '../panels/length-field.tsx';
import { Section } from '../panels/section.tsx';
import type { DrawingEditor } from './editor.ts';
import {
  type Chosen,
  closeOpening,
  middleOf,
  nameRoom,
  placeOpening,
  raiseCeiling,
  raiseFloor,
  remove,
  rescaled,
  reshapeWall,
  turnOpening,
  withStorey,
} from './edits.ts';
import { type Corners, direction, distance, plus, rounded, straightOf, straightOfOpening } from './geometry.ts';
import type { Sizes } from './pointer.ts';

interface PanelProps {
  readonly editor: DrawingEditor;
  readonly drawn: Drawn;
  readonly mayChange: boolean;
  readonly sizes: Sizes;
  readonly setSizes: (sizes: Sizes) => void;
  /** Show a place of the plan. */
  readonly goTo: (corners: Corners) => void;
}

export function DrawingPanel(props: PanelProps) {
  const { editor, drawn, mayChange } = props;
  return (
    <aside class="drawing-panel" aria-label={t('Properties')}>
      <fieldset disabled={!mayChange} class="drawing-fields">
        <ToolSection {...props} />
        <ChosenSection {...props} />
        <ToCheck {...props} />
        <StoreySection {...props} />
        <BuildingSection editor={editor} drawn={drawn} />
        <RoomNames {...props} />
      </fieldset>
    </aside>
  );
}

function ToolSection({ editor, drawn, sizes, setSizes }: PanelProps) {
  const [length, setLength] = useState<number | null>(null);
  const tool = editor.tool.value;
  const begun = editor.begun.value;
  if (tool === 'select') return null;
  if (tool === 'wall') {
    return (
      <Section title={t('Draw a wall')}>
        <p class="hint">{t('Click where it begins and where it ends. Esc ends the row of walls.')}</p>
        <LengthField
          label={t('Thickness')}
          valueM={sizes.wallM}
          onValue={sized((wallM) => setSizes({ ...sizes, wallM }))}
        />
      </Section>
    );
  }
  if (tool === 'door' || tool === 'window') {
    const isDoor = tool === 'door';
    return (
      <Section title={isDoor ? t('Add a door') : t('Add a window')}>
        <p class="hint">{t('Click a wall.')}</p>
        <LengthField
          label={t('Width')}
          valueM={isDoor ? sizes.doorM : sizes.windowM}
          onValue={sized((m) => setSizes(isDoor ? { ...sizes, doorM: m } : { ...sizes, windowM: m }))}
        />
      </Section>
    );
  }
  if (tool === 'north') {
    return (
      <Section title={t('Set north')}>
        <p class="hint">{t('Click two points, the second one to the north of the first.')}</p>
      </Section>
    );
  }
  const [p, q] = begun;
  const drawnM = p === undefined || q === undefined ? null : distance(p, q);
  const apply = (): void => {
    if (p === undefined || q === undefined || length === null) return;
    const to = rescaled(drawn, [p, q], length);
    if (to === null)
      editor.message.value = t('The true length has to be a thousandth to a thousandfold of the drawn one.');
    else editor.change(to);
    editor.tool.value = 'select';
    setLength(null);
  };
  return (
    <Section title={t('Set the scale')}>
      <p class="hint">{t('Click two points of a known distance, then give it. All storeys are enlarged alike.')}</p>
      {drawnM !== null && (
        <>
          <LengthField label={t('True distance')} valueM={length ?? drawnM} onValue={sized(setLength)} />
          <div class="buttons">
            <button type="button" class="button button-primary" disabled={length === null} onClick={apply}>
              {t('Set scale')}
            </button>
          </div>
        </>
      )}
    </Section>
  );
}

/** Lengths below a centimetre are slips. */
const sized =
  (set: (m: number) => void) =>
  (m: number): void => {
    if (m >= 0.01) set(m);
  };

function ChosenSection(props: PanelProps) {
  const { editor, drawn } = props;
  const chosen = editor.chosen.value;
  const storey = (editor.shown.value ?? drawn).storeys[editor.storey.value];
  if (chosen === null) return null;
  if (chosen.kind === 'wall') {
    const wall = storey.walls.find(({ id }) => id === chosen.id);
    return wall === undefined ? null : <WallSection {...props} wall={wall} chosen={chosen} />;
  }
  const opening = storey.openings.find(({ id }) => id === chosen.id);
  return opening === undefined ? null : <OpeningSection {...props} opening={opening} chosen={chosen} />;
}

function WallSection({ editor, drawn, wall, chosen }: PanelProps & { wall: DrawnWall; chosen: Chosen }) {
  const straight = straightOf(wall.outline as Corners);
  const reshape = (to: Drawn | null): void => {
    if (to === null) editor.message.value = t('Its doors and windows would not fit: move or delete them first.');
    else editor.change(to);
  };
  const set = (changes: { lengthM?: number; thicknessM?: number }): void => {
    if (straight === null) return;
    const along = direction(straight.a, straight.b) ?? [1, 0];
    const b = changes.lengthM === undefined ? straight.b : rounded(plus(straight.a, along, changes.lengthM));
    const thicknessM = changes.thicknessM ?? straight.thicknessM;
    reshape(reshapeWall(drawn, editor.storey.value, wall.id, { a: straight.a, b, thicknessM }));
  };
  return (
    <Section title={t('Wall {id}', { id: wall.id })}>
      {straight === null ? (
        <p class="hint">{t('No straight piece: it can be moved and deleted. Draw a wall in its place to shape it.')}</p>
      ) : (
        <>
          <p class="hint">
            {t('Drag it across, or one of its ends. Arrow keys move it by 1 cm, with Shift by 10 cm.')}
          </p>
          <div class="fields">
            <LengthField
              label={t('Length')}
              valueM={distance(straight.a, straight.b)}
              onValue={sized((lengthM) => set({ lengthM }))}
            />
            <LengthField
              label={t('Thickness')}
              valueM={straight.thicknessM}
              onValue={sized((thicknessM) => set({ thicknessM }))}
            />
          </div>
        </>
      )}
      <Delete editor={editor} drawn={drawn} chosen={chosen} />
    </Section>
  );
}

const KINDS = [
  ['door', t('Door')],
  ['window', t('Window')],
  ['passage', t('Passage')],
] as const;

function OpeningSection({ editor, drawn, opening, chosen }: PanelProps & { opening: DrawnOpening; chosen: Chosen }) {
  const number = editor.storey.value;
  const { a, b } = straightOfOpening(opening.corners as Corners);
  const title = opening.doubtful
    ? t('Gap {id}', { id: opening.id })
    : `${KINDS.find(([kind]) => kind === opening.kind)?.[1] ?? ''} ${opening.id}`;
  const widen = (widthM: number): void => {
    const to = placeOpening(drawn, number, opening.id, middleOf(opening.corners as Corners), widthM);
    if (to === null) editor.message.value = t('The wall has no room for this width.');
    else editor.change(to);
  };
  return (
    <Section title={title}>
      {opening.doubtful && <p class="hint">{t('Nothing in the drawing shows what it is. What is it?')}</p>}
      <fieldset class="buttons drawing-kinds" aria-label={t('Kind')}>
        {KINDS.map(([kind, words]) => (
          <button
            key={kind}
            type="button"
            class="button"
            aria-pressed={opening.kind === kind && !opening.doubtful}
            onClick={() => editor.change(turnOpening(drawn, number, opening.id, kind))}
          >
            {words}
          </button>
        ))}
        <button
          type="button"
          class="button"
          onClick={() => {
            editor.change(closeOpening(drawn, number, opening.id));
            editor.chosen.value = null;
          }}
        >
          {t('Wall')}
        </button>
      </fieldset>
      {opening.kind !== 'passage' && (
        <>
          <LengthField label={t('Width')} valueM={distance(a, b)} onValue={sized(widen)} />
          <p class="hint">{t('Drag it along its wall, or into another one.')}</p>
          <Delete editor={editor} drawn={drawn} chosen={chosen} />
        </>
      )}
    </Section>
  );
}

function Delete({ editor, drawn, chosen }: { editor: DrawingEditor; drawn: Drawn; chosen: Chosen }) {
  return (
    <div class="buttons">
      <button
        type="button"
        class="button"
        onClick={() => {
          editor.change(remove(drawn, editor.storey.value, chosen));
          editor.chosen.value = null;
        }}
      >
        {t('Delete (Del)')}
      </button>
    </div>
  );
}

/** Gaps that nothing in the drawing explains. */
function ToCheck({ editor, drawn, goTo }: PanelProps) {
  const doubtful = drawn.storeys[editor.storey.value].openings.filter((opening) => opening.doubtful);
  if (doubtful.length === 0) return null;
  return (
    <Section title={t('To check')} aside={`${doubtful.length}`}>
      <p class="hint">{t('Gaps in walls without a door or a window:')}</p>
      <div class="buttons drawing-gaps">
        {doubtful.map(({ id, corners }) => (
          <button
            key={id}
            type="button"
            class="button button-small"
            onClick={() => {
              editor.tool.value = 'select';
              editor.chosen.value = { kind: 'opening', id };
              goTo(corners as Corners);
            }}
          >
            {t('Gap {id}', { id })}
          </button>
        ))}
      </div>
    </Section>
  );
}

function StoreySection({ editor, drawn }: PanelProps) {
  const number = editor.storey.value;
  const storey = drawn.storeys[number];
  const rooms = editor.rooms.value[number] ?? [];
  return (
    <Section title={t('Storey')} aside={t('{n, plural, one {# room} other {# rooms}}', { n: rooms.length })}>
      <label class="field">
        {t('Name')}
        <input
          type="text"
          maxLength={100}
          value={storey.name}
          onChange={(event) => editor.change(withStorey(drawn, number, { name: event.currentTarget.value }))}
        />
      </label>
      <div class="fields">
        <LengthField
          label={t('Floor at')}
          valueM={storey.elevation_m}
          onValue={(m) => editor.change(raiseFloor(drawn, number, m))}
        />
        <LengthField
          label={t('Wall height')}
          valueM={storey.room_height_m}
          onValue={sized((m) => editor.change(raiseCeiling(drawn, number, m)))}
        />
      </div>
      {drawn.storeys.length > number + 1 && <p class="hint">{t('Storeys above are raised by as much.')}</p>}
      {rooms.length === 0 && (
        <p class="drawing-note">{t('Its walls enclose no room. Close the gaps, or mark them as open.')}</p>
      )}
    </Section>
  );
}

function RoomNames({ editor, drawn, goTo }: PanelProps) {
  const number = editor.storey.value;
  const rooms = editor.rooms.value[number] ?? [];
  if (rooms.length === 0) return null;
  return (
    <Section title={t('Names of rooms')}>
      <p class="hint">{t('A number, a name, or both, such as 101 Office.')}</p>
      {rooms.map(({ name, long_name, outline }, row) => {
        const words = [name, long_name].filter(Boolean).join(' ');
        return (
          <label class="field" key={`${row} ${words}`}>
            <input
              type="text"
              maxLength={100}
              aria-label={t('Room {name}', { name: words })}
              value={words}
              onFocus={() => goTo(outline as Corners)}
              onChange={(event) =>
                editor.change(nameRoom(drawn, number, outline as Corners, event.currentTarget.value))
              }
            />
          </label>
        );
      })}
    </Section>
  );
}

function BuildingSection({ editor, drawn }: { editor: DrawingEditor; drawn: Drawn }) {
  const set = (changes: Partial<Drawn>): void => editor.change({ ...drawn, ...changes });
  return (
    <Section title={t('Building')}>
      <div class="fields">
        <LengthField
          label={t('Door height')}
          valueM={drawn.door_height_m}
          onValue={sized((m) => set({ door_height_m: m }))}
        />
        <LengthField label={t('Sill height')} valueM={drawn.sill_height_m} onValue={(m) => set({ sill_height_m: m })} />
        <LengthField
          label={t('Window head')}
          valueM={drawn.window_head_m}
          onValue={sized((m) => set({ window_head_m: m }))}
        />
      </div>
      <label class="field">
        {t('Doubtful gaps and stairs')}
        <select
          value={drawn.doubtful}
          onChange={(event) => set({ doubtful: event.currentTarget.value === 'as-wall' ? 'as-wall' : 'as-open' })}
        >
          <option value="as-open">{t('count as open')}</option>
          <option value="as-wall">{t('count as walls')}</option>
        </select>
      </label>
      <p class="hint">
        {drawn.north_deg === null
          ? t('North is not set.')
          : t('North: {angle}° clockwise from up.', { angle: plain(Math.round(10 * drawn.north_deg) / 10) })}{' '}
        {t('Drawings: {names}', { names: drawn.files.map(({ name }) => name).join(', ') })}
      </p>
    </Section>
  );
}

/** The matrix of pairwise overlap: above the diagonal how much is shared, below it how firmly that holds. */

import { useState } from 'preact/hooks';
import { decimal, t } from '../language/language.ts';
import type { PlanLink } from '../load/plan-json.ts';
import { reachedPercent } from '../panels/figures.ts';
import type { ShownStation } from '../stations/shown.ts';
import type { Store } from '../store.ts';
import { type Counting, registersWords } from './graph.ts';
import { inkOn } from './ink.ts';
import { lackInWords } from './link-groups.ts';
import { type Rim, rimOf } from './matrix-rim.ts';
import type { Pair } from './state.ts';
import { overlapColor, strengthColor, strengthInWords } from './strength.ts';
import { weakMotionOf } from './weak-motion.ts';
import './network.css';

/** Width of the sheet's, about. */
const SHEET_PX = 520;
/** Of a cell in which a figure is read. */
const FIGURES_PX = 40;

interface MatrixProps {
  readonly store: Store;
  readonly counting: Counting;
  /** In pixels; nothing told: that of the sheet. */
  readonly width?: number;
  /** Overlap and strength in figures, in cells as large as that takes. */
  readonly hasFigures?: boolean;
}

interface Cell {
  readonly row: number;
  readonly column: number;
}

export function Matrix({ store, counting, width: widthPx = SHEET_PX, hasFigures = false }: MatrixProps) {
  const [cursor, setCursor] = useState<Cell | null>(null);
  const stations = store.shownStations.value;
  const n = stations.length;
  const place = new Map(stations.map(({ id }, i) => [id, i]));
  const linkAt = new Map(store.shownLinks.value.map((link) => [keyOf(place, link.a, link.b), link]));
  const width = hasFigures ? Math.max(widthPx, (n + 1) * FIGURES_PX) : widthPx;
  const nFigures = Math.max(1, ...stations.map(({ number }) => String(number).length));
  const rims = rimOf(n, width, nFigures);
  const rim = rims.width;
  const at = (cell: Cell): Pair => [stations[cell.row].id, stations[cell.column].id];
  const choose = (cell: Cell | null): void => {
    if (cell === null || cell.row === cell.column) return;
    store.choosePair(at(cell));
  };
  const cellOf = (event: MouseEvent): Cell | null => {
    const box = (event.currentTarget as SVGSVGElement).getBoundingClientRect();
    const scale = (n + rim) / box.width;
    const column = Math.floor((event.clientX - box.left) * scale - rim);
    const row = Math.floor((event.clientY - box.top) * scale - rim);
    return row >= 0 && column >= 0 && row < n && column < n ? { row, column } : null;
  };
  const move = (event: KeyboardEvent): void => {
    const by = { ArrowUp: [-1, 0], ArrowDown: [1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] }[event.key];
    const from = cursor ?? { row: 0, column: 0 };
    if (by !== undefined) {
      const inside = (x: number): number => Math.min(n - 1, Math.max(0, x));
      setCursor({ row: inside(from.row + by[0]), column: inside(from.column + by[1]) });
    } else if (event.key === 'Enter') choose(cursor);
    else return;
    event.preventDefault();
    event.stopPropagation();
  };
  return (
    <div class={hasFigures ? 'matrix matrix-figures' : 'matrix'}>
      <svg
        role="application"
        aria-label={t(
          'Matrix of overlap and strength of all pairs of stations. Arrow keys move, Enter chooses a pair.',
        )}
        tabindex={0}
        {...(hasFigures ? { style: { minWidth: `${width}px` } } : {})}
        viewBox={`${-rim} ${-rim} ${n + rim} ${n + rim}`}
        onPointerMove={(event) => setCursor(cellOf(event))}
        onPointerLeave={() => setCursor(null)}
        onClick={(event) => choose(cellOf(event))}
        onKeyDown={move}
      >
        <rect class="matrix-back" width={n} height={n} />
        {store.shownLinks.value.map((link) => (
          <Cells
            key={`${link.a} ${link.b}`}
            link={link}
            place={place}
            counting={counting}
            isDark={store.isDark.value}
            hasFigures={hasFigures}
          />
        ))}
        {stations.map(({ id }, i) => (
          <rect key={id} class="matrix-diagonal" x={i} y={i} width="1" height="1" />
        ))}
        {stations.map(({ id, number }, i) => (
          <Numbers
            key={id}
            rim={rims}
            number={number}
            row={rims.isNumbered(i, cursor?.row) ? i : null}
            column={rims.isNumbered(i, cursor?.column) ? i : null}
          />
        ))}
        <ChosenCells pair={store.pair.value} place={place} />
        {cursor !== null && <Pointed rim={rims} cursor={cursor} stations={stations} />}
      </svg>
      <p class="muted matrix-words" aria-live="polite">
        {cursor === null || cursor.row === cursor.column
          ? t('Overlap above the diagonal, strength below. Point at a cell.')
          : inWords(at(cursor), linkAt.get(keyOf(place, ...at(cursor))), counting)}
      </p>
    </div>
  );
}

function keyOf(place: ReadonlyMap<string, number>, a: string, b: string): string {
  const [i, j] = [place.get(a) ?? -1, place.get(b) ?? -1];
  return `${Math.min(i, j)} ${Math.max(i, j)}`;
}

function inWords([a, b]: Pair, link: PlanLink | undefined, counting: Counting): string {
  if (link === undefined) return t('{a} – {b}: no overlap listed', { a, b });
  const weak = weakMotionOf(link.weak_motion);
  const held = weak === null ? '' : `, ${t('weakest direction: {direction}', { direction: weak.short })}`;
  const lack = lackInWords(link, counting);
  const use = lack === null ? '' : ` ${t('Does not register: {lack}.', { lack })}`;
  const words = t('{a} – {b}: {percent} overlap, strength {strength}', {
    a,
    b,
    percent: reachedPercent(link.overlap, counting.threshold),
    strength: strengthInWords(link.strength),
  });
  return `${words}${registersWords(link, counting)}${held}.${use}`;
}

interface CellsProps {
  readonly link: PlanLink;
  readonly place: ReadonlyMap<string, number>;
  readonly counting: Counting;
  readonly isDark: boolean;
  readonly hasFigures: boolean;
}

/** Both cells of a link; what doesn't count is smaller. */
function Cells({ link, place, counting, isDark, hasFigures }: CellsProps) {
  const [a, b] = [place.get(link.a), place.get(link.b)];
  if (a === undefined || b === undefined) return null;
  const [low, high] = [Math.min(a, b), Math.max(a, b)];
  const isCounting = lackInWords(link, counting) === null;
  const margin = isCounting ? 0.04 : hasFigures ? 0.14 : 0.28;
  const size = 1 - 2 * margin;
  const [overlap, strength] = [overlapColor(link.overlap, isDark), strengthColor(link.strength, isDark)];
  return (
    <>
      <rect x={high + margin} y={low + margin} width={size} height={size} fill={overlap} />
      <rect x={low + margin} y={high + margin} width={size} height={size} fill={strength} />
      {hasFigures && (
        <CellFigure x={high} y={low} on={overlap} words={wholePercent(link.overlap, counting.threshold)} />
      )}
      {hasFigures && link.strength !== null && (
        <CellFigure x={low} y={high} on={strength} words={decimal(link.strength, link.strength < 0.01 ? 3 : 2)} />
      )}
    </>
  );
}

/** Whole percents fit a cell; `<30` where it would read as the 30 required and is less. */
function wholePercent(overlap: number, required: number): string {
  const words = decimal(100 * overlap, 0);
  return overlap < required && Math.round(100 * overlap) >= 100 * required ? `<${decimal(100 * required, 0)}` : words;
}

function CellFigure({ x, y, on, words }: { x: number; y: number; on: string; words: string }) {
  return (
    <text class="matrix-figure" x={x + 0.5} y={y + 0.5} font-size={words.length > 4 ? 0.22 : 0.27} fill={inkOn(on)}>
      {words}
    </text>
  );
}

interface NumbersProps {
  readonly rim: Rim;
  readonly number: number;
  /** Where it stands at the rim beside and above; null: not there. */
  readonly row: number | null;
  readonly column: number | null;
  readonly isPointed?: boolean;
}

/** A station's number beside its row, and on end above its column. */
function Numbers({ rim, number, row, column, isPointed = false }: NumbersProps) {
  const name = isPointed ? 'matrix-number matrix-number-pointed' : 'matrix-number';
  const y = -rim.gap;
  return (
    <>
      {row !== null && (
        <text class={name} font-size={rim.fontSize} x={-rim.gap} y={row + 0.5} text-anchor="end">
          {number}
        </text>
      )}
      {column !== null && (
        <text
          class={name}
          font-size={rim.fontSize}
          x={column + 0.5}
          y={y}
          transform={`rotate(-90 ${column + 0.5} ${y})`}
          text-anchor="start"
        >
          {number}
        </text>
      )}
    </>
  );
}

interface PointedProps {
  readonly rim: Rim;
  readonly cursor: Cell;
  readonly stations: readonly ShownStation[];
}

/** The cell under the pointer, and the numbers of its row and column. */
function Pointed({ rim, cursor: { row, column }, stations }: PointedProps) {
  return (
    <>
      <Numbers rim={rim} number={stations[row].number} row={row} column={null} isPointed={true} />
      <Numbers rim={rim} number={stations[column].number} row={null} column={column} isPointed={true} />
      <rect class="matrix-cursor" x={column} y={row} width="1" height="1" />
    </>
  );
}

function ChosenCells({ pair, place }: { pair: Pair | null; place: ReadonlyMap<string, number> }) {
  const [a, b] = (pair ?? []).map((id) => place.get(id));
  if (a === undefined || b === undefined) return null;
  return (
    <>
      <rect class="matrix-chosen" x={a} y={b} width="1" height="1" />
      <rect class="matrix-chosen" x={b} y={a} width="1" height="1" />
    </>
  );
}

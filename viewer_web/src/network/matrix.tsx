/** The matrix of pairwise overlap: above the diagonal how much is shared, below it how firmly that holds. */
import { useState } from 'preact/hooks';
import type { PlanLink } from '../load/plan-json.ts';
import { percent } from '../panels/figures.ts';
import type { ShownStation } from '../stations/shown.ts';
import type { Pair, Store } from '../store.ts';
import { type Counting, counts } from './graph.ts';
import { overlapColor, strengthColor, strengthInWords } from './strength.ts';

/** So many stations have room for their numbers at the rim. */
const MOST_LABELLED = 40;
/** Width of the rim, in cells. */
const RIM_SHARE = 0.07;

interface MatrixProps {
  readonly store: Store;
  readonly counting: Counting;
}

interface Cell {
  readonly row: number;
  readonly column: number;
}

export function Matrix({ store, counting }: MatrixProps) {
  const [cursor, setCursor] = useState<Cell | null>(null);
  const stations = store.shownStations.value;
  const n = stations.length;
  const place = new Map(stations.map(({ id }, i) => [id, i]));
  const linkAt = new Map(store.shownLinks.value.map((link) => [keyOf(place, link.a, link.b), link]));
  const rim = n > MOST_LABELLED ? 0 : RIM_SHARE * n + 0.6;
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
    <div class="matrix">
      <svg
        role="application"
        aria-label="Matrix of overlap and strength of all pairs of stations. Arrow keys move, Enter chooses a pair."
        tabindex={0}
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
          />
        ))}
        {stations.map(({ id }, i) => (
          <rect key={id} class="matrix-diagonal" x={i} y={i} width="1" height="1" />
        ))}
        {rim > 0 && stations.map((station, i) => <Labels key={station.id} station={station} at={i} />)}
        <ChosenCells pair={store.pair.value} place={place} />
        {cursor !== null && <rect class="matrix-cursor" x={cursor.column} y={cursor.row} width="1" height="1" />}
      </svg>
      <p class="muted matrix-words" aria-live="polite">
        {cursor === null || cursor.row === cursor.column
          ? 'Above the diagonal overlap, below it strength. Point at a cell.'
          : inWords(at(cursor), linkAt.get(keyOf(place, ...at(cursor))))}
      </p>
    </div>
  );
}

function keyOf(place: ReadonlyMap<string, number>, a: string, b: string): string {
  const [i, j] = [place.get(a) ?? -1, place.get(b) ?? -1];
  return `${Math.min(i, j)} ${Math.max(i, j)}`;
}

function inWords([a, b]: Pair, link: PlanLink | undefined): string {
  if (link === undefined) return `${a} – ${b}: nothing shared worth listing`;
  const weak = link.weak_axis === '' ? '' : `, ${link.weak_axis}`;
  return `${a} – ${b}: ${percent(link.overlap, 0)} overlap, strength ${strengthInWords(link.strength)}${weak}`;
}

interface CellsProps {
  readonly link: PlanLink;
  readonly place: ReadonlyMap<string, number>;
  readonly counting: Counting;
  readonly isDark: boolean;
}

/** Both cells of a link; what doesn't count is smaller. */
function Cells({ link, place, counting, isDark }: CellsProps) {
  const [a, b] = [place.get(link.a), place.get(link.b)];
  if (a === undefined || b === undefined) return null;
  const [low, high] = [Math.min(a, b), Math.max(a, b)];
  const margin = counts(link, counting) ? 0.04 : 0.28;
  const size = 1 - 2 * margin;
  return (
    <>
      <rect x={high + margin} y={low + margin} width={size} height={size} fill={overlapColor(link.overlap, isDark)} />
      <rect x={low + margin} y={high + margin} width={size} height={size} fill={strengthColor(link.strength, isDark)} />
    </>
  );
}

function Labels({ station, at }: { station: ShownStation; at: number }) {
  return (
    <>
      <text class="matrix-label" x={-0.25} y={at + 0.72} text-anchor="end">
        {station.order}
      </text>
      <text class="matrix-label" x={at + 0.5} y={-0.35} text-anchor="middle">
        {station.order}
      </text>
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

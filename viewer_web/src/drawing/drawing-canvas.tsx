/** The drawing under its walls, doors, windows and rooms, and what is being drawn. */

import { useEffect, useMemo, useRef, useState } from 'preact/hooks';
import type { DrawnOpening, DrawnRoom, DrawnStorey, DrawnWall } from '../api/documents.ts';
import { t } from '../language/language.ts';
import { areaWords, lengthWords } from '../panels/figures.ts';
import { scaleBar } from '../share/scale-bar.ts';
import type { DrawingEditor, DrawnLines } from './editor.ts';
import type { Chosen } from './edits.ts';
import { type Corner, type Corners, distance, straightOf } from './geometry.ts';
import { DrawingPointer, type Hit, type Sizes } from './pointer.ts';
import type { Snapped } from './snap.ts';
import { around, toPage, type ViewBox, zoomed } from './view-box.ts';

interface CanvasProps {
  readonly editor: DrawingEditor;
  readonly view: ViewBox | null;
  readonly setView: (view: ViewBox) => void;
  readonly sizes: Sizes;
  readonly mayChange: boolean;
}

const ring = (corners: Corners): string => `M${corners.map(([x, y]) => `${x} ${y}`).join('L')}Z`;

export function DrawingCanvas({ editor, view, setView, sizes, mayChange }: CanvasProps) {
  const frame = useRef<SVGSVGElement>(null);
  const [hover, setHover] = useState<Snapped | null>(null);
  const latest = useRef({ view, sizes, mayChange });
  latest.current = { view, sizes, mayChange };
  const storey = editor.shown.value?.storeys[editor.storey.value];
  useEffect(() => {
    const box = frame.current?.getBoundingClientRect();
    if (view === null && box !== undefined && storey !== undefined) setView(around(storey, box.width, box.height));
  }, [view, storey]);
  const pointer = useMemo(
    () =>
      new DrawingPointer(
        editor,
        {
          view: () => latest.current.view ?? { perM: 50, x: 0, y: 0 },
          setView,
          sizes: () => latest.current.sizes,
          hover: setHover,
        },
        () => latest.current.mayChange,
      ),
    [editor],
  );
  const at = (event: { clientX: number; clientY: number }): Corner => {
    const box = frame.current?.getBoundingClientRect();
    return [event.clientX - (box?.left ?? 0), event.clientY - (box?.top ?? 0)];
  };
  const shown = view ?? { perM: 50, x: 0, y: 0 };
  const scale = editor.shown.value?.scale ?? 1;
  const tool = editor.tool.value;
  const [rooms, lines] = [editor.rooms.value[editor.storey.value], editor.lines.value.get(editor.storey.value)];
  const chosen = editor.chosen.value;
  // The picture is shifted and zoomed with every move of a pointer: what did not change is not made again for that.
  const still = useMemo(
    () => (
      <>
        <Picture lines={lines} storey={editor.storey.value} scale={scale} />
        <Rooms rooms={rooms ?? []} />
        <Lines lines={lines} scale={scale} />
        {storey?.walls.map((wall) => (
          <Wall key={wall.id} wall={wall} isChosen={isChosen(chosen, 'wall', wall.id)} />
        ))}
        {storey?.openings.map((opening) => (
          <Opening key={opening.id} opening={opening} isChosen={isChosen(chosen, 'opening', opening.id)} />
        ))}
        <Stairs stairs={storey?.stairs ?? []} />
      </>
    ),
    [rooms, lines, scale, storey, chosen, editor.storey.value],
  );
  return (
    <svg
      ref={frame}
      class={tool === 'select' ? 'drawing-canvas' : 'drawing-canvas drawing-aiming'}
      role="application"
      aria-label={t(
        'The drawing with its walls, doors and windows. Drag to shift, scroll to zoom, click a wall or an opening to choose it.',
      )}
      onPointerDown={(event) => {
        event.currentTarget.setPointerCapture(event.pointerId);
        pointer.press(event.pointerId, at(event), hitOf(event.target));
      }}
      onPointerMove={(event) => pointer.move(event.pointerId, at(event))}
      onPointerUp={(event) => pointer.release(event.pointerId, at(event))}
      onPointerCancel={(event) => pointer.cancel(event.pointerId)}
      onPointerLeave={() => setHover(null)}
      onWheel={(event) => {
        event.preventDefault();
        setView(zoomed(shown, Math.exp(-event.deltaY / 500), at(event)));
      }}
    >
      <g transform={`matrix(${shown.perM} 0 0 ${-shown.perM} ${shown.x} ${shown.y})`}>{still}</g>
      <RoomNames rooms={editor.rooms.value[editor.storey.value] ?? []} view={shown} />
      <Ends editor={editor} view={shown} />
      <Furniture northDeg={editor.shown.value?.north_deg ?? null} perM={shown.perM} />
      <Begun editor={editor} view={shown} hover={hover} sizes={sizes} />
    </svg>
  );
}

/** What a pointer went down on, by the marks of the shapes. */
function hitOf(target: EventTarget | null): Hit {
  const data = target instanceof SVGElement ? target.dataset : {};
  const { kind, id, end } = data;
  const chosen = (kind === 'wall' || kind === 'opening') && id !== undefined ? ({ kind, id } as const) : null;
  return { chosen, end: end === 'a' || end === 'b' ? end : null };
}

const isChosen = (chosen: Chosen | null, kind: string, id: string): boolean =>
  chosen?.kind === kind && chosen.id === id;

/** What the drawing was traced in, under its lines. Pictures go down where the plan goes up. */
function Picture({ lines, storey, scale }: { lines: DrawnLines | undefined; storey: number; scale: number }) {
  if (lines === undefined || lines.pictureM === null) return null;
  const [x0, y0, x1, y1] = lines.pictureM;
  return (
    <image
      class="drawing-picture"
      href={`api/drawing/picture/${storey}`}
      x={x0}
      y={-y1}
      width={x1 - x0}
      height={y1 - y0}
      transform={`scale(${scale} ${-scale})`}
      preserveAspectRatio="none"
    />
  );
}

function Lines({ lines, scale }: { lines: DrawnLines | undefined; scale: number }) {
  const path = useMemo(
    () => (lines?.lines ?? []).map((line) => `M${line.map(([x, y]) => `${x} ${y}`).join('L')}`).join(''),
    [lines],
  );
  return (
    <path
      class={lines?.pictureM ? 'drawing-lines drawing-traced' : 'drawing-lines'}
      d={path}
      transform={`scale(${scale})`}
    />
  );
}

function Rooms({ rooms }: { rooms: readonly DrawnRoom[] }) {
  return <path class="drawing-rooms" d={rooms.map(({ outline }) => ring(outline as Corners)).join('')} />;
}

function RoomNames({ rooms, view }: { rooms: readonly DrawnRoom[]; view: ViewBox }) {
  return (
    <g class="drawing-names">
      {rooms.map(({ name, long_name, outline }, row) => {
        const [[x, y], m2] = centreOf(outline as Corners);
        if (view.perM * Math.sqrt(m2) < 56) return null;
        const [px, py] = toPage(view, [x, y]);
        return (
          <text key={row} x={px} y={py}>
            <tspan x={px}>{[name, long_name].filter(Boolean).join(' ')}</tspan>
            <tspan x={px} dy="15">
              {areaWords(m2)}
            </tspan>
          </text>
        );
      })}
    </g>
  );
}

/** Centroid and area. */
function centreOf(outline: Corners): [Corner, number] {
  let [twice, x, y] = [0, 0, 0];
  const [ox, oy] = outline[0];
  outline.forEach((corner, i) => {
    const next = outline[(i + 1) % outline.length];
    const [ax, ay, bx, by] = [corner[0] - ox, corner[1] - oy, next[0] - ox, next[1] - oy];
    const cross = ax * by - bx * ay;
    twice += cross;
    x += cross * (ax + bx);
    y += cross * (ay + by);
  });
  return twice === 0 ? [outline[0], 0] : [[ox + x / (3 * twice), oy + y / (3 * twice)], Math.abs(twice) / 2];
}

function Wall({ wall, isChosen: chosen }: { wall: DrawnWall; isChosen: boolean }) {
  return (
    <path
      class={chosen ? 'drawing-wall drawing-chosen' : 'drawing-wall'}
      data-kind="wall"
      data-id={wall.id}
      d={[wall.outline, ...wall.holes].map((corners) => ring(corners as Corners)).join('')}
    />
  );
}

function Opening({ opening, isChosen: chosen }: { opening: DrawnOpening; isChosen: boolean }) {
  const kind = opening.doubtful ? 'doubtful' : opening.kind;
  return (
    <path
      class={`drawing-opening drawing-${kind}${chosen ? ' drawing-chosen' : ''}`}
      data-kind="opening"
      data-id={opening.id}
      d={ring(opening.corners as Corners)}
    />
  );
}

function Stairs({ stairs }: { stairs: DrawnStorey['stairs'] }) {
  const areas = stairs.map(({ foot: [x, y], along: [u, v], run_m: run, width_m: width }) =>
    ring([
      [x, y],
      [x + run * u, y + run * v],
      [x + run * u - width * v, y + run * v + width * u],
      [x - width * v, y + width * u],
    ]),
  );
  return <path class="drawing-stairs" d={areas.join('')} />;
}

/** A bar of a round length; and where north is, once that is set. */
function Furniture({ northDeg, perM }: { northDeg: number | null; perM: number }) {
  const { lengthPx, words } = scaleBar(1 / perM, 140);
  return (
    <g class="drawing-furniture">
      <path d={`M14 20v6h${lengthPx}v-6`} />
      <text x="14" y="16">
        {words}
      </text>
      {northDeg !== null && (
        <g transform={`translate(30 62) rotate(${northDeg})`} data-testid="drawing-north">
          <path d="M0 18V-18M-6 -8L0 -18L6 -8" />
          <text x="-4" y="-22">
            {t('N')}
          </text>
        </g>
      )}
    </g>
  );
}

/** The ends of a chosen straight wall, to drag. */
function Ends({ editor, view }: { editor: DrawingEditor; view: ViewBox }) {
  const { chosen, shown, storey } = editor;
  if (chosen.value?.kind !== 'wall' || editor.tool.value !== 'select') return null;
  const { id } = chosen.value;
  const wall = shown.value?.storeys[storey.value]?.walls.find((one) => one.id === id);
  const straight = wall === undefined ? null : straightOf(wall.outline as Corners);
  if (straight === null) return null;
  return (
    <g>
      {(['a', 'b'] as const).map((end) => {
        const [x, y] = toPage(view, straight[end]);
        return (
          <g key={end}>
            <circle class="drawing-end" cx={x} cy={y} r="7" />
            <circle class="drawing-grip" data-kind="wall" data-id={id} data-end={end} cx={x} cy={y} r="18" />
          </g>
        );
      })}
    </g>
  );
}

/** Points that were clicked, and where the next one would be. */
function Begun({
  editor,
  view,
  hover,
  sizes,
}: {
  editor: DrawingEditor;
  view: ViewBox;
  hover: Snapped | null;
  sizes: Sizes;
}) {
  const tool = editor.tool.value;
  if (tool === 'select' || tool === 'door' || tool === 'window') return null;
  const points = [...editor.begun.value];
  const isWhole = tool !== 'wall' && points.length === 2;
  if (hover !== null && !isWhole) points.push(hover.at);
  const onPage = points.map((point) => toPage(view, point));
  const [p, q] = onPage;
  return (
    <g class="drawing-begun">
      {p !== undefined && q !== undefined && (
        <>
          <line
            x1={p[0]}
            y1={p[1]}
            x2={q[0]}
            y2={q[1]}
            {...(tool === 'wall'
              ? { style: { strokeWidth: Math.max(2, view.perM * sizes.wallM) }, class: 'drawing-new' }
              : {})}
          />
          {tool !== 'north' && (
            <text x={(p[0] + q[0]) / 2} y={(p[1] + q[1]) / 2 - 10}>
              {lengthWords(distance(points[0], points[1]))}
            </text>
          )}
        </>
      )}
      {onPage.map(([x, y], i) => (
        <circle
          key={i}
          cx={x}
          cy={y}
          r="5"
          {...(hover !== null && i === onPage.length - 1 ? { 'data-snap': hover.kind } : {})}
        />
      ))}
    </g>
  );
}

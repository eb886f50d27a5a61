/** The panorama as one stands in it: a drag turns, the wheel and plus and minus come closer, stations in sight lead to theirs. */
import { useEffect, useRef } from 'preact/hooks';
import { t } from '../language/language.ts';
import type { Store } from '../store.ts';
import type { Direction, PanoramaFrame } from './panorama-image.ts';
import { directionIn, type Look, lookPixels, placeIn, turned } from './panorama-look.ts';

const SIZE = { width: 960, height: 420 };
const KEY_STEP_RAD = Math.PI / 24;
const CLOSER = 0.85;
/** A pointer that went less far, pixels, did not turn but chose. */
const MOST_OF_A_CLICK = 4;
/** A tripod stands in front of what is behind it by as much, and beams beside it count for it. */
const IN_FRONT_M = 0.3;

interface LookAroundProps {
  readonly store: Store;
  readonly look: Look;
  readonly stationId: string;
  readonly panorama: Uint8ClampedArray;
  readonly frame: PanoramaFrame;
  /** How far off a surface is in a direction, metres; 0: no return. */
  readonly rangeIn: (direction: Direction) => number;
  readonly onPoint: (direction: Direction | null) => void;
  readonly onChoose: (direction: Direction) => void;
}

export function LookAround(props: LookAroundProps) {
  const { store, look, stationId, panorama, frame, onPoint, onChoose } = props;
  const canvas = useRef<HTMLCanvasElement>(null);
  const held = useRef<{ x: number; y: number; wentFar: boolean } | null>(null);
  useEffect(() => {
    const pixels = lookPixels(panorama, frame, look, SIZE);
    canvas.current?.getContext('2d')?.putImageData(new ImageData(pixels, SIZE.width, SIZE.height), 0, 0);
  }, [panorama, frame, look]);
  const turn = (leftRad: number, upRad: number, closer = 1): void => {
    store.panoramaLook.value = turned(store.panoramaLook.peek() ?? look, leftRad, upRad, closer);
  };
  /** Pixels of the picture for one of the page. */
  const scale = (): number => SIZE.width / (canvas.current?.getBoundingClientRect().width || SIZE.width);
  const at = (event: PointerEvent): Direction => {
    const box = (event.currentTarget as HTMLElement).getBoundingClientRect();
    return directionIn(look, SIZE, (event.clientX - box.left) * scale(), (event.clientY - box.top) * scale());
  };
  const onKeyDown = (event: KeyboardEvent): void => {
    const steps: Readonly<Record<string, readonly [number, number, number?]>> = {
      ArrowLeft: [KEY_STEP_RAD, 0],
      ArrowRight: [-KEY_STEP_RAD, 0],
      ArrowUp: [0, KEY_STEP_RAD],
      ArrowDown: [0, -KEY_STEP_RAD],
      '+': [0, 0, CLOSER],
      '-': [0, 0, 1 / CLOSER],
    };
    const step = steps[event.key];
    if (step === undefined) return;
    turn(...step);
    event.preventDefault();
    // Elsewhere the arrows choose stations and floors.
    event.stopPropagation();
  };
  return (
    <div class="look-around">
      <canvas
        ref={canvas}
        width={SIZE.width}
        height={SIZE.height}
        tabIndex={0}
        aria-label={t('What station {id} sees. Drag or use the arrow keys to turn, plus and minus to come closer.', {
          id: stationId,
        })}
        onKeyDown={onKeyDown}
        onWheel={(event) => {
          event.preventDefault();
          turn(0, 0, event.deltaY < 0 ? CLOSER : 1 / CLOSER);
        }}
        onPointerDown={(event) => {
          event.currentTarget.setPointerCapture(event.pointerId);
          held.current = { x: event.clientX, y: event.clientY, wentFar: false };
        }}
        onPointerMove={(event) => {
          const from = held.current;
          if (from === null) {
            onPoint(at(event));
            return;
          }
          const [dx, dy] = [event.clientX - from.x, event.clientY - from.y];
          if (!from.wentFar && Math.hypot(dx, dy) < MOST_OF_A_CLICK) return;
          const radARPixel = (look.fieldOfViewRad / SIZE.width) * scale();
          turn(dx * radARPixel, dy * radARPixel);
          held.current = { x: event.clientX, y: event.clientY, wentFar: true };
        }}
        onPointerUp={(event) => {
          if (held.current?.wentFar === false) onChoose(at(event));
          held.current = null;
        }}
        onPointerCancel={() => {
          held.current = null;
        }}
        onPointerLeave={() => onPoint(null)}
      />
      {inSight(props).map(({ id, x, y }) => (
        <button
          key={id}
          type="button"
          class="look-station"
          style={{ left: `${(100 * x) / SIZE.width}%`, top: `${(100 * y) / SIZE.height}%` }}
          aria-label={t('Look around at station {id}', { id })}
          onClick={() => store.chooseStation(id)}
        >
          {id}
        </button>
      ))}
    </div>
  );
}

/** Stations in the picture that no surface hides. */
function inSight({ store, look, stationId, rangeIn }: LookAroundProps) {
  const stations = store.shownStations.value;
  const here = stations.find(({ id }) => id === stationId);
  if (here === undefined) return [];
  return stations.flatMap(({ id, positionM }) => {
    if (id === stationId) return [];
    const [dx, dy, dz] = ([0, 1, 2] as const).map((k) => positionM[k] - here.positionM[k]);
    const place = placeIn(look, SIZE, [dx, dy, dz]);
    if (place === null) return [];
    const rangeM = rangeIn({ azimuthRad: Math.atan2(dy, dx), elevationRad: Math.atan2(dz, Math.hypot(dx, dy)) });
    return rangeM === 0 || rangeM > Math.hypot(dx, dy, dz) - IN_FRONT_M ? [{ id, ...place }] : [];
  });
}

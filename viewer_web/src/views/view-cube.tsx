/** In a corner of the picture: a cube that turns with the camera, whose faces are ways to look at all that is shown. */
import { useSignal } from '@preact/signals';
import { useEffect, useRef } from 'preact/hooks';
import { t } from '../language/language.ts';
import type { PlanJson } from '../load/plan-json.ts';
import { northOf } from '../measure/site.ts';
import { useRoving } from '../panels/roving.ts';
import type { PlanSide } from '../scene/camera.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { CUBE_FACES, type CubeFace, faceTransform, groundTransform, sideName } from './view-cube.ts';
import './view-cube.css';

interface CubeProps {
  readonly store: Store;
  readonly scene: PlanJson['scene'];
  readonly view: PlanView;
}

export function ViewCube(props: CubeProps) {
  const { isPlanView, isFacing, sectionLine, isWalking, hasPicture } = props.store;
  const isFlat = isPlanView.value || (isFacing.value && sectionLine.value !== null);
  return isFlat || isWalking.value || !hasPicture.value ? null : <Cube {...props} />;
}

/** As in the style: from the middle of the cube to a face, and of the ring around its foot. */
const HALF_PX = 21;
const RING_PX = 34;
const [WIDTH_PX, HEIGHT_PX] = [116, 96];

type Face = Exclude<CubeFace['id'], 'bottom'>;
/** As arrow keys go through them. */
const ORDER: readonly Face[] = ['top', '-y', '+x', '+y', '-x'];

function Cube({ scene, view }: CubeProps) {
  const faces = useRef(new Map<string, SVGGElement>());
  const ground = useRef<SVGGElement>(null);
  const buttons = useRef<HTMLDivElement>(null);
  const focused = useSignal<Face | null>(null);
  useRoving(buttons);
  useEffect(
    () =>
      view.onFrame(() => {
        const pose = view.pose();
        ground.current?.setAttribute('transform', groundTransform(pose, HALF_PX));
        for (const face of CUBE_FACES) {
          const drawn = faces.current.get(face.id);
          const transform = faceTransform(face, pose, HALF_PX);
          drawn?.toggleAttribute('hidden', transform === null);
          if (transform !== null) drawn?.setAttribute('transform', transform);
        }
      }),
    [view],
  );
  const north = northOf(scene);
  return (
    <div class="view-cube">
      <svg width={WIDTH_PX} height={HEIGHT_PX} viewBox="-58 -48 116 96" aria-hidden="true">
        <g ref={ground} class="cube-ground">
          <circle r={RING_PX} />
          {north.isGiven && (
            <path d={`M-5 ${-RING_PX}h10l-5 -9z`} transform={`rotate(${(north.rad * 180) / Math.PI})`} />
          )}
        </g>
        {CUBE_FACES.map(({ id }) => (
          // biome-ignore lint/a11y/noStaticElementInteractions: for the pointer alone; the buttons below are for all others.
          <g
            key={id}
            class={`cube-face${id === focused.value ? ' cube-face-focused' : ''}`}
            data-face={id}
            hidden
            ref={(one) => {
              if (one === null) faces.current.delete(id);
              else faces.current.set(id, one);
            }}
            onClick={id === 'bottom' ? undefined : () => view.showAll(id)}
          >
            {id !== 'bottom' && <title>{faceWords(id, scene)}</title>}
            <rect x={-HALF_PX} y={-HALF_PX} width={2 * HALF_PX} height={2 * HALF_PX} />
            {id !== 'bottom' && <text>{id === 'top' ? t('Top') : sideName(id, scene).short}</text>}
          </g>
        ))}
        <Turn name={t('The side to the left')} turnRad={-Math.PI / 2} view={view} />
        <Turn name={t('The side to the right')} turnRad={Math.PI / 2} view={view} />
      </svg>
      {/* The faces for keys and for those who listen: drawn, most are slivers or turned away. */}
      <div class="cube-buttons" role="toolbar" aria-label={t('View cube')} ref={buttons}>
        {ORDER.map((id) => (
          <button
            key={id}
            type="button"
            aria-label={faceWords(id, scene)}
            onClick={() => view.showAll(id)}
            onFocus={({ currentTarget }) => {
              focused.value = currentTarget.matches(':focus-visible') ? id : null;
            }}
            onBlur={() => {
              focused.value = null;
            }}
          />
        ))}
      </div>
      {focused.value !== null && <p class="cube-words">{faceWords(focused.value, scene)}</p>}
    </div>
  );
}

/** Beside the cube, for the sides that are turned away; keys turn the building without it. */
function Turn({ name, turnRad, view }: { name: string; turnRad: number; view: PlanView }) {
  const sign = Math.sign(turnRad);
  return (
    // biome-ignore lint/a11y/noStaticElementInteractions: for the pointer alone, as the faces.
    <g
      class="cube-turn"
      transform={`translate(${49 * sign} 0) scale(${sign} 1)`}
      onClick={() => view.orbit(turnRad, 0)}
    >
      <title>{name}</title>
      <rect x="-9" y="-16" width="18" height="32" />
      <path d="M-2.5 -6L3.5 0L-2.5 6" />
    </g>
  );
}

const faceWords = (id: 'top' | PlanSide, scene: PlanJson['scene']): string =>
  id === 'top' ? t('View from above') : t('View from {side}', { side: sideName(id, scene).name });

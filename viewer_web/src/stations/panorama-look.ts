/** A panorama as the eye has it: what lies one way, straight lines straight. */
import type { Direction, PanoramaFrame } from './panorama-image.ts';

/** Where one looks; the field of view is across the picture. */
export interface Look extends Direction {
  readonly fieldOfViewRad: number;
}

export interface PictureSize {
  readonly width: number;
  readonly height: number;
}

const DEGREE = Math.PI / 180;
const FIRST_FIELD_OF_VIEW_RAD = 90 * DEGREE;
/** What a first look has above and below its middle. */
const HALF_UPRIGHT_RAD = 24 * DEGREE;
const DIRECTIONS_TRIED = 72;
const LEAST_FIELD_OF_VIEW_RAD = 30 * DEGREE;
const LARGEST_FIELD_OF_VIEW_RAD = 120 * DEGREE;
/** Farther up or down, left and right would change places. */
const STEEPEST_RAD = 89 * DEGREE;

const within = (value: number, low: number, high: number): number => Math.min(high, Math.max(low, value));

/** Level as far as the scanner sees enough there, and where the view is longest. */
export function firstLook(frame: PanoramaFrame, rangeM: (direction: Direction) => number): Look {
  const [low, high] = [frame.bottomRad + HALF_UPRIGHT_RAD, frame.topRad - HALF_UPRIGHT_RAD];
  const elevationRad = low > high ? (low + high) / 2 : within(0, low, high);
  let [best, azimuthRad] = [-1, frame.leftRad - frame.spanRad / 2];
  for (let k = 0; k < DIRECTIONS_TRIED; k++) {
    const tried = frame.leftRad - ((k + 0.5) / DIRECTIONS_TRIED) * frame.spanRad;
    const there = rangeM({ azimuthRad: tried, elevationRad });
    if (there > best) [best, azimuthRad] = [there, tried];
  }
  return { azimuthRad, elevationRad, fieldOfViewRad: FIRST_FIELD_OF_VIEW_RAD };
}

/** Turned to the left and up by so much, and closer by a factor below 1. */
export function turned(look: Look, leftRad: number, upRad: number, closer = 1): Look {
  return {
    azimuthRad: look.azimuthRad + leftRad,
    elevationRad: within(look.elevationRad + upRad, -STEEPEST_RAD, STEEPEST_RAD),
    fieldOfViewRad: within(look.fieldOfViewRad * closer, LEAST_FIELD_OF_VIEW_RAD, LARGEST_FIELD_OF_VIEW_RAD),
  };
}

type Vector = readonly [number, number, number];

/** Unit vectors ahead, to the right, and up in the picture; and how much a pixel is, an arm's length of 1 ahead. */
function axesOf({ azimuthRad, elevationRad, fieldOfViewRad }: Look, { width }: PictureSize) {
  const [cos, sin] = [Math.cos(azimuthRad), Math.sin(azimuthRad)];
  const [level, rise] = [Math.cos(elevationRad), Math.sin(elevationRad)];
  const ahead: Vector = [level * cos, level * sin, rise];
  const right: Vector = [sin, -cos, 0];
  const up: Vector = [-rise * cos, -rise * sin, level];
  return { ahead, right, up, pixel: (2 * Math.tan(fieldOfViewRad / 2)) / width };
}

/** Direction of a place in the picture: pixels from its upper left corner. */
export function directionIn(look: Look, size: PictureSize, x: number, y: number): Direction {
  const { ahead, right, up, pixel } = axesOf(look, size);
  const [across, upwards] = [(x - size.width / 2) * pixel, (size.height / 2 - y) * pixel];
  const [dx, dy, dz] = ([0, 1, 2] as const).map((k) => ahead[k] + across * right[k] + upwards * up[k]);
  return { azimuthRad: Math.atan2(dy, dx), elevationRad: Math.atan2(dz, Math.hypot(dx, dy)) };
}

/** Where in the picture something lies that is so far off along the axes; null: not in it. */
export function placeIn(look: Look, size: PictureSize, awayM: Vector): { x: number; y: number } | null {
  const { ahead, right, up, pixel } = axesOf(look, size);
  const along = (axis: Vector): number => axis[0] * awayM[0] + axis[1] * awayM[1] + axis[2] * awayM[2];
  const depth = along(ahead);
  if (depth <= 0) return null;
  const x = size.width / 2 + along(right) / depth / pixel;
  const y = size.height / 2 - along(up) / depth / pixel;
  return x >= 0 && x <= size.width && y >= 0 && y <= size.height ? { x, y } : null;
}

/** The picture, of the panorama's pixels; transparent where that has none. */
export function lookPixels(
  panorama: Uint8ClampedArray,
  frame: PanoramaFrame,
  look: Look,
  size: PictureSize,
): Uint8ClampedArray<ArrayBuffer> {
  const out = new Uint8ClampedArray(4 * size.width * size.height);
  const [from, to] = [new Uint32Array(panorama.buffer), new Uint32Array(out.buffer)];
  const { ahead, right, up, pixel } = axesOf(look, size);
  const columnsARad = frame.width / frame.spanRad;
  const rowsARad = frame.height / (frame.topRad - frame.bottomRad);
  const turn = 2 * Math.PI;
  for (let y = 0; y < size.height; y++) {
    const upwards = (size.height / 2 - y - 0.5) * pixel;
    for (let x = 0; x < size.width; x++) {
      const across = (x + 0.5 - size.width / 2) * pixel;
      const dx = ahead[0] + across * right[0] + upwards * up[0];
      const dy = ahead[1] + across * right[1] + upwards * up[1];
      const dz = ahead[2] + upwards * up[2];
      const turns = (frame.leftRad - Math.atan2(dy, dx)) / turn;
      const column = Math.floor((turns - Math.floor(turns)) * turn * columnsARad);
      const row = Math.floor((frame.topRad - Math.atan2(dz, Math.sqrt(dx * dx + dy * dy))) * rowsARad);
      if (column < frame.width && row >= 0 && row < frame.height) {
        to[y * size.width + x] = from[row * frame.width + column];
      }
    }
  }
  return out;
}

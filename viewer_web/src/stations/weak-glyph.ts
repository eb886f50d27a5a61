/** The motion that a pair's shared surface holds least, as lines: a double arrow along which it slides, a turn about its axis. */
import { Vector3 } from 'three';

/** Half the length of an arrow, and the radius of a turn. */
const SIZE_M = 0.7;
const HEAD_M = 0.2;
const N_ARC = 24;

/** Ends of line segments around `middle`, flat. */
export function weakGlyph(middle: Vector3, axis: readonly [number, number, number], isTurn: boolean): number[] {
  const along = new Vector3(...axis).normalize();
  const u = (Math.abs(along.z) < 0.9 ? new Vector3(0, 0, 1) : new Vector3(1, 0, 0)).cross(along).normalize();
  const v = along.clone().cross(u);
  return isTurn ? turn(middle, along, u, v) : slide(middle, along, u);
}

function slide(middle: Vector3, along: Vector3, side: Vector3): number[] {
  const segments: number[] = [];
  const at = (far: number, aside: number): Vector3 =>
    middle.clone().addScaledVector(along, far).addScaledVector(side, aside);
  const line = (from: Vector3, to: Vector3): void => void segments.push(...from.toArray(), ...to.toArray());
  line(at(-SIZE_M, 0), at(SIZE_M, 0));
  for (const end of [-1, 1]) {
    for (const aside of [-1, 1]) line(at(end * SIZE_M, 0), at(end * (SIZE_M - HEAD_M), aside * HEAD_M * 0.6));
  }
  return segments;
}

function turn(middle: Vector3, along: Vector3, u: Vector3, v: Vector3): number[] {
  const segments: number[] = [];
  const on = (angle: number, radius = SIZE_M * 0.7): Vector3 =>
    middle
      .clone()
      .addScaledVector(u, radius * Math.cos(angle))
      .addScaledVector(v, radius * Math.sin(angle));
  const line = (from: Vector3, to: Vector3): void => void segments.push(...from.toArray(), ...to.toArray());
  const span = 1.7 * Math.PI;
  for (let i = 0; i < N_ARC; i++) line(on((span * i) / N_ARC), on((span * (i + 1)) / N_ARC));
  for (const radius of [SIZE_M * 0.5, SIZE_M * 0.9]) line(on(span), on(span - 0.3, radius));
  line(middle.clone().addScaledVector(along, -SIZE_M), middle.clone().addScaledVector(along, SIZE_M));
  return segments;
}

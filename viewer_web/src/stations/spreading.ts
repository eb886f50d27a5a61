/**
 * Numbers that would cover each other are moved aside, as on good maps: each to a place of its own near its station, with a
 * line back to where the station is.
 *
 * Every number is drawn to its station and pushed off the others until none touches. It begins where the last picture left
 * it, so that a number stays on its side of another while the camera moves; a fresh start takes over where it is much nearer.
 */

export interface Numbered {
  readonly id: string;
  /** Where the station is, in CSS pixels. */
  readonly x: number;
  readonly y: number;
  /** Its number stays where it is, and the others make room. */
  readonly isPinned: boolean;
}

/** From the station to the middle of its number, CSS pixels. */
export interface Offset {
  readonly x: number;
  readonly y: number;
}

/** Two numbers read well at this distance side by side, and one above the other. */
export const APART_X = 31;
export const APART_Y = 26;
/** Vertical distances count as more, so that one distance does for both. */
const UPRIGHT = APART_X / APART_Y;
/** Farther off than this, stations have nothing to do with each other. */
const REACH = 5 * APART_X;

const STEPS = 50;
const PULL = 0.12;
const MOST_CLEARING_STEPS = 200;
/** Numbers may come this much nearer to each other: what is left of the last push. */
const SLACK = 0.2;
/** A fresh start is taken where the squares of its offsets are less than this share of those that were kept. */
const CLEARLY_LESS = 0.3;
/** Of stations at one spot each sets out another way. */
const GOLDEN_ANGLE_RAD = 2.399963;
export const NOWHERE: Offset = { x: 0, y: 0 };

/** Keeps where numbers are from picture to picture. */
export class Spreader {
  private last: ReadonlyMap<string, Offset> = new Map();

  /** Offsets of the numbers, by id. */
  offsets(numbers: readonly Numbered[]): ReadonlyMap<string, Offset> {
    const pairs = nearPairs(numbers);
    const touches = pairs.some(([i, j]) => distance(numbers[i], numbers[j]) < APART_X);
    this.last = touches ? this.spread(numbers, pairs) : new Map(numbers.map(({ id }) => [id, NOWHERE]));
    return this.last;
  }

  private spread(numbers: readonly Numbered[], pairs: readonly Pair[]): ReadonlyMap<string, Offset> {
    const kept = relaxed(numbers, pairs, (id) => this.last.get(id) ?? NOWHERE);
    const fresh = relaxed(numbers, pairs, () => NOWHERE);
    const best = lengthOf(fresh) < CLEARLY_LESS * lengthOf(kept) ? fresh : kept;
    return new Map(numbers.map(({ id }, i) => [id, best[i]]));
  }
}

type Pair = readonly [number, number];

function nearPairs(numbers: readonly Numbered[]): Pair[] {
  const pairs: Pair[] = [];
  for (let i = 0; i < numbers.length; i++) {
    for (let j = i + 1; j < numbers.length; j++) {
      if (distance(numbers[i], numbers[j]) < REACH) pairs.push([i, j]);
    }
  }
  return pairs;
}

function distance(a: Offset, b: Offset): number {
  return lengthAsBox(a.x - b.x, UPRIGHT * (a.y - b.y));
}

/** Nearly the larger of the two, without its corners: numbers are boxes, and diagonally a circle would let them overlap. */
function lengthAsBox(dx: number, dy: number): number {
  const [x2, y2] = [dx * dx, dy * dy];
  return (x2 ** 8 + y2 ** 8) ** (1 / 16);
}

function lengthOf(offsets: readonly Offset[]): number {
  return offsets.reduce((sum, { x, y }) => sum + x * x + y * y, 0);
}

/** Offsets of all numbers, which set out from `start`. */
function relaxed(numbers: readonly Numbered[], pairs: readonly Pair[], start: (id: string) => Offset): Offset[] {
  const places = new Places(numbers, start);
  for (let step = 0; step < STEPS; step++) {
    places.pull();
    for (const [i, j] of pairs) places.push(i, j);
  }
  for (let step = 0, isClear = false; step < MOST_CLEARING_STEPS && !isClear; step++) {
    isClear = true;
    for (const [i, j] of pairs) if (places.push(i, j)) isClear = false;
  }
  return places.offsets();
}

/** Where numbers are, with vertical distances as `UPRIGHT` has them. */
class Places {
  private readonly x: Float64Array;
  private readonly y: Float64Array;

  constructor(
    private readonly numbers: readonly Numbered[],
    start: (id: string) => Offset,
  ) {
    const from = numbers.map(({ id, isPinned }) => (isPinned ? NOWHERE : start(id)));
    this.x = Float64Array.from(numbers, (number, i) => number.x + from[i].x);
    this.y = Float64Array.from(numbers, (number, i) => UPRIGHT * (number.y + from[i].y));
  }

  pull(): void {
    for (const [i, { x, y }] of this.numbers.entries()) {
      this.x[i] += PULL * (x - this.x[i]);
      this.y[i] += PULL * (UPRIGHT * y - this.y[i]);
    }
  }

  /** Whether the two were too near. */
  push(i: number, j: number): boolean {
    let [dx, dy] = [this.x[j] - this.x[i], this.y[j] - this.y[i]];
    let far = lengthAsBox(dx, dy);
    const lacking = APART_X - far;
    const [isHeldI, isHeldJ] = [this.numbers[i].isPinned, this.numbers[j].isPinned];
    if (lacking <= SLACK || (isHeldI && isHeldJ)) return false;
    if (far < 1e-3) {
      [dx, dy, far] = [Math.cos(GOLDEN_ANGLE_RAD * j), Math.sin(GOLDEN_ANGLE_RAD * j), 1];
    }
    const shareI = isHeldI ? 0 : isHeldJ ? 1 : 0.5;
    const [moveX, moveY] = [(lacking * dx) / far, (lacking * dy) / far];
    this.x[i] -= shareI * moveX;
    this.y[i] -= shareI * moveY;
    this.x[j] += (1 - shareI) * moveX;
    this.y[j] += (1 - shareI) * moveY;
    return true;
  }

  offsets(): Offset[] {
    return this.numbers.map(({ x, y }, i) => ({ x: this.x[i] - x, y: this.y[i] / UPRIGHT - y }));
  }
}

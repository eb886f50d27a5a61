/** Walk-through: while it is on, keys and drags move a person through the building in place of the camera around it. */
import { type ReadonlySignal, signal } from '@preact/signals';
import { isKeyOn } from '../panels/character-keys.ts';
import type { Pointer } from '../scene/pointer.ts';
import type { Store } from '../store.ts';
import {
  DEFAULT_EYE_HEIGHT_M,
  standing,
  standingOnMap,
  step,
  targetOf,
  turned,
  type WalkInput,
  type WalkPose,
  type WalkWorld,
} from './walker.ts';

/** Of heading a pixel of a drag: a drag over half a screen turns about a quarter. */
const RAD_A_PIXEL = 0.004;
/** No eye is higher above the ground. */
const TALLEST_M = 5;
/** Feet are so near to what they stand on. */
const FEET_M = 0.1;
/** After a pause of the page nobody has gone far. */
const LONGEST_STEP_S = 0.1;

type Move = 'forward' | 'back' | 'left' | 'right' | 'turnLeft' | 'turnRight';

const KEYS: Readonly<Record<string, Move>> = {
  w: 'forward',
  arrowup: 'forward',
  s: 'back',
  arrowdown: 'back',
  a: 'left',
  d: 'right',
  q: 'turnLeft',
  arrowleft: 'turnLeft',
  e: 'turnRight',
  arrowright: 'turnRight',
};

export type { Move };

/** What the mode needs of the 3D view. */
export interface WalkStage {
  readonly world: WalkWorld;
  readonly pointer: Pointer;
  /** The ground under a place of the page, local metres; null: none. */
  groundAt(clientX: number, clientY: number): readonly [number, number, number] | null;
  /** Put the camera: position and target. */
  place(pose: readonly number[]): void;
  holdCamera(isHeld: boolean): void;
  /** Tell what is under a place of the page. */
  pick(clientX: number, clientY: number): void;
  /** The walk is over. */
  left(): void;
}

export class WalkMode {
  private readonly pose = signal<WalkPose | null>(null);
  private readonly pressed = new Set<Move>();
  private isFast = false;
  private last: number | null = null;
  private ending = new AbortController();
  private stopPointer: () => void = () => undefined;

  constructor(
    private readonly store: Store,
    private readonly stage: WalkStage,
  ) {}

  /** Begin at a place, looking along a heading, where there is a picture to look at. */
  enter(eyeM: readonly [number, number, number], headingRad: number, eyeHeightM = DEFAULT_EYE_HEIGHT_M): void {
    this.end();
    if (!this.store.hasPicture.peek()) return;
    this.store.isWalking.value = true;
    this.stage.holdCamera(true);
    this.ending = new AbortController();
    const { signal: ended } = this.ending;
    // Before the page's own keys.
    const options = { signal: ended, capture: true };
    window.addEventListener('keydown', (event) => this.key(event, true), options);
    window.addEventListener('keyup', (event) => this.key(event, false), options);
    window.addEventListener('blur', () => this.pressed.clear(), { signal: ended });
    this.stopPointer = this.stage.pointer.add(this.dragToLook());
    this.show({ eyeM, headingRad, pitchRad: 0, eyeHeightM });
  }

  /** Begin where a camera is: position and target. */
  enterAt([x, y, z, ...target]: readonly number[]): void {
    const [dx, dy, dz] = [target[0] - x, target[1] - y, target[2] - z];
    const ground = this.stage.world.groundBelow(x, y, z, TALLEST_M);
    this.enter([x, y, z], Math.atan2(dy, dx), ground === null ? undefined : z - ground);
    const pose = this.pose.peek();
    if (pose !== null) this.show(turned(pose, 0, Math.atan2(dz, Math.hypot(dx, dy))));
  }

  /** Go back to the camera around the building. */
  leave(): void {
    if (this.pose.peek() === null) return;
    this.end();
    this.stage.left();
  }

  /** Stop walking; the camera stays for who wants it. */
  end(): void {
    if (this.pose.peek() === null) return;
    this.ending.abort();
    this.stopPointer();
    this.pressed.clear();
    this.pose.value = null;
    this.stage.holdCamera(false);
    this.store.isWalking.value = false;
  }

  /** A button of the page that is held down, or a key. */
  hold(move: Move, isHeld: boolean): void {
    if (isHeld) this.pressed.add(move);
    else this.pressed.delete(move);
    if (this.pressed.size > 0 && this.last === null) this.run();
  }

  /** Where one stands and how one looks; null: nobody walks. */
  get where(): ReadonlySignal<WalkPose | null> {
    return this.pose;
  }

  /** The floor whose ground is below one's feet; null: none's is. */
  floorBelow({ eyeM: [x, y, z], eyeHeightM }: WalkPose): string | null {
    return this.stage.world.floorBelow(x, y, z, eyeHeightM + FEET_M)?.floorId ?? null;
  }

  /** Stand at a place of the map of a floor whose ground is `floorM` high; false: nobody can. */
  goOnMap(x: number, y: number, floorM: number): boolean {
    const pose = this.pose.peek();
    const there = pose && standingOnMap(pose, x, y, floorM, this.stage.world);
    if (there) this.show(there);
    return there !== null;
  }

  /** Height of the eye above the ground. */
  get eyeHeightM(): number {
    return this.pose.value?.eyeHeightM ?? DEFAULT_EYE_HEIGHT_M;
  }

  set eyeHeightM(eyeHeightM: number) {
    const pose = this.pose.peek();
    if (pose === null) return;
    const [x, y, z] = pose.eyeM;
    this.show({ ...pose, eyeHeightM, eyeM: [x, y, z - pose.eyeHeightM + eyeHeightM] });
  }

  dispose(): void {
    this.end();
  }

  private key(event: KeyboardEvent, isDown: boolean): void {
    const isTyping = event.target instanceof HTMLInputElement || event.target instanceof HTMLSelectElement;
    if (isTyping || event.ctrlKey || event.metaKey || event.altKey || (isDown && !isKeyOn(event.key))) return;
    this.isFast = event.shiftKey;
    const move = KEYS[event.key.toLowerCase()];
    if (move !== undefined) this.hold(move, isDown);
    else if (event.key === 'Escape' && isDown) this.leave();
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  private dragToLook() {
    let from: { x: number; y: number } | null = null;
    return {
      onDown: ({
        clientX: x,
        clientY: y,
        stationId,
      }: {
        clientX: number;
        clientY: number;
        stationId: string | null;
      }) => {
        if (stationId !== null) return false;
        from = { x, y };
        return true;
      },
      onMove: ({ clientX: x, clientY: y }: { clientX: number; clientY: number }) => {
        const pose = this.pose.peek();
        if (pose === null || from === null) return;
        this.show(turned(pose, (x - from.x) * RAD_A_PIXEL, (y - from.y) * RAD_A_PIXEL));
        from = { x, y };
      },
      onUp: ({ clientX, clientY }: { clientX: number; clientY: number }, isClick: boolean) => {
        if (isClick) this.goTo(clientX, clientY);
        // The camera stays ours after the drag.
        queueMicrotask(() => this.stage.holdCamera(this.pose.peek() !== null));
      },
    };
  }

  /** A click on ground goes there; on anything else it tells what that is. */
  private goTo(clientX: number, clientY: number): void {
    const [pose, place] = [this.pose.peek(), this.stage.groundAt(clientX, clientY)];
    if (pose === null) return;
    if (place === null) {
      this.stage.pick(clientX, clientY);
      return;
    }
    const [x, y, z] = place;
    const there = standing({ ...pose, eyeM: [x, y, z + pose.eyeHeightM] }, x, y, this.stage.world);
    if (there !== null) this.show(there);
  }

  private run(): void {
    requestAnimationFrame((now) => {
      const pose = this.pose.peek();
      if (pose === null || this.pressed.size === 0) {
        this.last = null;
        return;
      }
      const seconds = this.last === null ? 0 : Math.min(LONGEST_STEP_S, (now - this.last) / 1000);
      this.last = now;
      this.show(step(pose, this.input(), seconds, this.stage.world));
      this.run();
    });
  }

  private input(): WalkInput {
    const amount = (plus: Move, minus: Move): number =>
      Number(this.pressed.has(plus)) - Number(this.pressed.has(minus));
    return {
      forward: amount('forward', 'back'),
      right: amount('right', 'left'),
      turn: amount('turnLeft', 'turnRight'),
      isFast: this.isFast,
    };
  }

  private show(pose: WalkPose): void {
    this.pose.value = pose;
    const camera = [...pose.eyeM, ...targetOf(pose)];
    this.stage.place(camera);
    this.store.camera.value = camera;
  }
}

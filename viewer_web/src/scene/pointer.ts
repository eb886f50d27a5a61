/**
 * Who gets what the pointer does: consumers such as the dragging of stations before the camera and before clicks.
 *
 * A press on the canvas or on a marker is offered to the consumers, latest first. Who takes it gets the drag until the
 * pointer is released; the camera stands still meanwhile. A press that nobody takes turns the camera, or is a click. So does
 * one on a marker that moves, and a second finger makes both the camera's: numbers of stations are no holes in the building.
 */

/** A press that moves further than this is a drag, not a click. */
const CLICK_PIXELS = 5;

export interface PointerPlace {
  /** Of the pointer; of a drag of a station, where the station is dragged to. */
  readonly clientX: number;
  readonly clientY: number;
  /** The marker that was pressed; null: the canvas. */
  readonly stationId: string | null;
  readonly event: PointerEvent;
}

export interface PointerConsumer {
  /** Pressed; true takes the drag. */
  onDown?(place: PointerPlace): boolean;
  /** Of a drag that was taken. */
  onMove?(place: PointerPlace): void;
  /** The drag ends here; `isClick` where it hardly moved. */
  onUp?(place: PointerPlace, isClick: boolean): void;
  /** The browser took the drag away: undo it. */
  onCancel?(): void;
  /** Moved over the canvas with nothing pressed. */
  onHover?(place: PointerPlace): void;
  /** Clicked on the canvas, nobody having taken the press; true: nothing else happens. */
  onClick?(place: PointerPlace): boolean;
}

/** How far from what is dragged the pointer took hold of it: it stays so far off. */
export interface Grip {
  readonly x: number;
  readonly y: number;
}

const AT_ITSELF: Grip = { x: 0, y: 0 };

interface Press {
  readonly x: number;
  readonly y: number;
  readonly pointerId: number;
  readonly stationId: string | null;
  readonly grip: Grip;
  readonly taker: PointerConsumer | null;
  readonly event: PointerEvent;
  hasMoved: boolean;
  /** Began on a marker, and turns the camera all the same. */
  readonly isCameras: boolean;
}

export class Pointer {
  private readonly consumers: PointerConsumer[] = [];
  private readonly listening = new AbortController();
  private press: Press | null = null;
  private isHandingOver = false;

  /** `onClick`: what a click means that no consumer wants. `onTaken`: whether a drag is under way that the camera must not follow. */
  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly onClick: (clientX: number, clientY: number) => void,
    private readonly onTaken: (isTaken: boolean) => void,
  ) {
    const { signal } = this.listening;
    window.addEventListener('pointerdown', (event) => this.join(event), { signal, capture: true });
    // In the capture phase: before the camera's controls, which listen to the same element.
    canvas.addEventListener('pointerdown', (event) => this.down(event, null), { signal, capture: true });
    canvas.addEventListener('pointermove', (event) => this.hover(event), { signal });
    window.addEventListener('pointermove', (event) => this.move(event), { signal });
    window.addEventListener('pointerup', (event) => this.up(event), { signal });
    window.addEventListener('pointercancel', (event) => this.cancel(event), { signal });
  }

  /** Returns what takes the consumer away again. */
  add(consumer: PointerConsumer): () => void {
    this.consumers.unshift(consumer);
    return () => {
      const at = this.consumers.indexOf(consumer);
      if (at >= 0) this.consumers.splice(at, 1);
    };
  }

  /** Pressed on the canvas, or on the marker of a station. */
  down(event: PointerEvent, stationId: string | null, grip: Grip = AT_ITSELF): void {
    if (this.isHandingOver || !event.isPrimary || event.button !== 0) return;
    const place = placeOf(event, stationId, grip);
    const taker = this.consumers.find((consumer) => consumer.onDown?.(place)) ?? null;
    const { clientX: x, clientY: y, pointerId } = event;
    this.press = { x, y, pointerId, stationId, grip, taker, event, hasMoved: false, isCameras: false };
    if (taker !== null) this.onTaken(true);
  }

  dispose(): void {
    this.listening.abort();
  }

  private hover(event: PointerEvent): void {
    if (this.press !== null || event.buttons !== 0) return;
    for (const consumer of this.consumers) consumer.onHover?.(placeOf(event, null, AT_ITSELF));
  }

  private move(event: PointerEvent): void {
    const { press } = this;
    if (press === null || press.pointerId !== event.pointerId) return;
    press.hasMoved ||= Math.hypot(event.clientX - press.x, event.clientY - press.y) > CLICK_PIXELS;
    if (!press.hasMoved) return;
    press.taker?.onMove?.(placeOf(event, press.stationId, press.grip));
    if (press.taker === null && press.stationId !== null) this.giveToCamera(press);
  }

  /** Another finger: what the first one drags goes back, and the camera follows both. */
  private join(event: PointerEvent): void {
    const { press } = this;
    if (this.isHandingOver || event.isPrimary || event.pointerType !== 'touch' || press === null) return;
    if (press.stationId !== null) {
      press.taker?.onCancel?.();
      if (press.taker !== null) this.onTaken(false);
      press.hasMoved = true;
      this.giveToCamera(press);
    } else if (press.taker !== null) return;
    if (event.target !== this.canvas) this.handOver(event);
  }

  private giveToCamera(press: Press): void {
    if (press.isCameras) return;
    this.press = { ...press, taker: null, isCameras: true };
    this.handOver(press.event);
  }

  /** The camera gets a press that was on a marker. */
  private handOver(event: PointerEvent): void {
    this.isHandingOver = true;
    this.canvas.dispatchEvent(new PointerEvent('pointerdown', event));
    this.isHandingOver = false;
  }

  private up(event: PointerEvent): void {
    const { press } = this;
    if (press === null || press.pointerId !== event.pointerId) return;
    this.press = null;
    const place = placeOf(event, press.stationId, press.grip);
    if (press.taker !== null) {
      if (press.hasMoved) swallowClick();
      press.taker.onUp?.(place, !press.hasMoved);
      this.onTaken(false);
    } else if (press.isCameras) swallowClick();
    else if (!press.hasMoved && press.stationId === null && event.target === this.canvas) {
      const isWanted = this.consumers.some((consumer) => consumer.onClick?.(place));
      if (!isWanted) this.onClick(event.clientX, event.clientY);
    }
  }

  private cancel(event: PointerEvent): void {
    const { press } = this;
    if (press === null || press.pointerId !== event.pointerId) return;
    this.press = null;
    if (press.taker === null) return;
    press.taker.onCancel?.();
    this.onTaken(false);
  }
}

/** The browser makes a click of a drag that begins and ends on one button. */
function swallowClick(): void {
  const stop = (event: Event): void => {
    event.stopPropagation();
    event.preventDefault();
  };
  const over = new AbortController();
  window.addEventListener('click', stop, { capture: true, once: true, signal: over.signal });
  setTimeout(() => over.abort());
}

function placeOf(event: PointerEvent, stationId: string | null, grip: Grip): PointerPlace {
  return { clientX: event.clientX - grip.x, clientY: event.clientY - grip.y, stationId, event };
}

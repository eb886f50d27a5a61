/**
 * Who gets what the pointer does: consumers such as the dragging of stations before the camera and before clicks.
 *
 * A press on the canvas or on a marker is offered to the consumers, latest first. Who takes it gets the drag until the
 * pointer is released; the camera stands still meanwhile. A press that nobody takes turns the camera, or is a click.
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
  hasMoved: boolean;
}

export class Pointer {
  private readonly consumers: PointerConsumer[] = [];
  private readonly listening = new AbortController();
  private press: Press | null = null;

  /** `onClick`: what a click means that no consumer wants. `onTaken`: whether a drag is under way that the camera must not follow. */
  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly onClick: (clientX: number, clientY: number) => void,
    private readonly onTaken: (isTaken: boolean) => void,
  ) {
    const { signal } = this.listening;
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
    if (!event.isPrimary || event.button !== 0) return;
    const place = placeOf(event, stationId, grip);
    const taker = this.consumers.find((consumer) => consumer.onDown?.(place)) ?? null;
    const { clientX: x, clientY: y, pointerId } = event;
    this.press = { x, y, pointerId, stationId, grip, taker, hasMoved: false };
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
    if (press.hasMoved) press.taker?.onMove?.(placeOf(event, press.stationId, press.grip));
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
    } else if (!press.hasMoved && press.stationId === null && event.target === this.canvas) {
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

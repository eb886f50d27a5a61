/** What pointers do on the drawing: choose, drag, draw by points, shift the picture with one and zoom it with two. */
import type { Drawn } from '../api/documents.ts';
import { t } from '../language/language.ts';
import type { DrawingEditor } from './editor.ts';
import {
  addOpening,
  addWall,
  type Chosen,
  middleOf,
  placeOpening,
  reshapeWall,
  shiftWall,
  withNorth,
} from './edits.ts';
import {
  type Corner,
  direction,
  distance,
  dot,
  leftOf,
  minus,
  plus,
  rounded,
  type Straight,
  straightOf,
} from './geometry.ts';
import { type Snapped, snapped } from './snap.ts';
import { toPlan, type ViewBox, zoomed } from './view-box.ts';

/** What a finger covers, and a click may miss. */
const SNAP_PX = 12;
const STILL_PX = 4;

/** What is under a pointer; `end`: an end of a chosen straight wall. */
export interface Hit {
  readonly chosen: Chosen | null;
  readonly end: 'a' | 'b' | null;
}

interface Drag {
  readonly hit: Hit;
  readonly fromPage: Corner;
  readonly fromPlan: Corner;
  readonly view: ViewBox;
  isMoving: boolean;
}

export interface Sizes {
  readonly wallM: number;
  readonly doorM: number;
  readonly windowM: number;
}

export class DrawingPointer {
  private readonly down = new Map<number, Corner>();
  private drag: Drag | null = null;
  private pinch: { readonly apart: number; readonly middle: Corner; readonly view: ViewBox } | null = null;

  constructor(
    private readonly editor: DrawingEditor,
    private readonly look: {
      readonly view: () => ViewBox;
      readonly setView: (view: ViewBox) => void;
      readonly sizes: () => Sizes;
      readonly hover: (at: Snapped | null) => void;
    },
    private readonly mayChange: () => boolean,
  ) {}

  press(id: number, at: Corner, hit: Hit): void {
    this.down.set(id, at);
    if (this.down.size === 2) {
      const [p, q] = [...this.down.values()];
      this.editor.dragged.value = null;
      this.drag = null;
      this.pinch = { apart: distance(p, q), middle: middle(p, q), view: this.look.view() };
      return;
    }
    const view = this.look.view();
    this.drag = { hit, fromPage: at, fromPlan: toPlan(view, at), view, isMoving: false };
  }

  move(id: number, at: Corner): void {
    if (this.down.has(id)) this.down.set(id, at);
    if (this.pinch !== null && this.down.size === 2) {
      const [p, q] = [...this.down.values()];
      const { apart, middle: from, view } = this.pinch;
      const by = zoomed(view, distance(p, q) / Math.max(apart, 1), from);
      const to = middle(p, q);
      this.look.setView({ ...by, x: by.x + to[0] - from[0], y: by.y + to[1] - from[1] });
      return;
    }
    const { drag } = this;
    if (drag === null) {
      if (this.editor.tool.peek() !== 'select') this.look.hover(this.pointAt(at));
      return;
    }
    if (!drag.isMoving && distance(at, drag.fromPage) < STILL_PX) return;
    drag.isMoving = true;
    const { chosen } = drag.hit;
    const drags = this.editor.tool.peek() === 'select' && chosen !== null && this.isChosen(chosen) && this.mayChange();
    if (drags) this.editor.dragged.value = this.dragged(drag, at);
    else
      this.look.setView({
        ...drag.view,
        x: drag.view.x + at[0] - drag.fromPage[0],
        y: drag.view.y + at[1] - drag.fromPage[1],
      });
  }

  release(id: number, at: Corner): void {
    this.down.delete(id);
    if (this.pinch !== null) {
      if (this.down.size === 0) this.pinch = null;
      return;
    }
    const { drag } = this;
    this.drag = null;
    if (drag === null) return;
    const { dragged } = this.editor;
    if (!drag.isMoving) this.click(at, drag.hit);
    else if (dragged.peek() !== null) this.editor.change(dragged.peek() as Drawn);
  }

  /** The pointer is lost, as where the system takes it: nothing was meant. */
  cancel(id: number): void {
    this.down.delete(id);
    this.drag = null;
    if (this.down.size === 0) this.pinch = null;
    this.editor.dragged.value = null;
  }

  private isChosen({ kind, id }: Chosen): boolean {
    const chosen = this.editor.chosen.peek();
    return chosen !== null && chosen.kind === kind && chosen.id === id;
  }

  private click(at: Corner, hit: Hit): void {
    const { editor } = this;
    const tool = editor.tool.peek();
    const drawn = editor.drawn.peek();
    if (drawn === null) return;
    if (tool === 'select') {
      editor.chosen.value = hit.chosen;
      return;
    }
    if (!this.mayChange()) return;
    const plan = toPlan(this.look.view(), at);
    if (tool === 'door' || tool === 'window') {
      const widthM = tool === 'door' ? this.look.sizes().doorM : this.look.sizes().windowM;
      const made = addOpening(drawn, editor.storey.peek(), tool, plan, widthM, this.withinM());
      this.take(made, 'opening', t('Click a straight wall that is at least as long as this is wide.'));
      return;
    }
    const point = this.pointAt(at).at;
    const begun = [...editor.begun.peek(), point];
    if (tool === 'wall' && begun.length === 2) {
      const made = addWall(drawn, editor.storey.peek(), straightTo(begun, this.look.sizes().wallM));
      this.take(made, 'wall', t('Click two points that are apart.'));
      // The next wall begins where this one ends.
      if (made !== null) editor.begun.value = [point];
    } else if (tool === 'north' && begun.length === 2) {
      const turned = withNorth(drawn, begun[0], begun[1]);
      if (turned === null) editor.message.value = t('Click two points that are apart.');
      else editor.change(turned);
      editor.begun.value = [];
      editor.tool.value = 'select';
    } else editor.begun.value = begun.length > 2 ? [point] : begun;
  }

  private take(made: { drawn: Drawn; id: string } | null, kind: Chosen['kind'], otherwise: string): void {
    if (made === null) {
      this.editor.message.value = otherwise;
      return;
    }
    this.editor.change(made.drawn);
    this.editor.chosen.value = { kind, id: made.id };
  }

  private withinM(): number {
    return SNAP_PX / this.look.view().perM;
  }

  /** Where a click at a point of the page is in the plan. */
  private pointAt(at: Corner): Snapped {
    const plan = toPlan(this.look.view(), at);
    const isDirection = this.editor.tool.peek() === 'north';
    return this.snap(plan, this.editor.begun.peek().at(-1) ?? null, isDirection ? null : undefined);
  }

  private snap(
    at: Corner,
    from: Corner | null,
    without: string | null | undefined,
    along: Corner | null = null,
  ): Snapped {
    const { editor } = this;
    const drawn = editor.drawn.peek();
    const storey = drawn?.storeys[editor.storey.peek()];
    const axes = (storey?.walls ?? []).flatMap(({ id, outline }) => {
      // Lengths are known of faces of walls, not of their middle.
      if (editor.tool.peek() === 'scale') return outline.map((p, i) => [p, outline[(i + 1) % outline.length]] as const);
      const straight = id === without ? null : straightOf(outline);
      return straight === null ? [] : [[straight.a, straight.b] as const];
    });
    const scale = drawn?.scale ?? 1;
    const lines = editor.lines.peek().get(editor.storey.peek())?.index ?? null;
    if (scale === 1 || lines === null) return snapped(at, { axes, lines, from, along, withinM: this.withinM() });
    // Lines are kept as recognised: the point is brought there and back.
    const down = ([x, y]: Corner): Corner => [x / scale, y / scale];
    const found = snapped(down(at), {
      axes: axes.map(([a, b]) => [down(a), down(b)] as const),
      lines,
      from: from === null ? null : down(from),
      along,
      withinM: this.withinM() / scale,
    });
    return { ...found, at: [found.at[0] * scale, found.at[1] * scale] };
  }

  private dragged({ hit, fromPlan }: Drag, at: Corner): Drawn | null {
    const { editor } = this;
    const [drawn, number] = [editor.drawn.peek(), editor.storey.peek()];
    const { chosen, end } = hit;
    if (drawn === null || chosen === null) return null;
    const to = toPlan(this.look.view(), at);
    const storey = drawn.storeys[number];
    if (chosen.kind === 'opening') {
      const opening = storey.openings.find(({ id }) => id === chosen.id);
      if (opening === undefined) return null;
      return placeOpening(drawn, number, chosen.id, plus(middleOf(opening.corners), minus(to, fromPlan)));
    }
    const wall = storey.walls.find(({ id }) => id === chosen.id);
    if (wall === undefined) return null;
    const straight = straightOf(wall.outline);
    if (straight === null) return shiftWall(drawn, number, chosen.id, minus(to, fromPlan));
    if (end === null) return shiftWall(drawn, number, chosen.id, sideways(straight, minus(to, fromPlan)));
    const fixed = end === 'a' ? straight.b : straight.a;
    const point = this.snap(to, fixed, chosen.id, direction(straight.a, straight.b)).at;
    return reshapeWall(drawn, number, chosen.id, { ...straight, [end]: point });
  }
}

const middle = (p: Corner, q: Corner): Corner => [(p[0] + q[0]) / 2, (p[1] + q[1]) / 2];

const straightTo = ([a, b]: readonly Corner[], thicknessM: number): Straight => ({
  a: rounded(a),
  b: rounded(b),
  thicknessM,
});

/** A shift across a wall or along it, whichever is more, by whole centimetres. */
function sideways({ a, b }: Straight, by: Corner): Corner {
  const along = direction(a, b) ?? [1, 0];
  const across = leftOf(along);
  const [m, n] = [dot(by, along), dot(by, across)];
  const [way, size] = Math.abs(n) >= Math.abs(m) ? [across, n] : [along, m];
  return plus([0, 0], way, Math.round(100 * size) / 100);
}

/** Numbers beside what lies over the picture: partly under a card, a number is hard to hit and reads as another one. */
import { NOWHERE, type Offset } from './spreading.ts';

export interface Box {
  readonly left: number;
  readonly top: number;
  readonly right: number;
  readonly bottom: number;
}

/** What covers numbers: buttons, panels and cards, not the empty room between them. */
const PANELS = '.toolbar > :not(.tip), .site-tools > *, .corner > *, .cards, .view-cube, .walk-map';
/** From the middle of a number to what lies over the picture, CSS pixels. */
export const ROOM_X = 16;
export const ROOM_Y = 13;

/** Where panels lie over the picture, from its upper left corner. */
export function panelsOver(layer: HTMLElement): Box[] {
  const { left, top } = layer.getBoundingClientRect();
  return [...(layer.parentElement?.querySelectorAll(PANELS) ?? [])]
    .map((panel) => panel.getBoundingClientRect())
    .filter(({ width, height }) => width > 0 && height > 0)
    .map((box) => ({
      left: box.left - left,
      top: box.top - top,
      right: box.right - left,
      bottom: box.bottom - top,
    }));
}

/** How much of a number panels cover. */
export function coverByPanels({ x, y }: Offset, panels: readonly Box[]): 'none' | 'part' | 'whole' {
  const reaches = panels.map((box) => depths(box, x, y)).filter((all) => all.every((depth) => depth > 0));
  if (reaches.length === 0) return 'none';
  const isWhole = reaches.some((all) => all.every((depth, k) => depth >= 2 * (k < 2 ? ROOM_X : ROOM_Y)));
  return isWhole ? 'whole' : 'part';
}

/**
 * How far a number moves to lie beside the panels that cover a part of it; nowhere, where its middle is covered: its station
 * can't be seen there.
 */
export function besidePanels({ x, y }: Offset, panels: readonly Box[]): Offset {
  const moved = { x, y };
  for (const box of panels) {
    if (x > box.left && x < box.right && y > box.top && y < box.bottom) return NOWHERE;
    const [toLeft, toRight, up, down] = depths(box, moved.x, moved.y);
    const least = Math.min(toLeft, toRight, up, down);
    if (least <= 0) continue;
    if (least === toLeft || least === toRight) moved.x += least === toLeft ? -least : least;
    else moved.y += least === up ? -least : least;
  }
  return { x: moved.x - x, y: moved.y - y };
}

/** How far a number at a place reaches into a box: seen from its left, right, upper and lower side. */
function depths(box: Box, x: number, y: number): [number, number, number, number] {
  return [x + ROOM_X - box.left, box.right - x + ROOM_X, y + ROOM_Y - box.top, box.bottom - y + ROOM_Y];
}

/** Elements of the building found by name, class or GlobalId. */
import type { StageElement, StageTriangles } from '../load/stage.ts';
import { kindInWords } from '../panels/figures.ts';

/** Indices into `elements` of those in which every word occurs; names that begin with what was typed first. */
export function foundElements(elements: readonly StageElement[], typed: string): number[] {
  const words = typed.toLowerCase().split(/\s+/).filter(Boolean);
  if (words.length === 0) return [];
  const ranked: { readonly index: number; readonly rank: number }[] = [];
  for (const [index, { name, kind, sourceId }] of elements.entries()) {
    const text = `${name} ${kind} ${kindInWords(kind)} ${sourceId}`.toLowerCase();
    if (!words.every((word) => text.includes(word))) continue;
    const isBegun = [name, sourceId].some((one) => one.toLowerCase().startsWith(typed.trim().toLowerCase()));
    ranked.push({ index, rank: isBegun ? 0 : 1 });
  }
  return ranked.sort((a, b) => a.rank - b.rank || a.index - b.index).map(({ index }) => index);
}

type Point = [number, number, number];

/** Lowest and highest corner of an element, local frame. */
export function boxOfElement(
  { firstTriangle, nTriangles }: StageElement,
  { cornersM }: StageTriangles,
): [Point, Point] {
  const [low, high]: [Point, Point] = [
    [Infinity, Infinity, Infinity],
    [-Infinity, -Infinity, -Infinity],
  ];
  for (let i = 9 * firstTriangle; i < 9 * (firstTriangle + nTriangles); i++) {
    low[i % 3] = Math.min(low[i % 3], cornersM[i]);
    high[i % 3] = Math.max(high[i % 3], cornersM[i]);
  }
  return [low, high];
}

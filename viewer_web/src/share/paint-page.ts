/** Paints parts of the page into a canvas as they stand on the screen: texts, round and square boxes, swatches. */

export interface Origin {
  readonly x: number;
  readonly y: number;
}

/** `root` and all in it that is seen, but for what one presses: buttons and fields mean nothing in a picture. */
export function paintPage(context: CanvasRenderingContext2D, root: Element, origin: Origin): void {
  if (root.matches('select, input, textarea, button.link, [data-not-in-picture]')) return;
  const style = getComputedStyle(root);
  if (style.display === 'none' || style.visibility === 'hidden' || Number(style.opacity) === 0) return;
  context.save();
  context.globalAlpha *= Number(style.opacity);
  paintBox(context, root, style, origin);
  for (const child of root.childNodes) {
    if (child instanceof Element) paintPage(context, child, origin);
    else if (child instanceof Text) paintWords(context, child, style, origin);
  }
  context.restore();
}

function paintBox(context: CanvasRenderingContext2D, element: Element, style: CSSStyleDeclaration, at: Origin): void {
  const box = element.getBoundingClientRect();
  if (box.width === 0 || box.height === 0) return;
  const fill = element instanceof SVGRectElement ? style.fill : style.backgroundColor;
  const radius = Math.min(Number.parseFloat(style.borderTopLeftRadius) || 0, box.width / 2, box.height / 2);
  context.beginPath();
  const share = style.borderTopLeftRadius.endsWith('%') ? Math.min(box.width, box.height) / 2 : radius;
  context.roundRect(box.x - at.x, box.y - at.y, box.width, box.height, share);
  context.fillStyle = fill;
  context.fill();
  const border = Number.parseFloat(style.borderTopWidth) || 0;
  if (border === 0 || style.borderTopStyle === 'none') return;
  context.lineWidth = border;
  context.strokeStyle = style.borderTopColor;
  context.setLineDash(style.borderTopStyle === 'dashed' ? [3 * border, 2 * border] : []);
  context.stroke();
}

/** Word by word: where lines break is the browser's affair. */
function paintWords(context: CanvasRenderingContext2D, text: Text, style: CSSStyleDeclaration, at: Origin): void {
  context.fillStyle = style.color;
  context.font = `${style.fontStyle} ${style.fontWeight} ${style.fontSize} ${style.fontFamily}`;
  context.textBaseline = 'middle';
  for (const { 0: word, index } of text.data.matchAll(/\S+/g)) {
    const range = document.createRange();
    range.setStart(text, index);
    range.setEnd(text, index + word.length);
    const box = range.getBoundingClientRect();
    context.fillText(word, box.x - at.x, box.y - at.y + box.height / 2);
  }
}

/** What is printed of the building: the picture as it is on the screen, for the canvas is empty on paper. */
import type { PlanView } from '../scene/plan-view.ts';

/** Printable width of a sheet of A4 with margins of 10 mm, CSS pixels. */
const SHEET_PX = 718;

/** While a page is printed a copy of the picture lies over the canvas. Returns what ends it. */
export function printPicture(target: Window, canvas: HTMLCanvasElement, view: PlanView): () => void {
  const copy = document.createElement('canvas');
  copy.className = 'print-picture';
  const freeze = (): void => {
    const scene = canvas.parentElement;
    if (scene === null) return;
    const { clientWidth: width, clientHeight: height } = scene;
    view.copyPicture(copy);
    // What a card has of the height below the picture, on narrow screens alone: paper is narrow, too.
    scene.style.setProperty('--dock', `${height - canvas.clientHeight}px`);
    canvas.after(copy);
    // As large as on the screen, and the sheet's scale over all of it: numbers stay at their stations.
    scene.style.setProperty('--print-width', `${width}px`);
    scene.style.setProperty('--print-height', `${height}px`);
    scene.style.setProperty('--print-zoom', String(Math.min(1, SHEET_PX / width)));
  };
  const end = (): void => {
    copy.remove();
    canvas.parentElement?.style.removeProperty('--dock');
  };
  target.addEventListener('beforeprint', freeze);
  target.addEventListener('afterprint', end);
  return () => {
    target.removeEventListener('beforeprint', freeze);
    target.removeEventListener('afterprint', end);
    end();
  };
}

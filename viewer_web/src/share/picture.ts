/** A picture of what is shown, as a PNG: title, scene with numbers of stations, legend, and a bar of scale. */

import { totalsBeside } from '../edit/totals-beside.ts';
import { t } from '../language/language.ts';
import { counted, reachedPercent } from '../panels/figures.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { paintPage } from './paint-page.ts';
import { scaleBar } from './scale-bar.ts';

const HEAD_PX = 56;
const MARGIN_PX = 16;
const FONT = '"Inter", system-ui, "Noto Sans", "DejaVu Sans", sans-serif';

export async function takePicture(store: Store, view: PlanView, now = new Date()): Promise<Blob> {
  const scene = document.querySelector('.scene');
  // On narrow pages a card takes a part of the scene.
  const box = scene?.querySelector('canvas')?.getBoundingClientRect();
  if (!scene || box === undefined) throw new Error(t('There is nothing to take a picture of.'));
  const drawn = document.createElement('canvas');
  view.copyPicture(drawn);
  const ratio = drawn.width / box.width;
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [drawn.width, drawn.height + Math.round(HEAD_PX * ratio)];
  const context = canvas.getContext('2d');
  if (context === null) throw new Error(t('The browser has no room for the picture: make its window smaller.'));
  context.scale(ratio, ratio);
  const [back, text, muted] = colorsOf(scene);
  context.fillStyle = back;
  context.fillRect(0, 0, box.width, HEAD_PX);
  writeHead(context, titlesOf(store, now), { text, muted }, box.width);
  context.drawImage(drawn, 0, HEAD_PX, box.width, box.height);
  const origin = { x: box.x, y: box.y - HEAD_PX };
  for (const part of scene.querySelectorAll('.room-names, .markers, .legend')) paintPage(context, part, origin);
  drawScale(context, view, { text, back }, box.width, HEAD_PX + box.height);
  return new Promise((resolve, reject) => {
    canvas.toBlob(
      (blob) => (blob === null ? reject(new Error(t('The browser could not write the picture.'))) : resolve(blob)),
      'image/png',
    );
  });
}

/** What of the plan is shown, and when. */
export function titlesOf(store: Store, now: Date): readonly [string, string] {
  const loaded = store.loaded.value;
  const file = loaded?.plan.scene.file.split(/[\\/]/).pop() ?? '';
  const floor = loaded?.stage.floors.find(({ id }) => id === store.floorId.value)?.name ?? t('All floors');
  const beside = totalsBeside(store);
  const totals = beside && (beside.isEdited ? beside.edited : beside.planned);
  const worth =
    totals &&
    t('{stations}, {coverage} coverage', {
      stations: counted(totals.nStations, 'station'),
      coverage: reachedPercent(totals.coverage, totals.required),
    });
  const as = beside?.isEdited ? [t('as edited'), worth].filter(Boolean).join(', ') : worth;
  return [`${file} · ${floor}`, [as, now.toISOString().slice(0, 10), 'tlsplan'].filter(Boolean).join(' · ')];
}

/** Name of the file: what is shown, in letters that every system takes. */
export function pictureName(store: Store): string {
  const [file, floor, station] = [
    store.loaded.value?.plan.scene.file ?? 'plan',
    store.floorId.value,
    store.stationId.value,
  ];
  const base = file.replace(/^.*[\\/]/, '').replace(/\.[^.]*$/, '');
  return `${[base, floor, station]
    .filter(Boolean)
    .join('-')
    .replace(/[^\w.-]+/g, '_')}.png`;
}

function colorsOf(scene: Element): readonly [string, string, string] {
  const style = getComputedStyle(scene);
  const color = (name: string): string => style.getPropertyValue(name).trim();
  return [color('--surface'), color('--text'), color('--muted')];
}

interface Colors {
  readonly text: string;
  readonly muted: string;
}

function writeHead(
  context: CanvasRenderingContext2D,
  [title, about]: readonly [string, string],
  { text, muted }: Colors,
  width: number,
): void {
  context.textBaseline = 'alphabetic';
  context.fillStyle = text;
  context.font = `650 17px ${FONT}`;
  context.fillText(title, MARGIN_PX, 24, width - 2 * MARGIN_PX);
  context.fillStyle = muted;
  context.font = `13px ${FONT}`;
  context.fillText(about, MARGIN_PX, 44, width - 2 * MARGIN_PX);
}

/** Things nearer than what is looked at are larger than the bar says: it names where it holds. */
function drawScale(
  context: CanvasRenderingContext2D,
  view: PlanView,
  { text, back }: { readonly text: string; readonly back: string },
  width: number,
  bottom: number,
): void {
  const bar = scaleBar(view.metresPerPixel(), 140);
  const words = t('{length} in the middle of the picture', { length: bar.words });
  context.font = `12px ${FONT}`;
  const room = Math.max(bar.lengthPx, context.measureText(words).width) + 20;
  const [x, y] = [width - MARGIN_PX - room, bottom - MARGIN_PX - 40];
  context.fillStyle = back;
  context.beginPath();
  context.roundRect(x, y, room, 40, 8);
  context.fill();
  context.fillStyle = text;
  context.textBaseline = 'alphabetic';
  context.fillText(words, x + 10, y + 17);
  context.fillRect(x + 10, y + 27, bar.lengthPx, 2);
  for (const end of [0, bar.lengthPx - 1]) context.fillRect(x + 10 + end, y + 24, 1, 8);
}

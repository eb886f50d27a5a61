/** Drives Chromium: pages of the viewer, what went wrong on them, and the pixels they show. */
import { fileURLToPath } from 'node:url';
import { type Browser, type CDPSession, chromium, type Locator, type Page } from 'playwright-core';
import { afterAll, afterEach, beforeAll, expect, inject } from 'vitest';
import type { Change, Review } from '../src/api/documents.ts';
import type { PlanStation } from '../src/load/plan-json.ts';
import { PATIENCE_MS } from './chromium.ts';
import { discardReview } from './plan-files.ts';

const SCREENSHOTS = fileURLToPath(new URL('../test-results/', import.meta.url));

export type PagePoint = [x: number, y: number];

export interface Look {
  readonly width?: number;
  readonly height?: number;
  readonly colorScheme?: 'light' | 'dark';
  readonly hasTouch?: boolean;
  readonly isMobile?: boolean;
  /** Of the browser; by default English. */
  readonly locale?: string;
  /** Pixels of the picture, not of the page, to a CSS pixel: software draws few of them in less time. */
  readonly pixelRatio?: number;
}

/**
 * Pages of the viewer for the tests of one file, all in the Chromium of this run.
 *
 * After each test its pages are closed, none of them may have had a fault, and the plan's review is empty again. A test
 * that fails leaves pictures of its pages in test-results/.
 */
export function viewerPages(usual: Look = {}): (look?: Look, address?: string) => Promise<ViewerPage> {
  let browser: Browser;
  const opened: ViewerPage[] = [];
  beforeAll(async () => {
    browser = await chromium.connect(inject('browser'), { timeout: PATIENCE_MS });
  });
  afterAll(() => browser.close());
  afterEach(async ({ task }) => {
    const pages = opened.splice(0);
    for (const [i, { page }] of pages.entries()) {
      if (task.result?.state === 'fail' && !page.isClosed()) {
        await page.screenshot({
          path: `${SCREENSHOTS}failed-${i}-${task.name.replace(/[^a-z0-9]+/gi, '-').slice(0, 60)}.png`,
        });
      }
      await page.close();
    }
    discardReview(inject('planFolder'));
    expect(pages.flatMap(({ faults }) => faults)).toEqual([]);
  });
  return async (look = {}, address = inject('address')) => {
    const viewer = await ViewerPage.create(browser, address, { ...usual, ...look });
    opened.push(viewer);
    return viewer;
  };
}

/** Few pixels, and one sample a pixel instead of four: in software most of the time of a picture goes into these. */
function drawCheaply(pixelRatio: number): void {
  Object.defineProperty(window, 'devicePixelRatio', { get: () => pixelRatio });
  const { getContext } = HTMLCanvasElement.prototype as unknown as { getContext: (...args: unknown[]) => unknown };
  Object.assign(HTMLCanvasElement.prototype, {
    getContext(this: HTMLCanvasElement, kind: string, options?: object) {
      return getContext.call(this, kind, kind === 'webgl2' ? { ...options, antialias: false } : options);
    },
  });
}

export class ViewerPage {
  /** Errors of the page and requests to other machines. */
  readonly faults: string[] = [];
  private fingers: CDPSession | null = null;

  private constructor(
    readonly page: Page,
    private readonly address: string,
  ) {
    page.on('pageerror', (error) => this.faults.push(`page error: ${error.message}`));
    page.on('console', (message) => {
      if (message.type() === 'error') this.faults.push(`console: ${message.text()}`);
    });
    const own = address.startsWith('file:') ? address : new URL(address).origin;
    page.on('request', (request) => {
      if (!/^(data|blob):/.test(request.url()) && !request.url().startsWith(own)) {
        this.faults.push(`request to ${request.url()}`);
      }
    });
  }

  /** A page that has not gone anywhere yet. Flights of the camera are off, so that a click ends where it shows. */
  static async create(
    browser: Browser,
    address: string,
    { width = 1000, height = 680, pixelRatio = 1, ...look }: Look = {},
  ) {
    const page = await browser.newPage({ viewport: { width, height }, reducedMotion: 'reduce', ...look });
    page.setDefaultTimeout(PATIENCE_MS);
    await page.addInitScript(drawCheaply, pixelRatio);
    return new ViewerPage(page, address);
  }

  /** Go to the viewer at a view and wait until the building is drawn. */
  async open(hash = ''): Promise<void> {
    await this.page.goto(`${this.address}${hash}`);
    await this.page.locator('.marker:not([hidden])').first().waitFor();
    await this.settle();
  }

  /** Go to the tab Edit of a floor, seen straight from above, and wait until the server evaluates edits. */
  async openEditing(hash: string, view: 't' | 'p' = 't'): Promise<void> {
    await this.open(`#tab=edit&${hash}`);
    // First that there is a server, then that it is ready.
    await this.page.getByRole('radiogroup', { name: /^(Tool|Werkzeug)$/ }).waitFor();
    await this.page.getByTestId('live-note').waitFor({ state: 'detached' });
    await this.page.getByTestId('totals').waitFor();
    await this.press(view);
  }

  /** Press a key, and wait until the picture has been drawn. */
  async press(key: string): Promise<void> {
    await this.page.keyboard.press(key);
    await this.settle();
  }

  /** The `#` of the address and what follows it, from the page: the browser learns it later. */
  hash(): Promise<string> {
    return this.page.evaluate(() => window.location.hash);
  }

  /** Wait until the picture has been drawn: a frame requested now comes after those requested before. */
  async settle(): Promise<void> {
    await this.page.evaluate(
      () => new Promise<void>((done) => requestAnimationFrame(() => requestAnimationFrame(() => done()))),
    );
  }

  marker(id: string): Locator {
    return this.page.locator(`.marker[data-station="${id}"]`);
  }

  /** Where on the page the number of a station is. */
  async centreOf(id: string): Promise<PagePoint> {
    const box = (await this.marker(id).boundingBox())!;
    return [box.x + box.width / 2, box.y + box.height / 2];
  }

  /** Where points (x, y) of the scene are on the page, in the plan view: by the numbers of two stations far apart. */
  async planToPage(stations: readonly PlanStation[]): Promise<(x: number, y: number) => PagePoint> {
    const sum = ({ position: [x, y] }: PlanStation): number => x + y;
    const from = stations.reduce((a, b) => (sum(a) < sum(b) ? a : b));
    const to = stations.reduce((a, b) => (sum(a) > sum(b) ? a : b));
    const [[ax, ay], [bx, by]] = [await this.centreOf(from.id), await this.centreOf(to.id)];
    const perX = (bx - ax) / (to.position[0] - from.position[0]);
    const perY = (by - ay) / (to.position[1] - from.position[1]);
    return (x, y) => [ax + perX * (x - from.position[0]), ay + perY * (y - from.position[1])];
  }

  /** Stations whose numbers are shown, sorted. */
  shownStations(): Promise<string[]> {
    return this.page
      .locator('.marker:not([hidden])')
      .evaluateAll((all) => all.map((one) => (one as HTMLElement).dataset.station ?? '').sort());
  }

  /** Whether nothing lies over the canvas at a point of the page. */
  isBare(...point: PagePoint): Promise<boolean> {
    return this.page.evaluate(([x, y]) => document.elementFromPoint(x, y)?.tagName === 'CANVAS', point);
  }

  /** Drag with the mouse from a point of the page, drawing after each step; the button stays down. */
  async dragFrom([x, y]: PagePoint, dx: number, dy: number, steps = 3): Promise<void> {
    await this.page.mouse.move(x, y);
    await this.page.mouse.down();
    for (let i = 1; i <= steps; i++) {
      await this.page.mouse.move(x + (dx * i) / steps, y + (dy * i) / steps);
      await this.settle();
    }
  }

  /** What fingers do, each at a point of the page; drawn afterwards. */
  async touch(type: 'touchStart' | 'touchMove' | 'touchEnd', ...fingers: readonly PagePoint[]): Promise<void> {
    this.fingers ??= await this.page.context().newCDPSession(this.page);
    const touchPoints = fingers.map(([x, y], id) => ({ x, y, id }));
    await this.fingers.send('Input.dispatchTouchEvent', { type, touchPoints });
    await this.settle();
  }

  /** Choose a tool of the tab Edit. */
  tool(name: string): Promise<void> {
    return this.page.getByRole('radio', { name, exact: true }).click();
  }

  review(): Promise<Review> {
    return this.page.evaluate(async () => (await fetch('api/review')).json());
  }

  /** The review once it is at another revision than `revision`. */
  async changedFrom(revision: number): Promise<Review> {
    await expect.poll(async () => (await this.review()).revision).not.toBe(revision);
    return this.review();
  }

  /** Take the last change back by its button, until the server and the page have. */
  async undo(): Promise<void> {
    const { revision } = await this.review();
    const button = this.page.getByRole('button', { name: /^Undo: / });
    const label = (await button.getAttribute('aria-label'))!.replace(/^Undo: /, '');
    await button.click();
    await this.changedFrom(revision);
    await this.page.getByRole('button', { name: `Redo: ${label}`, exact: true }).waitFor();
  }

  /** Change the review as another page would; the status of the server's answer. */
  async changeAs(author: string, ...changes: readonly Change[]): Promise<number> {
    const { revision } = await this.review();
    return this.page.evaluate(
      async (body) => {
        const headers = { 'content-type': 'application/json' };
        return (await fetch('api/review/changes', { method: 'POST', headers, body: JSON.stringify(body) })).status;
      },
      { base_revision: revision, author, changes },
    );
  }

  /** Figures of a card by their names. */
  async figures(testId: string): Promise<Record<string, string>> {
    const rows = this.page.getByTestId(testId).locator('.figure');
    return Object.fromEntries(
      await rows.evaluateAll((all) =>
        all.map((row) => [row.querySelector('dt')?.textContent ?? '', row.querySelector('dd')?.textContent ?? '']),
      ),
    );
  }

  /** A picture of the page in test-results/ for people, with `TLSPLAN_E2E_PICTURES` alone: software draws it slowly. */
  async screenshot(name: string): Promise<void> {
    if (process.env.TLSPLAN_E2E_PICTURES) await this.page.screenshot({ path: `${SCREENSHOTS}${name}.png` });
  }

  /** What the canvas shows, panels and markers hidden. */
  async canvasPixels(): Promise<Pixels> {
    const style = await this.page.evaluateHandle(() => {
      const sheet = new CSSStyleSheet();
      sheet.replaceSync(
        '.toolbar, .site-tools, .view-cube, .walk-map, .markers, .measure-layer, .corner, .corner *, .card { visibility: hidden }',
      );
      document.adoptedStyleSheets = [sheet];
      return sheet;
    });
    await this.settle();
    const canvas = this.page.locator('canvas');
    const box = await canvas.boundingBox();
    const png = await canvas.screenshot();
    await this.page.evaluate(() => {
      document.adoptedStyleSheets = [];
    });
    await style.dispose();
    return new Pixels(await this.decode(png), box!);
  }

  private async decode(png: Buffer): Promise<{ width: number; height: number; rgba: Buffer }> {
    const { width, height, text } = await this.page.evaluate(async (base64) => {
      const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
      const image = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
      const context = new OffscreenCanvas(image.width, image.height).getContext('2d')!;
      context.drawImage(image, 0, 0);
      const { data } = context.getImageData(0, 0, image.width, image.height);
      let text = '';
      for (let i = 0; i < data.length; i += 0x8000) text += String.fromCharCode(...data.subarray(i, i + 0x8000));
      return { width: image.width, height: image.height, text: btoa(text) };
    }, png.toString('base64'));
    return { width, height, rgba: Buffer.from(text, 'base64') };
  }
}

export type Rgb = [number, number, number];

export class Pixels {
  constructor(
    private readonly image: { readonly width: number; readonly height: number; readonly rgba: Buffer },
    private readonly box: { readonly x: number; readonly y: number },
  ) {}

  /** The colour at a place of the page. */
  at(x: number, y: number): Rgb {
    const i = 4 * (Math.round(y - this.box.y) * this.image.width + Math.round(x - this.box.x));
    return [this.image.rgba[i], this.image.rgba[i + 1], this.image.rgba[i + 2]];
  }

  /** Whether the pixels next to a place have its colour. */
  isEvenAround(x: number, y: number): boolean {
    const centre = this.at(x, y);
    const offsets = [-1, 0, 1].flatMap((i) => [-1, 0, 1].map((j) => [i, j]));
    return offsets.every(([i, j]) => this.at(x + i, y + j).every((value, k) => Math.abs(value - centre[k]) <= 2));
  }

  /** Share of the pixels for which `holds`. */
  share(holds: (rgb: Rgb, index: number) => boolean): number {
    const { rgba } = this.image;
    let n = 0;
    for (let i = 0; i < rgba.length; i += 4) if (holds([rgba[i], rgba[i + 1], rgba[i + 2]], i / 4)) n++;
    return n / (rgba.length / 4);
  }

  /** Share of the pixels that are clearly another colour in `other`. */
  shareChanged(other: Pixels): number {
    const theirs = other.image.rgba;
    return this.share((rgb, index) => rgb.some((value, k) => Math.abs(value - theirs[4 * index + k]) > 12));
  }
}

/** Drives Chromium: one page of the viewer, what went wrong on it, and the pixels it shows. */
import { existsSync, mkdirSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { type Browser, chromium, type Page } from 'playwright-core';

/** WebGL in software, and nothing that calls home. */
const FLAGS = [
  '--no-sandbox',
  '--disable-gpu',
  '--disable-background-networking',
  '--disable-component-update',
  '--disable-sync',
  '--use-angle=swiftshader',
  '--enable-unsafe-swiftshader',
  '--ignore-gpu-blocklist',
];
const PLACES = ['/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome', '/snap/bin/chromium'];
/** Software draws pictures slowly, and a click waits for them. */
const PATIENCE_MS = 240_000;
const SCREENSHOTS = fileURLToPath(new URL('../test-results/', import.meta.url));

export function launchBrowser(): Promise<Browser> {
  const executablePath = process.env.TLSPLAN_CHROMIUM ?? PLACES.find((place) => existsSync(place));
  if (executablePath === undefined) throw new Error(`no Chromium at ${PLACES.join(', ')}; set TLSPLAN_CHROMIUM`);
  return chromium.launch({ executablePath, args: FLAGS, timeout: PATIENCE_MS });
}

export interface Look {
  readonly width?: number;
  readonly height?: number;
  readonly colorScheme?: 'light' | 'dark';
  readonly hasTouch?: boolean;
  /** Of the browser; nothing told: English. */
  readonly locale?: string;
}

export class ViewerPage {
  /** Errors of the page and requests to other machines. */
  readonly faults: string[] = [];

  private constructor(
    readonly page: Page,
    private readonly address: string,
  ) {
    page.on('pageerror', (error) => this.faults.push(`page error: ${error.message}`));
    page.on('console', (message) => {
      if (message.type() === 'error') this.faults.push(`console: ${message.text()}`);
    });
    page.on('request', (request) => {
      if (!/^(data|blob):/.test(request.url()) && !request.url().startsWith(new URL(address).origin)) {
        this.faults.push(`request to ${request.url()}`);
      }
    });
  }

  /** A page that has not gone anywhere yet. Flights of the camera are off, so that a click ends where it shows. */
  static async create(browser: Browser, address: string, { width = 1000, height = 680, ...look }: Look = {}) {
    const page = await browser.newPage({ viewport: { width, height }, reducedMotion: 'reduce', ...look });
    page.setDefaultTimeout(PATIENCE_MS);
    return new ViewerPage(page, address);
  }

  /** Go to the viewer at a view and wait until the building is drawn. */
  async open(hash = ''): Promise<void> {
    await this.page.goto(`${this.address}${hash}`);
    await this.page.locator('.marker:not([hidden])').first().waitFor();
    await this.settle();
  }

  /** What follows the `#` of the address: asked of the page, for the browser tells of it later. */
  hash(): Promise<string> {
    return this.page.evaluate(() => window.location.hash);
  }

  /** Wait until the picture has been drawn: a frame asked for now comes after those asked for before. */
  async settle(): Promise<void> {
    await this.page.evaluate(
      () => new Promise<void>((done) => requestAnimationFrame(() => requestAnimationFrame(() => done()))),
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

  async screenshot(name: string): Promise<void> {
    mkdirSync(SCREENSHOTS, { recursive: true });
    await this.page.screenshot({ path: `${SCREENSHOTS}${name}.png` });
  }

  /** What the canvas shows, panels and markers hidden. */
  async canvasPixels(): Promise<Pixels> {
    const style = await this.page.evaluateHandle(() => {
      const sheet = new CSSStyleSheet();
      sheet.replaceSync(
        '.toolbar, .site-tools, .markers, .measure-layer, .corner, .corner *, .card { visibility: hidden }',
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

type Rgb = [number, number, number];

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

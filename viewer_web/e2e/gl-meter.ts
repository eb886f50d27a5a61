/** Counts from outside the viewer what it keeps on the graphics card, and what it draws: at the calls of WebGL. */
import type { Page } from 'playwright-core';

export interface GlCount {
  /** Of buffers and textures that are not deleted. */
  readonly bytes: number;
  /** Points and triangles of the last picture in which anything was drawn. */
  readonly points: number;
  readonly triangles: number;
  readonly nPictures: number;
}

/** To be called before the page is opened. */
export async function countGl(page: Page): Promise<void> {
  await page.addInitScript(() => {
    const sizes = new Map<object, number>();
    const bound = new Map<number, WebGLBuffer | null>();
    const drawn = { points: 0, triangles: 0, isNew: true };
    const last = { points: 0, triangles: 0, nPictures: 0 };
    const proto = WebGL2RenderingContext.prototype;
    const { POINTS, TRIANGLES, TEXTURE_BINDING_2D } = WebGL2RenderingContext;
    const wrap = (name: string, before: (gl: WebGL2RenderingContext, args: readonly never[]) => void): void => {
      const methods = proto as unknown as Record<string, (...args: unknown[]) => unknown>;
      const original = methods[name];
      methods[name] = function (this: WebGL2RenderingContext, ...args: unknown[]) {
        before(this, args as never[]);
        return original.apply(this, args);
      };
    };
    const bytesOfTexel = (format: number): number => {
      const { R8, R8UI, R16UI, R16F, RG8, R32F, RGBA16F, RGBA32F } = WebGL2RenderingContext;
      if (format === R8 || format === R8UI) return 1;
      if (format === R16UI || format === R16F || format === RG8) return 2;
      if (format === RGBA16F) return 8;
      return format === RGBA32F ? 16 : format === R32F ? 4 : 4;
    };
    wrap('bindBuffer', (_, [target, buffer]) => bound.set(target, buffer));
    wrap('bufferData', (_, args) => {
      const [target, content] = args as unknown as [number, number | ArrayBufferView];
      const buffer = bound.get(target);
      if (buffer) sizes.set(buffer, typeof content === 'number' ? content : (content?.byteLength ?? 0));
    });
    wrap('deleteBuffer', (_, [buffer]) => sizes.delete(buffer));
    const sized = (gl: WebGL2RenderingContext, format: number, width: number, height: number): void => {
      const texture = gl.getParameter(TEXTURE_BINDING_2D) as WebGLTexture | null;
      if (texture) sizes.set(texture, bytesOfTexel(format) * width * height);
    };
    wrap('texStorage2D', (gl, [, , format, width, height]) => sized(gl, format, width, height));
    wrap('texImage2D', (gl, args) => {
      if (args.length === 9) sized(gl, args[2], args[3], args[4]);
    });
    wrap('deleteTexture', (_, [texture]) => sizes.delete(texture));
    // The first call after a turn of the loop begins a picture.
    const count = (mode: number, n: number): void => {
      if (drawn.isNew) {
        Object.assign(drawn, { points: 0, triangles: 0, isNew: false });
        queueMicrotask(() => {
          drawn.isNew = true;
          Object.assign(last, { points: drawn.points, triangles: drawn.triangles, nPictures: last.nPictures + 1 });
        });
      }
      if (mode === POINTS) drawn.points += n;
      if (mode === TRIANGLES) drawn.triangles += n / 3;
    };
    wrap('drawArrays', (_, [mode, , n]) => count(mode, n));
    wrap('drawElements', (_, [mode, n]) => count(mode, n));
    wrap('drawArraysInstanced', (_, [mode, , n, nInstances]) => count(mode, n * nInstances));
    wrap('drawElementsInstanced', (_, [mode, n, , nInstances]) => count(mode, n * nInstances));
    Object.assign(window, {
      countedGl: () => ({ bytes: [...sizes.values()].reduce((sum, size) => sum + size, 0), ...last }),
    });
  });
}

export function glCount(page: Page): Promise<GlCount> {
  return page.evaluate(() => (window as unknown as { countedGl: () => GlCount }).countedGl());
}

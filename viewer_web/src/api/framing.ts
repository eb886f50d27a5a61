/**
 * Answers of numbers: 4 bytes little endian with the length of a JSON head, the head, then the arrays one after another.
 *
 * The head is padded with spaces so that the arrays begin at a multiple of four bytes.
 */
import { t } from '../language/language.ts';
import { ApiError } from './api-error.ts';

export interface Framed<Head> {
  readonly head: Head;
  /** The bytes after the head. */
  readonly body: ArrayBuffer;
}

export function readFramed<Head>(buffer: ArrayBuffer): Framed<Head> {
  if (buffer.byteLength < 4) throw broken(t('{n} bytes', { n: buffer.byteLength }));
  const length = new DataView(buffer).getUint32(0, true);
  if (length > buffer.byteLength - 4)
    throw broken(t('a head of {length} in {n} bytes', { length, n: buffer.byteLength }));
  try {
    const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length))) as Head;
    return { head, body: buffer.slice(4 + length) };
  } catch {
    throw broken(t('a head that is not JSON'));
  }
}

/** What moving, adding or raising one station changes, patch by patch. */
export interface PatchDelta {
  readonly patches: Uint32Array;
  /** In steps of the layer that was asked for; 65535: seen by none. */
  readonly layerValues: Uint16Array;
  readonly timesSeen: Uint8Array;
}

/** Split the body of a preview: n u32, n u16, n u8. */
export function readPatchDelta(body: ArrayBuffer, n: number): PatchDelta {
  if (body.byteLength < 7 * n) throw broken(t('{n} bytes for {patches} patches', { n: body.byteLength, patches: n }));
  return {
    patches: new Uint32Array(body, 0, n),
    layerValues: new Uint16Array(body, 4 * n, n),
    timesSeen: new Uint8Array(body, 6 * n, n),
  };
}

function broken(what: string): ApiError {
  return new ApiError(
    0,
    t("The server's answer can't be read: {what}. Reload the page; the server may be of another version.", { what }),
  );
}

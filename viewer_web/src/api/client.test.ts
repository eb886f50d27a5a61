import { expect, test } from 'vitest';
import { ApiClient } from './client.ts';
import { readFramed, readPatchDelta } from './framing.ts';

const answering = (status: number, body: BodyInit | null): ApiClient =>
  new ApiClient(async () => new Response(body, { status }));

/** As the server frames it: the head padded so that numbers begin at a multiple of four. */
function framed(head: unknown, arrays: ArrayBuffer): ArrayBuffer {
  const text = JSON.stringify(head);
  const padded = new TextEncoder().encode(text + ' '.repeat((4 - (text.length % 4)) % 4));
  const bytes = new Uint8Array(4 + padded.length + arrays.byteLength);
  new DataView(bytes.buffer).setUint32(0, padded.length, true);
  bytes.set(padded, 4);
  bytes.set(new Uint8Array(arrays), 4 + padded.length);
  return bytes.buffer;
}

test('a preview is read as it was framed', async () => {
  const arrays = new ArrayBuffer(3 * 7);
  new Uint32Array(arrays, 0, 3).set([7, 70_000, 4_000_000_000]);
  new Uint16Array(arrays, 12, 3).set([1, 500, 65535]);
  new Uint8Array(arrays, 18, 3).set([0, 2, 255]);
  const { head, body } = await answering(200, framed({ sequence: 4 }, arrays)).framed<{ sequence: number }>('x');
  expect(head).toEqual({ sequence: 4 });
  const delta = readPatchDelta(body, 3);
  expect([...delta.patches]).toEqual([7, 70_000, 4_000_000_000]);
  expect([...delta.layerValues]).toEqual([1, 500, 65535]);
  expect([...delta.timesSeen]).toEqual([0, 2, 255]);
});

test.each([
  [new ArrayBuffer(2)],
  [framed({}, new ArrayBuffer(0)).slice(0, 5)],
  [Uint8Array.of(2, 0, 0, 0, 123, 123).buffer],
])('an answer that is cut or no head is told in words', (buffer) => {
  expect(() => readFramed(buffer)).toThrow(/can't be read.*Reload/);
});

test('too few numbers for the patches that are told is told', () => {
  expect(() => readPatchDelta(new ArrayBuffer(20), 3)).toThrow(/20 bytes for 3 patches/);
});

test.each([
  [422, '{"message": "zone: it crosses itself"}', 'zone: it crosses itself'],
  [413, 'a body of at most 1 MiB is expected', 'a body of at most 1 MiB is expected'],
  [500, '', 'The server answered 500.'],
  [500, '{"message": 5}', 'The server answered 500.'],
])('a refusal with %i says what the server says', async (status, body, words) => {
  await expect(answering(status, body).json('review')).rejects.toMatchObject({ status, message: words });
});

test('a missing token leads to the address that was printed', async () => {
  await expect(answering(401, 'no token').session()).rejects.toThrow(/open the address that `tlsplan view` printed/);
});

test('an answer that is no JSON is told in words', async () => {
  await expect(answering(200, '<html>').session()).rejects.toThrow(/can't be read/);
});

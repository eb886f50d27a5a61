/** LZ4 blocks, the compression inside USD crate files (lz4.org "LZ4 Block Format"). */
import { PlanLoadError } from './plan-load-error.ts';

/** Shortest match; the format stores lengths minus this. */
const SHORTEST_MATCH = 4;

/** Decompress one block; `sizeBytes` is the most it can hold. Returns what was written. */
export function decompressBlock(block: Uint8Array, sizeBytes: number): Uint8Array {
  const out = new Uint8Array(sizeBytes);
  let from = 0;
  let to = 0;
  const readLength = (start: number): number => {
    let length = start;
    if (start === 15) {
      let more: number;
      do {
        more = block[from++];
        length += more;
      } while (more === 255);
    }
    return length;
  };
  while (from < block.length) {
    const token = block[from++];
    const nLiterals = readLength(token >> 4);
    if (from + nLiterals > block.length || to + nLiterals > sizeBytes) throw truncated();
    out.set(block.subarray(from, from + nLiterals), to);
    from += nLiterals;
    to += nLiterals;
    if (from >= block.length) break; // the last sequence has literals only
    const distance = block[from] | (block[from + 1] << 8);
    from += 2;
    const nMatched = readLength(token & 15) + SHORTEST_MATCH;
    if (distance === 0 || distance > to || !(to + nMatched <= sizeBytes)) throw truncated();
    // Byte by byte: a match may overlap what it writes.
    for (let i = 0; i < nMatched; i++, to++) out[to] = out[to - distance];
  }
  return out.subarray(0, to);
}

/** Decompress what USD's TfFastCompression wrote: a count of chunks, then LZ4 blocks. */
export function decompressChunks(packed: Uint8Array, sizeBytes: number): Uint8Array {
  const nChunks = packed[0];
  if (nChunks === 0) return decompressBlock(packed.subarray(1), sizeBytes);
  const view = new DataView(packed.buffer, packed.byteOffset, packed.byteLength);
  const out = new Uint8Array(sizeBytes);
  let from = 1;
  let to = 0;
  for (let chunk = 0; chunk < nChunks; chunk++) {
    const chunkBytes = view.getInt32(from, true);
    const part = decompressBlock(packed.subarray(from + 4, from + 4 + chunkBytes), sizeBytes - to);
    out.set(part, to);
    from += 4 + chunkBytes;
    to += part.length;
  }
  return out.subarray(0, to);
}

function truncated(): PlanLoadError {
  return new PlanLoadError(
    'viewer/stage.usdc: a compressed block is damaged. Write the plan again with `tlsplan plan`.',
  );
}

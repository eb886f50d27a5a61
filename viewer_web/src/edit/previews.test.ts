import { expect, test } from 'vitest';
import { ApiClient } from '../api/client.ts';
import type { PreviewHead } from '../api/documents.ts';
import { type PatchValues, TIMES_SEEN } from '../heat/layers.ts';
import { askPreview, type Preview, PreviewPaint } from './previews.ts';

const HEAD: PreviewHead = {
  sequence: 1,
  revision: 3,
  n_patches_changed: 2,
  position: [1, 2, 1.3],
  instrument_height_m: 1.3,
  admissible: true,
  reason: '',
  coverage: {
    achievable_area_m2: 100,
    total_area_m2: 200,
    covered_area_m2: 90,
    fraction_of_achievable: 0.9,
    fraction_of_total: 0.45,
  },
  requirements: [],
  floors: [],
  station: { covered_area_m2: 1, own_area_m2: 0.5 },
  links: [],
  n_stations: 3,
  registration: { connected: true, n_networks: 1 },
};

function paintOn(seen: number[], range: number[]) {
  const base: Record<string, PatchValues> = { [TIMES_SEEN]: Uint8Array.from(seen), range: Uint16Array.from(range) };
  const shown = { seen: [...seen], range: [...range] };
  const paint = new PreviewPaint({
    patchPatches: (indices, timesSeen, _layerId, values) => {
      for (let i = 0; i < indices.length; i++) {
        if (timesSeen) shown.seen[indices[i]] = timesSeen[i];
        if (values) shown.range[indices[i]] = values[i];
      }
    },
  });
  return { paint, shown, base: (id: string) => base[id] };
}
const preview = (patches: number[], timesSeen: number[], layerValues: number[], layerId = 'range'): Preview => ({
  head: HEAD,
  layerId,
  delta: {
    patches: Uint32Array.from(patches),
    timesSeen: Uint8Array.from(timesSeen),
    layerValues: Uint16Array.from(layerValues),
  },
});

test('a preview is drawn over the draft and not over the preview before', () => {
  const { paint, shown, base } = paintOn([1, 1, 0, 255], [10, 20, 65535, 65535]);
  paint.show(preview([0, 2], [0, 1], [65535, 30]), base);
  expect(shown).toEqual({ seen: [0, 1, 1, 255], range: [65535, 20, 30, 65535] });
  paint.show(preview([1], [2], [15]), base);
  expect(shown).toEqual({ seen: [1, 2, 0, 255], range: [10, 15, 65535, 65535] });
  paint.takeBack();
  expect(shown).toEqual({ seen: [1, 1, 0, 255], range: [10, 20, 65535, 65535] });
});

test('values of a layer whose own values are not there yet are not drawn', () => {
  const { paint, shown, base } = paintOn([1, 0], [10, 65535]);
  paint.show(preview([1], [1], [5], 'incidence'), base);
  expect(shown).toEqual({ seen: [1, 1], range: [10, 65535] });
});

test('what is shown anew is not taken back', () => {
  const { paint, shown, base } = paintOn([1, 0], [10, 65535]);
  paint.show(preview([1], [1], [5]), base);
  paint.forget();
  paint.takeBack();
  expect(shown.seen).toEqual([1, 1]);
});

test('the question names the station, where it is asked to stand, and the layer', async () => {
  let asked: unknown;
  const client = new ApiClient(async (address, options) => {
    asked = [address, JSON.parse(String(options?.body))];
    const head = new TextEncoder().encode(JSON.stringify({ ...HEAD, n_patches_changed: 0 }));
    const bytes = new Uint8Array(4 + head.length);
    new DataView(bytes.buffer).setUint32(0, head.length, true);
    bytes.set(head, 4);
    return new Response(bytes);
  });
  const question = { stationId: null, floorId: 'F0', positionM: [1, 2, 3] as const, heightM: 1.3, layerId: 'range' };
  const { head, delta } = await askPreview(client, question, 7);
  expect(asked).toEqual([
    'api/live/preview',
    { station: null, floor: 'F0', position: [1, 2, 3], instrument_height_m: 1.3, layer: 'range', sequence: 7 },
  ]);
  expect(head.position).toEqual([1, 2, 1.3]);
  expect(delta.patches).toHaveLength(0);
});

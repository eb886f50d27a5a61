import { expect, test, vi } from 'vitest';
import { ApiClient } from '../api/client.ts';
import type { ExportList } from '../api/documents.ts';
import { heldDownloads, madeDownloads, make } from './downloads.ts';

const LIST: ExportList = {
  edited_stations: 1,
  exports: [
    { name: 'csv', title: 'stations as a CSV', file_name: 'stations.csv', obstacle: null },
    { name: 'pdf', title: 'sheets', file_name: 'sheets.pdf', obstacle: 'house.ifc: not found' },
    { name: 'new', title: 'a format of a later version', file_name: 'plan.new', obstacle: null },
  ],
};

test('what the server makes is offered in people\u2019s words, with why something can not be had', () => {
  const [csv, pdf, later] = madeDownloads(LIST);
  expect([csv.name, csv.kind, csv.obstacle]).toEqual(['Station list', 'CSV', null]);
  expect(pdf.obstacle).toBe('house.ifc: not found');
  expect([later.name, later.kind]).toEqual(['a format of a later version', 'new']);
});

test('files are offered only where the folder holds them', async () => {
  const asked: string[] = [];
  const found = await heldDownloads('runs/R001/plan', async (address) => {
    asked.push(address);
    if (address.endsWith('index.html')) throw new Error('no network');
    return { ok: address.endsWith('stations.csv') };
  });
  expect(found.map(({ address }) => address)).toEqual(['plan/runs/R001/plan/stations.csv']);
  expect(asked).toContain('plan/runs/R001/plan/report/index.html');
});

test('a file of the server is saved under its name, and its remarks are handed on', async () => {
  const headers = { 'x-tlsplan-remarks': encodeURIComponent('stations as reviewed\nin metres') };
  const client = new ApiClient(async () => new Response('S001', { headers }));
  const save = vi.fn();
  const remarks = await make(client, madeDownloads(LIST)[0], new AbortController().signal, save);
  expect(remarks).toEqual(['stations as reviewed', 'in metres']);
  expect(await save.mock.calls[0][0].text()).toBe('S001');
  expect(save.mock.calls[0][1]).toBe('stations.csv');
});

test('what the server refuses is told in its own words, and nothing is saved', async () => {
  const refusal = new Response(JSON.stringify({ message: 'pdf: took more than 300 s' }), { status: 422 });
  const save = vi.fn();
  const made = make(new ApiClient(async () => refusal), madeDownloads(LIST)[1], new AbortController().signal, save);
  await expect(made).rejects.toThrow('took more than 300 s');
  expect(save).not.toHaveBeenCalled();
});

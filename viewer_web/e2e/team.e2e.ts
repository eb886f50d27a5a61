/** Several people at one plan, in real browsers: what is done on site, photos of issues, and who else is there. */
import { expect, inject, test } from 'vitest';
import { type ViewerPage, viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';

const { plan } = new PlanFiles(inject('planFolder'));
const [first, second] = plan.route!.order.map((id) => plan.stations.find((one) => one.id === id)!);
const openPage = viewerPages({ width: 1100, height: 760 });

async function openAs(name: string, hash: string): Promise<ViewerPage> {
  const viewer = await openPage();
  await viewer.page.addInitScript((author) => localStorage.setItem('tlsplan-author', author), name);
  await viewer.open(hash);
  return viewer;
}

test('what is done or skipped on site is on markers, in lists and in the field, on every page, and is taken back', async () => {
  const ada = await openAs('Ada', `#tab=plan&floor=${first.floor}&station=${first.id}`);
  const grace = await openAs('Grace', '#tab=plan');
  const card = ada.page.getByRole('complementary', { name: 'Chosen station' });
  await card.getByRole('button', { name: 'Done', exact: true }).click();
  await card.getByText(/^done by Ada on/).waitFor();
  const nameOf = (viewer: ViewerPage, id: string) => viewer.marker(id).getAttribute('aria-label');
  // On the other page without a reload.
  await expect.poll(() => nameOf(grace, first.id)).toMatch(/, done$/);
  expect(await grace.changeAs('Grace', { kind: 'set_progress', station: second.id, state: 'skipped' })).toBe(200);
  await expect.poll(() => nameOf(ada, second.id)).toMatch(/, skipped$/);
  const rows = ada.page.getByRole('list', { name: 'Stations', exact: true });
  await expect
    .poll(() => rows.locator(`[data-station="${first.id}"]`).getByRole('img', { name: 'done' }).count())
    .toBe(1);
  await expect
    .poll(() => rows.locator(`[data-station="${second.id}"]`).getByRole('img', { name: 'skipped' }).count())
    .toBe(1);
  await ada.settle();
  await ada.screenshot('team-1-progress');

  await grace.page.getByRole('button', { name: 'Field view' }).click();
  await expect.poll(() => grace.page.getByTestId('field-count').textContent()).toBe(`1 of ${plan.stations.length}`);
  await expect.poll(() => grace.page.getByLabel(`${first.id} done`).isDisabled()).toBe(true);
  await grace.screenshot('team-2-field');

  await card.getByRole('button', { name: 'Done', exact: true }).click();
  await expect.poll(async () => (await ada.review()).progress[first.id]).toBeUndefined();
  await expect.poll(() => grace.page.getByTestId('field-count').textContent()).toBe(`0 of ${plan.stations.length}`);
  await ada.page.getByRole('tab', { name: 'Edit' }).click();
  await ada.page.getByRole('button', { name: /^Undo/ }).click();
  await expect.poll(async () => (await ada.review()).progress[first.id]?.by).toBe('Ada');
  expect(await grace.changeAs('Grace', { kind: 'set_progress', station: first.id, state: null })).toBe(200);
});

test('a photo goes with a comment: small, without what the camera wrote into it, and it opens large', async () => {
  const viewer = await openAs('Ada', `#tab=review&floor=${first.floor}&station=${first.id}`);
  const { page } = viewer;
  // A landscape of 2400 x 1350, as a camera has it: larger than what is sent.
  const picture = await page.evaluate(async () => {
    const canvas = new OffscreenCanvas(2400, 1350);
    const drawing = canvas.getContext('2d')!;
    const sky = drawing.createLinearGradient(0, 0, 0, 1350);
    sky.addColorStop(0, '#7fa8c9');
    sky.addColorStop(1, '#c9b28a');
    drawing.fillStyle = sky;
    drawing.fillRect(0, 0, 2400, 1350);
    drawing.fillStyle = '#6b4423';
    drawing.fillRect(900, 250, 600, 1100);
    const blob = await canvas.convertToBlob({ type: 'image/png' });
    return [...new Uint8Array(await blob.arrayBuffer())];
  });
  const input = page.getByLabel('Add a photo');
  await input.setInputFiles({ name: 'notes.txt', mimeType: 'image/png', buffer: Buffer.from('no picture') });
  await page.getByText('The file is no picture that this browser can read.').waitFor();
  await input.setInputFiles({ name: 'door.png', mimeType: 'image/png', buffer: Buffer.from(picture) });
  await page.getByRole('button', { name: 'Remove photo' }).waitFor();
  await page.getByLabel('New comment').fill('Door locked, the key is with the janitor');
  await page.getByRole('button', { name: `Pin to ${first.id}`, exact: true }).click();
  await viewer.screenshot('team-3-photo-chosen');
  await page.getByRole('button', { name: 'Comment', exact: true }).click();
  const shown = page.locator('[data-comment]').getByAltText('Photo of the comment');
  await expect.poll(() => shown.evaluate((img) => (img as HTMLImageElement).naturalWidth)).toBe(1600);
  await expect.poll(() => page.getByRole('button', { name: 'Remove photo' }).count()).toBe(0);
  const [comment] = Object.values((await viewer.review()).comments);
  expect(comment).toMatchObject({ target: first.id, photo: expect.stringMatching(/^[0-9a-f]{64}$/) });
  await viewer.screenshot('team-4-photo');
  const opening = page.waitForEvent('popup');
  await page.getByRole('link', { name: 'Photo of the comment' }).click();
  const large = await opening;
  await expect.poll(() => large.evaluate(() => document.images[0]?.naturalHeight)).toBe(900);
  await large.close();
});

test('who else has the plan open is in the head of the page, under the name of now, and gone when they go', async () => {
  const ada = await openAs('Ada Lovelace', '#tab=review');
  const others = ada.page.getByRole('img', { name: /^Also here/ });
  await ada.page.getByRole('tab', { name: 'Review' }).waitFor();
  await expect.poll(() => others.count()).toBe(0);
  const grace = await openAs('Grace', '#tab=review');
  const again = await openAs('Grace', '#tab=plan');
  await expect.poll(() => others.getAttribute('aria-label')).toBe('Also here: Grace');
  const there = grace.page.getByRole('img', { name: 'Also here: Ada Lovelace' });
  await expect.poll(() => there.textContent()).toBe('Also hereAL');
  await again.page.close();
  await grace.page.getByLabel('Your name, for changes and comments').fill('Grace Hopper');
  await expect.poll(() => others.getAttribute('aria-label')).toBe('Also here: Grace Hopper');
  await ada.screenshot('team-5-people');
  await grace.page.close();
  await expect.poll(() => others.count()).toBe(0);
});

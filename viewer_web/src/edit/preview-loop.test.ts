import { expect, test } from 'vitest';
import { Latencies, PreviewLoop } from './preview-loop.ts';

/** A server whose answers come when they are told to. */
function slowServer() {
  const asked: { question: number; answer: () => void; refuse: () => void }[] = [];
  const ask = (question: number): Promise<number> =>
    new Promise((resolve, reject) => {
      asked.push({
        question,
        answer: () => resolve(question * 10),
        refuse: () => reject(new Error(`no ${question}`)),
      });
    });
  return { asked, ask };
}
const settle = (): Promise<void> => new Promise((resolve) => setTimeout(resolve));

function loopOn(server: ReturnType<typeof slowServer>) {
  const shown: number[] = [];
  const failed: string[] = [];
  let clock = 0;
  const loop = new PreviewLoop<number, number>(
    server.ask,
    (answer, askedMs) => shown.push(answer, askedMs),
    (error) => failed.push(error.message),
    () => ++clock,
  );
  return { loop, shown, failed };
}

test('one question is under way at a time, and the newest follows', async () => {
  const server = slowServer();
  const { loop, shown } = loopOn(server);
  for (const question of [1, 2, 3]) loop.put(question);
  expect(server.asked.map(({ question }) => question)).toEqual([1]);
  server.asked[0].answer();
  await settle();
  expect(server.asked.map(({ question }) => question)).toEqual([1, 3]);
  expect(loop.isBusy).toBe(true);
  server.asked[1].answer();
  await settle();
  expect(shown).toEqual([10, 1, 30, 3]);
  expect(loop.isBusy).toBe(false);
});

test('an answer after stop is not shown, and asking goes on afterwards', async () => {
  const server = slowServer();
  const { loop, shown } = loopOn(server);
  loop.put(1);
  loop.stop();
  loop.put(2);
  server.asked[0].answer();
  server.asked[1].answer();
  await settle();
  expect(shown).toEqual([20, 2]);
  expect(loop.isBusy).toBe(false);
});

test('a refused question is told and the newest is asked all the same', async () => {
  const server = slowServer();
  const { loop, shown, failed } = loopOn(server);
  loop.put(1);
  loop.put(2);
  server.asked[0].refuse();
  await settle();
  server.asked[1].answer();
  await settle();
  expect(failed).toEqual(['no 1']);
  expect(shown).toEqual([20, 2]);
});

test('quantiles are values that were measured', () => {
  const latencies = new Latencies();
  expect(latencies.quantile(0.5)).toBeNull();
  for (let ms = 100; ms >= 1; ms--) latencies.add(ms);
  expect([0, 0.5, 0.95, 1].map((q) => latencies.quantile(q))).toEqual([1, 50, 95, 100]);
});

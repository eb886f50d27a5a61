import { join } from 'node:path';
import { IntlMessageFormat } from 'intl-messageformat';
import { expect, test } from 'vitest';
import { loadedWith, sourceTexts, textsOf } from '../testing/source-texts.ts';
import { formatMessage } from './format-message.ts';
import { FIRST } from './german/first.ts';
import { GERMAN } from './german/index.ts';
import { decimal, inSentence, languageOf, loadTexts, type Message, plain, t, translated } from './language.ts';

const TEXTS = sourceTexts(join(import.meta.dirname, '..'));

type Element = ReturnType<IntlMessageFormat['getAst']>[number];

/** Names in braces, those within plurals too. */
function placeholders(message: string): string[] {
  const inside = (elements: readonly Element[]): string[] =>
    elements.flatMap((element) => [
      ...('value' in element && element.type !== 0 ? [element.value as string] : []),
      ...('options' in element ? Object.values(element.options).flatMap(({ value }) => inside(value)) : []),
    ]);
  return [...new Set(inside(new IntlMessageFormat(message, 'en', undefined, { ignoreTag: true }).getAst()))].sort();
}

test('every text of the catalogue is said somewhere, and every text that is said is in it', () => {
  const said = new Set(TEXTS.flatMap(({ messages }) => messages));
  expect(Object.keys(GERMAN).filter((message) => !said.has(message))).toEqual([]);
  expect([...said].filter((message) => !Object.hasOwn(GERMAN, message))).toEqual([]);
});

test.each([
  ['main.tsx', 'field/field-view.tsx'],
  ['load/stage-worker.ts', 'load/stage.ts'],
])('what %s loads has its texts in the part that is loaded first', (file, one) => {
  const sources = loadedWith(file, TEXTS);
  expect(sources.map((source) => source.file)).toContain(one);
  expect(sources.map((source) => source.file)).not.toContain('panels/workspace.tsx');
  const said = sources.flatMap(({ messages }) => messages);
  expect(said.filter((message) => !Object.hasOwn(FIRST, message))).toEqual([]);
});

test.each(Object.entries(GERMAN))('%s has the same placeholders in German', (english, german) => {
  expect(german.trim()).not.toBe('');
  expect(placeholders(german)).toEqual(placeholders(english));
});

test.each(Object.entries(GERMAN))('%s is written as FormatJS writes it, in both languages', (english, german) => {
  for (const n of [0, 1, 2, 12345]) {
    const values = Object.fromEntries(placeholders(english).map((name) => [name, n]));
    for (const [locale, text] of [
      ['en', english],
      ['de', german],
    ]) {
      const oracle = new IntlMessageFormat(text, locale, undefined, { ignoreTag: true }).format(values);
      expect(formatMessage(locale, text, values)).toBe(oracle);
    }
  }
});

test('a message without one of its values is refused', () => {
  expect(() => formatMessage('en', '{n} of {all}', { n: 1 })).toThrow('no value of all');
});

/** Files that say something which is not in the catalogue, and why. */
const BYPASS: Readonly<Record<string, string>> = {
  'api/review-client.ts': 'the name of an unnamed reviewer is kept by the server and compared',
  ...Object.fromEntries(
    ['crate', 'lz4', 'stage', 'schema-check'].map((file) => [
      `load/${file}.ts`,
      'where a damaged file is damaged; mostly in the thread beside the page, which would need a catalogue of its own',
    ]),
  ),
  'language/format-message.ts': 'a call without a value, which the compiler refuses',
  'language/language.ts': 'each language by its own name',
  'heat/layers.ts': 'reasons as plan.json names them',
  'rooms/rooms.ts': 'reasons as plan.json names them',
  'unseen/surfaces.ts': 'reasons as plan.json names them, and names of kinds of lists',
};

test('no text for people bypasses the catalogue', () => {
  const found = TEXTS.filter(({ file }) => BYPASS[file] === undefined).flatMap(({ file, literals }) =>
    literals.map((text) => `${file}: ${text}`),
  );
  expect(found).toEqual([]);
});

test.each([
  ['<p>Two words</p>', 'Two words'],
  ['<p>words</p>', 'words'],
  ['<p>{isOn ? "on" : t("Close")}</p>', 'on'],
  ['<button aria-label="Close" class="icon big">×</button>', 'Close'],
  ['<Figure name={x ? "Area" : null} />', 'Area'],
  // The dollar apart: it is no template here.
  ['<p title={`$' + '{n} open`}>{n}</p>', '{} open'],
  ['warn("No tripod can stand there.")', 'No tripod can stand there.'],
])('%s is found', (code, text) => {
  expect(textsOf('some.tsx', code).literals).toEqual([text]);
});

test('what is no text for people is not found', () => {
  const code = '<p class="note note-warn" data-state="done">{t("Close")} {kind === "some words" ? 1 : 2}</p>';
  expect(textsOf('some.tsx', code)).toMatchObject({ messages: ['Close'], literals: [] });
});

test('the language is the chosen one, then the first of the browser that there is, then English', () => {
  expect(languageOf('de', ['en-US'])).toBe('de');
  expect(languageOf(null, ['fr-FR', 'de-CH', 'en'])).toBe('de');
  expect(languageOf('xx', ['fr'])).toBe('en');
  expect(languageOf('toString', [])).toBe('en');
});

test('tests speak English, and German has its own plurals and numbers', async () => {
  await loadTexts('de', 'first');
  await loadTexts('de', 'rest');
  const stations: Message = '{n, plural, one {# station} other {# stations}}';
  expect(t('{n, plural, one {# station} other {# stations}}', { n: 12345 })).toBe('12,345 stations');
  expect(translated('de', stations, { n: 1 })).toBe('1 Standpunkt');
  expect(translated('de', stations, { n: 12345 })).toBe('12.345 Standpunkte');
  expect(translated('de', 'Close')).toBe('Schließen');
  expect(inSentence('Distance')).toBe('distance');
});

test.each([0.05, 1.005, 2.675, 99.95, 1e6, -0.3, 29.6])('%f is written in the digits of toFixed', (value) => {
  for (const digits of [0, 1, 2, 3]) expect(decimal(value, digits)).toBe(value.toFixed(digits));
  expect(plain(value)).toBe(String(value));
});

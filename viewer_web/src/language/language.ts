/** The language of the page: its texts, and how it writes numbers. English texts are their own keys; docs/decisions/0016 says why. */
import { formatMessage } from './format-message.ts';
import type { GERMAN } from './german/index.ts';

export const LANGUAGES = { en: 'English', de: 'Deutsch' } as const;
export type Language = keyof typeof LANGUAGES;
/** Every text of the viewer, in English. */
export type Message = keyof typeof GERMAN;

/** What stands in the first of a message's braces, and in the rest; branches of plurals have spaces, and are no names. */
type NameIn<Text extends string> = Text extends `${infer Inside}}${string}`
  ? Inside extends `${infer Name},${string}`
    ? Name
    : Inside
  : never;
type Names<Text extends string> = Text extends `${string}{${infer Rest}` ? NameIn<Rest> | Names<Rest> : never;
type Placeholders<Text extends string> = Exclude<Names<Text>, `${string} ${string}`>;
type Values<Text extends string> = [Placeholders<Text>] extends [never]
  ? []
  : [values: Readonly<Record<Placeholders<Text>, string | number>>];

type Texts = Readonly<Partial<Record<Message, string>>>;
/** What a page loads first, which is all that the field view runs, and what comes with the whole plan. */
type Part = 'first' | 'rest';

/** Each in a file of its own, fetched where it is needed. */
const OTHERS: Readonly<Record<Exclude<Language, 'en'>, Readonly<Record<Part, () => Promise<Texts>>>>> = {
  de: {
    first: async () => (await import('./german/first.ts')).FIRST,
    rest: async () => (await import('./german/rest.ts')).REST,
  },
};
const loaded = new Map<Language, Texts>();
const KEY = 'tlsplan-language';

const isLanguage = (name: string | null): name is Language => name !== null && Object.hasOwn(LANGUAGES, name);

/** What was chosen, or else the first of the browser's languages that there is; English otherwise. */
export function languageOf(chosen: string | null, preferred: readonly string[]): Language {
  if (isLanguage(chosen)) return chosen;
  return preferred.map((tag) => tag.split('-')[0].toLowerCase()).find(isLanguage) ?? 'en';
}

/** Set once, before any text is asked for: no page is half in one language and half in another. Tests have no page: English. */
export const language: Language =
  typeof document === 'undefined' ? 'en' : languageOf(window.localStorage.getItem(KEY), navigator.languages);

/** Have a part of the texts of a language at hand. */
export async function loadTexts(to: Language, part: Part): Promise<void> {
  if (to === 'en') return;
  const texts = await OTHERS[to][part]();
  loaded.set(to, { ...loaded.get(to), ...texts });
}
// Modules that import this one wait for it: their texts are looked up as they are loaded.
await loadTexts(language, 'first');

/** Keep it, and show the page in it. The address holds what is shown. */
export function chooseLanguage(chosen: Language): void {
  window.localStorage.setItem(KEY, chosen);
  window.location.reload();
}

/** A text in a language, with its values; numbers that are not counted come written, see `decimal`. */
export function translated(to: Language, message: Message, values?: Readonly<Record<string, string | number>>): string {
  const text = loaded.get(to)?.[message] ?? message;
  return values === undefined ? text : formatMessage(to, text, values);
}

/** Of a text that the catalogue does not have; the compiler names it where it refuses the text. */
type Known<Text> = Text extends Message ? unknown : { readonly 'has no line in src/language/german': true };

/** A text in the language of the page. */
export function t<Text extends string>(message: Text & Known<Text>, ...values: Values<Text>): string {
  return translated(language, message as string as Message, values[0]);
}

const numberFormats = new Map<number | null, Intl.NumberFormat>();

/** Making one takes longer than using it, and lists have hundreds of figures. */
function numberFormat(digits: number | null): Intl.NumberFormat {
  const limits =
    digits === null ? { maximumFractionDigits: 20 } : { minimumFractionDigits: digits, maximumFractionDigits: digits };
  const format = numberFormats.get(digits) ?? new Intl.NumberFormat(language, { ...limits, useGrouping: false });
  numberFormats.set(digits, format);
  return format;
}

/** With so many decimals, in the digits that `toFixed` gives: the library rounds so too. */
export const decimal = (value: number, digits: number): string =>
  numberFormat(digits).format(Number(value.toFixed(digits)));
/** With as many decimals as it has. */
export const plain = (value: number): string => numberFormat(null).format(value);

/** Between numbers that may have a comma themselves. */
export const separator = language === 'de' ? '; ' : ', ';
/** English dates are those of Europe: day before month. */
export const dateLocale = language === 'en' ? 'en-GB' : language;
/** A title as it stands within a sentence: German nouns keep their capital. */
export const inSentence = (title: string): string => (language === 'de' ? title : title.toLowerCase());

/**
 * ICU messages as the viewer's texts use them: `{name}`, and `{n, plural, one {# station} other {# stations}}`.
 *
 * No more of ICU than that: readers of all of it are a third of what the field view loads. language.test.ts holds every text
 * against one of them.
 */

export type MessageValues = Readonly<Record<string, string | number>>;

const ARGUMENT = /\{(\w+)(, plural,)?\s*/y;
const BRANCH = /\s*(\w+) \{/y;

export function formatMessage(locale: string, message: string, values: MessageValues): string {
  let at = 0;
  const match = (pattern: RegExp): RegExpExecArray | null => {
    pattern.lastIndex = at;
    const found = pattern.exec(message);
    if (found !== null) at = pattern.lastIndex;
    return found;
  };
  /** What stands up to the brace that ends it, or to the end; `counted`: what # stands for. */
  const text = (counted: number | null): string => {
    let written = '';
    while (at < message.length && message[at] !== '}') {
      if (message[at] === '{') written += argument();
      else {
        written +=
          message[at] === '#' && counted !== null ? new Intl.NumberFormat(locale).format(counted) : message[at];
        at++;
      }
    }
    at++;
    return written;
  };
  const argument = (): string => {
    const [, name, plural] = match(ARGUMENT) ?? [];
    const value = name === undefined ? undefined : values[name];
    if (value === undefined) throw new RangeError(`message ${message}: no value of ${name}`);
    if (plural === undefined) {
      at++;
      return String(value);
    }
    const branches = new Map<string, string>();
    for (let branch = match(BRANCH); branch !== null; branch = match(BRANCH))
      branches.set(branch[1], text(Number(value)));
    at++;
    return branches.get(new Intl.PluralRules(locale).select(Number(value))) ?? branches.get('other') ?? '';
  };
  return text(null);
}

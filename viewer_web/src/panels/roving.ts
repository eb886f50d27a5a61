/** One stop for Tab in a whole bar: left and right go through it, Home and End to its ends (the toolbar pattern of WAI-ARIA). */
import type { RefObject } from 'preact';
import { useEffect } from 'preact/hooks';

const CONTROLS = ':is(button,select):enabled';

/** How far a key goes among `n` controls from the one at `at`; null: it is none of these keys. */
export function rovedTo(key: string, at: number, n: number): number | null {
  if (key === 'ArrowRight') return (at + 1) % n;
  if (key === 'ArrowLeft') return (at + n - 1) % n;
  if (key === 'Home') return 0;
  return key === 'End' ? n - 1 : null;
}

export function useRoving(bar: RefObject<HTMLElement | null>): void {
  // After each drawing: what is switched off, or no longer there, can't be the stop.
  useEffect(() => {
    if (bar.current !== null) chooseStop(bar.current, null);
  });
  useEffect(() => {
    const element = bar.current;
    if (element === null) return undefined;
    const onFocus = ({ target }: Event): void => {
      if (controlsOf(element).includes(target as HTMLElement)) chooseStop(element, target as HTMLElement);
    };
    const onKey = (event: KeyboardEvent): void => {
      if (event.altKey || event.ctrlKey || event.metaKey || event.shiftKey) return;
      const all = controlsOf(element);
      const at = all.indexOf(event.target as HTMLElement);
      const to = at < 0 ? null : rovedTo(event.key, at, all.length);
      if (to === null) return;
      // Elsewhere these keys go through the stations, or choose in a list.
      event.preventDefault();
      event.stopPropagation();
      all[to].focus();
    };
    element.addEventListener('focusin', onFocus);
    element.addEventListener('keydown', onKey);
    return () => {
      element.removeEventListener('focusin', onFocus);
      element.removeEventListener('keydown', onKey);
    };
  }, [bar]);
}

/** Not those of an open popover: they are stops of their own. */
const controlsOf = (bar: HTMLElement): HTMLElement[] =>
  [...bar.querySelectorAll<HTMLElement>(CONTROLS)].filter((one) => one.closest('[data-popover]') === null);

function chooseStop(bar: HTMLElement, chosen: HTMLElement | null): void {
  const all = controlsOf(bar);
  const stop = chosen ?? all.find((one) => one.tabIndex === 0 && one.dataset.stop === 'true') ?? all[0];
  for (const one of all) {
    one.tabIndex = one === stop ? 0 : -1;
    one.dataset.stop = String(one === stop);
  }
}

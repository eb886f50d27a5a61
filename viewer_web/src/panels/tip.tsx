/** What a button of a bar does, and its key: shown below it where the pointer rests on it, or keys bring the focus there. */
import type { RefObject } from 'preact';
import { useEffect, useState } from 'preact/hooks';

/** Long enough not to flicker on the way across the bar. */
const REST_MS = 350;
const MARGIN_PX = 8;

/** What makes a button have a tip. */
export const tipOf = (hint: string, key?: string) => ({
  'data-tip': hint,
  ...(key === undefined ? {} : { 'aria-keyshortcuts': key, 'data-tip-key': key }),
});

export function Tip({ bar }: { bar: RefObject<HTMLElement | null> }) {
  const [shown, setShown] = useState<HTMLElement | null>(null);
  useEffect(() => {
    const element = bar.current;
    if (element === null) return undefined;
    const listening = new AbortController();
    const { signal } = listening;
    let pending = 0;
    const hide = (): void => {
      window.clearTimeout(pending);
      setShown(null);
    };
    const tipped = ({ target }: Event): HTMLElement | null =>
      target instanceof Element ? target.closest<HTMLElement>('[data-tip]') : null;
    element.addEventListener(
      'pointerover',
      (event) => {
        window.clearTimeout(pending);
        const one = tipped(event);
        if (event.pointerType === 'mouse') pending = window.setTimeout(() => setShown(one), one === null ? 0 : REST_MS);
      },
      { signal },
    );
    element.addEventListener('pointerleave', hide, { signal });
    element.addEventListener('pointerdown', hide, { signal });
    element.addEventListener(
      'focusin',
      (event) => tipped(event)?.matches(':focus-visible') && setShown(tipped(event)),
      {
        signal,
      },
    );
    element.addEventListener('focusout', hide, { signal });
    // It covers nothing that Escape would be meant for first.
    window.addEventListener('keydown', ({ key }) => key === 'Escape' && hide(), { signal, capture: true });
    return () => {
      window.clearTimeout(pending);
      listening.abort();
    };
  }, [bar]);
  if (shown === null || !shown.isConnected || shown.getAttribute('aria-expanded') === 'true') return null;
  const { tip, tipKey } = shown.dataset;
  return (
    <div class="tip" role="tooltip" ref={(one) => placeBelow(one, shown, bar.current)}>
      {tip}
      {tipKey !== undefined && <kbd>{tipKey}</kbd>}
    </div>
  );
}

/** In the middle below a button, or as near as the window lets it. */
function placeBelow(tip: HTMLElement | null, button: HTMLElement, bar: HTMLElement | null): void {
  if (tip === null || bar === null) return;
  const [from, at] = [bar.getBoundingClientRect(), button.getBoundingClientRect()];
  const middle = at.left + at.width / 2 - tip.offsetWidth / 2;
  const left = Math.max(MARGIN_PX, Math.min(middle, window.innerWidth - tip.offsetWidth - MARGIN_PX));
  tip.style.transform = `translate(${Math.round(left - from.left)}px, ${Math.round(at.bottom - from.top + 6)}px)`;
}

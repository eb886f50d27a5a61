/**
 * A cross over the building for those who have no pointer: with the picture in focus, arrows move it, and Space clicks there.
 * So every tool that asks for a place can be used by keys. It shows where the focus came by keys, and not where it was clicked.
 */
import type { RefObject } from 'preact';
import { useEffect, useState } from 'preact/hooks';
import { t } from '../language/language.ts';
import './key-cursor.css';
import { type Cursor, movedCursor } from './moved-cursor.ts';

export function KeyCursor({ canvas }: { canvas: RefObject<HTMLCanvasElement | null> }) {
  const [cursor, setCursor] = useState<Cursor | null>(null);
  useEffect(() => {
    const picture = canvas.current;
    if (picture === null) return undefined;
    const listening = new AbortController();
    const { signal } = listening;
    let at: Cursor | null = null;
    const put = (next: Cursor | null): void => {
      at = next;
      setCursor(next);
    };
    const isOurs = new WeakSet<Event>();
    const point = (type: string): void => {
      if (at === null) return;
      const box = picture.getBoundingClientRect();
      const event = new PointerEvent(type, {
        ...{ clientX: box.x + at.x, clientY: box.y + at.y, pointerId: 1, pointerType: 'mouse' },
        ...{ isPrimary: true, button: type === 'pointermove' ? -1 : 0, bubbles: true, cancelable: true },
      });
      isOurs.add(event);
      picture.dispatchEvent(event);
    };
    const middle = (): Cursor => ({ x: picture.clientWidth / 2, y: picture.clientHeight / 2 });
    picture.addEventListener('focus', () => picture.matches(':focus-visible') && put(at ?? middle()), { signal });
    picture.addEventListener('blur', () => put(null), { signal });
    picture.addEventListener(
      'keydown',
      (event) => {
        if (at === null || event.ctrlKey || event.metaKey || event.altKey || event.shiftKey) return;
        if (event.key === ' ') {
          point('pointerdown');
          point('pointerup');
        } else {
          const next = movedCursor(at, event.key, event.repeat, picture.clientWidth, picture.clientHeight);
          if (next === null) return;
          put(next);
          point('pointermove');
        }
        event.preventDefault();
        event.stopPropagation();
      },
      { signal },
    );
    // The camera's controls would hold on to a pointer that there is none of. They listen after this.
    const keepFromCamera = (event: Event): void => {
      if (isOurs.has(event)) event.stopImmediatePropagation();
    };
    picture.addEventListener('pointerdown', keepFromCamera, { signal, capture: true });
    return () => listening.abort();
  }, [canvas]);
  if (cursor === null) return null;
  return (
    <>
      <div
        class="key-cursor"
        aria-hidden="true"
        ref={(cross) => {
          if (cross !== null) cross.style.transform = `translate(${cursor.x}px, ${cursor.y}px)`;
        }}
      />
      <p class="key-cursor-hint" role="status">
        {t('Arrows move the cross, Space clicks there.')}
      </p>
    </>
  );
}

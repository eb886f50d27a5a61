/** A button and what it opens over the page: closed by Escape, which leaves the focus on the button, and by a press elsewhere. */
import { useSignal } from '@preact/signals';
import type { ComponentChildren } from 'preact';
import { useEffect, useRef } from 'preact/hooks';
import { closeOnEscape } from './escape.ts';
import { Icon, type IconName } from './icons.tsx';
import { tipOf } from './tip.tsx';

interface PopoverProps {
  readonly id: string;
  /** Of the button. */
  readonly name: string;
  readonly hint: string;
  readonly icon: IconName;
  /** Of what it opens. */
  readonly title: string;
  readonly className: string;
  readonly children: (close: () => void) => ComponentChildren;
}

export function Popover({ id, name, hint, icon, title, className, children }: PopoverProps) {
  const isOpen = useSignal(false);
  const whole = useRef<HTMLDivElement>(null);
  const button = useRef<HTMLButtonElement>(null);
  const close = (): void => {
    isOpen.value = false;
  };
  useEffect(() => {
    if (!isOpen.value) return undefined;
    const stop = closeOnEscape(() => {
      close();
      button.current?.focus();
    });
    const leave = (event: Event): void => {
      if (!whole.current?.contains(event.target as Node)) close();
    };
    document.addEventListener('pointerdown', leave, { capture: true });
    return () => {
      stop();
      document.removeEventListener('pointerdown', leave, { capture: true });
    };
  }, [isOpen.value]);
  return (
    <div class={`popover ${className}`} ref={whole}>
      <button
        id={id}
        ref={button}
        type="button"
        class="tool-button"
        aria-label={name}
        aria-expanded={isOpen.value}
        {...tipOf(hint)}
        onClick={() => {
          isOpen.value = !isOpen.value;
        }}
      >
        <Icon name={icon} />
        <span class="tool-name">{name}</span>
      </button>
      {isOpen.value && (
        <section class="popover-page" aria-label={title} data-popover>
          {children(close)}
        </section>
      )}
    </div>
  );
}

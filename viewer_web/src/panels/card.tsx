/** A card over the canvas about what is chosen. */

import type { ComponentChildren } from 'preact';
import { t } from '../language/language.ts';

interface CardProps {
  readonly title: string;
  readonly subtitle: string;
  /** What the card is, for screen readers. */
  readonly name: string;
  readonly onClose: () => void;
  readonly children: ComponentChildren;
}

export function Card({ title, subtitle, name, onClose, children }: CardProps) {
  return (
    <aside class="card" aria-label={name} aria-live="polite">
      <header>
        <div>
          <h2>{title}</h2>
          <p class="muted">{subtitle}</p>
        </div>
        <button type="button" class="icon" aria-label={t('Close')} onClick={onClose}>
          ×
        </button>
      </header>
      {children}
    </aside>
  );
}

/** A titled part of a panel. */
import type { ComponentChildren } from 'preact';

export function Section({ title, aside, children }: { title: string; aside?: string; children: ComponentChildren }) {
  return (
    <section class="section">
      <header class="section-head">
        <h2>{title}</h2>
        {aside !== undefined && <span class="muted">{aside}</span>}
      </header>
      {children}
    </section>
  );
}

/** Name and value of one figure; `hint` says what it is a figure of. */
export function Figure({ name, value, hint }: { name: string; value: ComponentChildren; hint?: string }) {
  return (
    <div class="figure" title={hint}>
      <dt>{name}</dt>
      <dd>{value}</dd>
    </div>
  );
}

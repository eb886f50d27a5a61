/** What the card of an element offers: its GlobalId to copy, and the element alone or through the others. */

import { useState } from 'preact/hooks';
import { t } from '../language/language.ts';
import { Figure } from '../panels/section.tsx';
import { whyNoPicture } from '../scene/state.ts';
import type { Store } from '../store.ts';
import type { Isolation } from './state.ts';

/** What finds the element again in the model; of IFC its GlobalId. */
export function SourceId({ id, isIfc }: { id: string; isIfc: boolean }) {
  const [copied, setCopied] = useState<'no' | 'yes' | 'failed'>('no');
  if (id === '') return null;
  const copy = (): void => {
    navigator.clipboard.writeText(id).then(
      () => setCopied('yes'),
      () => setCopied('failed'),
    );
  };
  return (
    <Figure
      name={isIfc ? t('GlobalId') : t('Id in the file')}
      value={
        <>
          <code class="source-id">{id}</code>{' '}
          <button type="button" class="link" onClick={copy}>
            {{ no: t('Copy'), yes: t('Copied'), failed: t('Select it to copy') }[copied]}
          </button>
        </>
      }
    />
  );
}

export function IsolationButtons({ store }: { store: Store }) {
  const off = whyNoPicture(store);
  const choices: readonly (readonly [Isolation, string])[] = [
    ['alone', t('Isolate')],
    ['xray', t('X-ray')],
  ];
  return (
    <div class="buttons">
      {choices.map(([isolation, words]) => (
        <button
          key={isolation}
          type="button"
          class="button button-small"
          aria-pressed={store.isolation.value === isolation}
          disabled={off !== null}
          title={off ?? undefined}
          onClick={() => {
            store.isolation.value = store.isolation.value === isolation ? 'none' : isolation;
          }}
        >
          {words}
        </button>
      ))}
    </div>
  );
}

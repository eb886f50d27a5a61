/** The list of files of a scene of several: which ones are drawn. */
import { t } from '../language/language.ts';
import { Section } from '../panels/section.tsx';
import { whyNoPicture } from '../scene/state.ts';
import type { Store } from '../store.ts';

export function FileList({ store }: { store: Store }) {
  const files = store.loaded.value?.stage.files ?? [];
  if (files.length < 2) return null;
  const off = whyNoPicture(store);
  return (
    <Section title={t('Files')}>
      <fieldset class="controls" aria-label={t('Files')} disabled={off !== null} title={off ?? undefined}>
        {files.map((name, file) => (
          <label key={file} class="check" title={name}>
            <input
              type="checkbox"
              checked={!store.hiddenFiles.value.has(file)}
              onChange={(event) => store.showFile(file, event.currentTarget.checked)}
            />
            {name}
          </label>
        ))}
      </fieldset>
    </Section>
  );
}

/** Takes in what a crew saved from the field file. */

import type { ReviewClient } from '../api/review-client.ts';
import { stationsOf } from '../edit/draft-follower.ts';
import { t } from '../language/language.ts';
import { Section } from '../panels/section.tsx';
import type { Store } from '../store.ts';
import { changesOfField, readFieldResult } from './field-result.ts';

export function FieldResultSection({ store, reviewClient }: { store: Store; reviewClient: ReviewClient }) {
  const take = async (file: File): Promise<void> => {
    try {
      const result = readFieldResult(await file.text());
      if (result.planSha256 !== reviewClient.session.peek()?.plan_sha256) {
        throw new Error(
          t('The field result is of another plan than this one. Open the plan that the field file was made of.'),
        );
      }
      // Who changed a station since the file was made is told of, not overwritten.
      const changes = changesOfField(result, stationsOf(store));
      await reviewClient.commit(t('take in a field result'), changes, result.revision);
    } catch (error) {
      reviewClient.warn((error as Error).message);
    }
  };
  return (
    <Section title={t('Field result')}>
      <label class="field">
        {t('What the crew saved from the field file')}
        <input
          type="file"
          accept=".json,application/json"
          onChange={({ currentTarget }) => {
            const [file] = currentTarget.files ?? [];
            if (file !== undefined) void take(file);
            currentTarget.value = '';
          }}
        />
      </label>
    </Section>
  );
}

/** Takes in what a crew saved from the field file: where it moved stations, each move is accepted or rejected first. */

import { useState } from 'preact/hooks';
import type { ReviewClient } from '../api/review-client.ts';
import { fetchGround, GROUND } from '../edit/ground-map.ts';
import { isLive } from '../edit/readiness.ts';
import { stationsOf } from '../edit/review-stations.ts';
import { t } from '../language/language.ts';
import { coordinatesWords, lengthWords } from '../panels/figures.ts';
import { Section } from '../panels/section.tsx';
import type { Store } from '../store.ts';
import { changesOfField, type FieldMove, type FieldResult, movesOfField, readFieldResult } from './field-result.ts';

export function FieldResultSection({ store, reviewClient }: { store: Store; reviewClient: ReviewClient }) {
  const [pending, setPending] = useState<Pending | null>(null);
  const take = async ({ result, rejected }: Pending): Promise<void> => {
    setPending(null);
    try {
      // Who changed a station since the file was made is told of, not overwritten.
      const changes = changesOfField(result, stationsOf(store), rejected, reviewClient.review.peek()?.progress);
      await reviewClient.commit(t('take in a field result'), changes, result.revision);
    } catch (error) {
      reviewClient.warn((error as Error).message);
    }
  };
  const read = async (file: File): Promise<void> => {
    try {
      const result = readFieldResult(await file.text());
      if (result.planSha256 !== reviewClient.session.peek()?.plan_sha256) {
        throw new Error(
          t('The field result is of another plan than this one. Open the plan that the field file was made of.'),
        );
      }
      const moves = movesOfField(result, stationsOf(store));
      const walled = new Set(await withoutTripod(store, reviewClient, moves));
      const read = { result, moves, walled, rejected: walled };
      if (moves.length === 0) await take(read);
      else setPending(read);
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
            if (file !== undefined) void read(file);
            currentTarget.value = '';
          }}
        />
      </label>
      {pending !== null && <Moves pending={pending} onChange={setPending} onTake={() => void take(pending)} />}
    </Section>
  );
}

interface Pending {
  readonly result: FieldResult;
  readonly moves: readonly FieldMove[];
  /** Ids of those that stood where no tripod can. */
  readonly walled: ReadonlySet<string>;
  /** By id. */
  readonly rejected: ReadonlySet<string>;
}

/** Ids of moves to where no tripod can stand, as the live side has it; none where it does not compute. */
async function withoutTripod(store: Store, { client }: ReviewClient, moves: readonly FieldMove[]): Promise<string[]> {
  if (!isLive(store)) return [];
  const floors = [...new Set(moves.map(({ station }) => station.floorId))];
  const grounds = await Promise.all(floors.map((floorId) => fetchGround(client, floorId)));
  return moves
    .filter(({ station, to }) => grounds[floors.indexOf(station.floorId)].at(to) !== GROUND.admissible)
    .map(({ station }) => station.id);
}

interface MovesProps {
  readonly pending: Pending;
  readonly onChange: (pending: Pending | null) => void;
  readonly onTake: () => void;
}

function Moves({ pending, onChange, onTake }: MovesProps) {
  const { moves, walled, rejected } = pending;
  const accept = (id: string, isAccepted: boolean): void => {
    const others = [...rejected].filter((one) => one !== id);
    onChange({ ...pending, rejected: new Set(isAccepted ? others : [...others, id]) });
  };
  return (
    <fieldset class="field-moves">
      <legend>{t('Moved on site: tick what is to be moved in the plan')}</legend>
      <ul>
        {moves.map(({ station: { id, positionM }, to, awayM }) => (
          <li key={id}>
            <label class="check">
              <input
                type="checkbox"
                aria-label={t('Move {id} in the plan', { id })}
                checked={!rejected.has(id)}
                onChange={({ currentTarget }) => accept(id, currentTarget.checked)}
              />
              {t('{id}: x, y {from} to {to}, {length} away', {
                id,
                from: coordinatesWords(positionM.slice(0, 2)),
                to: coordinatesWords(to),
                length: lengthWords(awayM),
              })}
            </label>
            {walled.has(id) && (
              <p class="change-down">{t('No tripod stands there: walls or furniture are too near.')}</p>
            )}
          </li>
        ))}
      </ul>
      <div class="chips">
        <button type="button" onClick={onTake}>
          {t('Take in the result')}
        </button>
        <button type="button" onClick={() => onChange(null)}>
          {t('Cancel')}
        </button>
      </div>
    </fieldset>
  );
}

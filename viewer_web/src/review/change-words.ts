/** What became of an object that somebody changed, in words: "Station S001 moved". */

import type { Review, StationEdit } from '../api/documents.ts';
import { ENTRANCE_WORDS } from '../edit/entrance-words.ts';
import { t } from '../language/language.ts';

/** So much of a comment tells which it is. */
const MOST_LETTERS = 40;

/** `object` as `touched` of a review names it; where nothing is left of it, what was changed is that it went. */
export function changeInWords(object: string, review: Review): string {
  const [kind, id = ''] = object.split(':');
  switch (kind) {
    case 'station':
      return t('Station {id} {change}', { id, change: editInWords(review.stations[id]) });
    case 'verdict':
      return verdictInWords(id, review.verdicts[id]?.verdict);
    case 'progress':
      return progressInWords(id, review.progress[id]?.state);
    case 'comment':
      return commentInWords(review.comments[id]);
    case 'zone':
      return zoneInWords(review.zones[id]);
    case 'forbidden':
      return review.forbidden[id] === undefined ? t('Position allowed again') : t('Position forbidden');
    case 'pick': {
      const pick = review.ground_picks[id];
      return pick === undefined
        ? t('Floor mark removed')
        : pick.is_ground
          ? t('Walkable floor marked')
          : t('Marked as not a floor');
    }
    case 'entrance':
      return review.entrances[id] === undefined ? ENTRANCE_WORDS.entranceRemoved : ENTRANCE_WORDS.entranceSet;
    case 'door': {
      const state = review.doors[id];
      return state === undefined ? ENTRANCE_WORDS.doorAsPlanned : ENTRANCE_WORDS.doorMarked(state);
    }
    case 'sign_off':
      return review.sign_off === null ? t('Sign-off withdrawn') : t('Signed off');
    default:
      return object.replaceAll('_', ' ');
  }
}

function verdictInWords(id: string, verdict: string | undefined): string {
  if (verdict === undefined) return t('Station {id} no longer has a verdict', { id });
  return verdict === 'accepted' ? t('Station {id} accepted', { id }) : t('Station {id} rejected', { id });
}

function progressInWords(id: string, state: string | undefined): string {
  if (state === undefined) return t('Station {id} neither done nor skipped', { id });
  return state === 'done' ? t('Station {id} done', { id }) : t('Station {id} skipped', { id });
}

function editInWords(edit: StationEdit | undefined): string {
  if (edit === undefined) return t('back as planned');
  if (edit.removed) return t('removed');
  const done = [
    edit.added ? t('added') : edit.position_m !== null ? t('moved') : '',
    edit.locked === true ? t('locked') : edit.locked === false ? t('unlocked') : '',
  ];
  return done.filter(Boolean).join(` ${t('and')} `) || t('changed');
}

function commentInWords(comment: Review['comments'][string] | undefined): string {
  if (comment === undefined) return t('Comment removed');
  const { text, resolved } = comment;
  const [line] = text.split('\n');
  const short = line.length > MOST_LETTERS ? `${line.slice(0, MOST_LETTERS).trimEnd()}…` : line;
  return `${resolved ? t('Comment resolved') : t('Comment')}: “${short}”`;
}

function zoneInWords(zone: Review['zones'][string] | undefined): string {
  if (zone === undefined) return t('Zone removed');
  const kind = zone.kind === 'keep_out' ? t('Keep-out zone') : t('Priority zone');
  return zone.name === '' ? t('{kind} drawn', { kind }) : t('{kind} “{name}” drawn', { kind, name: zone.name });
}

/** What became of an object that somebody changed, in words: "Station S001 moved". */
import type { Review, StationEdit } from '../api/documents.ts';
import { ENTRANCE_WORDS } from '../edit/entrance-words.ts';

/** So much of a comment tells which it is. */
const MOST_LETTERS = 40;

/** `object` as `touched` of a review names it; where nothing is left of it, what was changed is that it went. */
export function changeInWords(object: string, review: Review): string {
  const [kind, id = ''] = object.split(':');
  switch (kind) {
    case 'station':
      return `Station ${id} ${editInWords(review.stations[id])}`;
    case 'verdict':
      return `Station ${id} ${review.verdicts[id]?.verdict ?? 'no longer has a verdict'}`;
    case 'comment':
      return commentInWords(review.comments[id]);
    case 'zone':
      return zoneInWords(review.zones[id]);
    case 'forbidden':
      return review.forbidden[id] === undefined ? 'Position allowed again' : 'Position forbidden';
    case 'pick': {
      const pick = review.ground_picks[id];
      return pick === undefined
        ? 'Floor mark removed'
        : pick.is_ground
          ? 'Walkable floor marked'
          : 'Marked as not a floor';
    }
    case 'entrance':
      return review.entrances[id] === undefined ? ENTRANCE_WORDS.entranceRemoved : ENTRANCE_WORDS.entranceSet;
    case 'door': {
      const state = review.doors[id];
      return state === undefined ? ENTRANCE_WORDS.doorAsPlanned : ENTRANCE_WORDS.doorMarked(state);
    }
    case 'sign_off':
      return review.sign_off === null ? 'Sign-off withdrawn' : 'Signed off';
    default:
      return object.replaceAll('_', ' ');
  }
}

function editInWords(edit: StationEdit | undefined): string {
  if (edit === undefined) return 'back as planned';
  if (edit.removed) return 'removed';
  const done = [
    edit.added ? 'added' : edit.position_m !== null ? 'moved' : '',
    edit.locked === true ? 'locked' : edit.locked === false ? 'unlocked' : '',
  ];
  return done.filter(Boolean).join(' and ') || 'changed';
}

function commentInWords(comment: Review['comments'][string] | undefined): string {
  if (comment === undefined) return 'Comment removed';
  const { text, resolved } = comment;
  const [line] = text.split('\n');
  const short = line.length > MOST_LETTERS ? `${line.slice(0, MOST_LETTERS).trimEnd()}…` : line;
  return `${resolved ? 'Comment resolved' : 'Comment'}: “${short}”`;
}

function zoneInWords(zone: Review['zones'][string] | undefined): string {
  if (zone === undefined) return 'Zone removed';
  const kind = zone.kind === 'keep_out' ? 'Keep-out zone' : 'Priority zone';
  return zone.name === '' ? `${kind} drawn` : `${kind} “${zone.name}” drawn`;
}

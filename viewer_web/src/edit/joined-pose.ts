/** Two people's changes of one station, where they touch different things of it: where it stands, and how high. Scene frame. */
import type { Pose } from './changes.ts';
import type { DraftStation } from './draft.ts';

/** Places are kept to 0.1 mm. */
const SAME_M = 2e-4;

/**
 * My place with their height, or my height at their place; null: both changed the same, or nothing of both can be kept.
 * `before`: the station as I saw it when I began.
 */
export function joinedPose(before: DraftStation, mine: Pose, theirs: DraftStation): Pose | null {
  if (theirs.isRemoved || theirs.isLocked) return null;
  const [mineM, theirsM] = [mine.instrument_height_m, theirs.instrumentHeightM];
  if (mineM === null || theirsM === null) return null;
  const iMoved = isElsewhere(mine.position_m, mine.floor, before);
  const theyMoved = isElsewhere(theirs.positionM, theirs.floorId, before);
  const [iRaised, theyRaised] = [isOther(mineM, before.instrumentHeightM), isOther(theirsM, before.instrumentHeightM)];
  if (iMoved && theyRaised && !iRaised && !theyMoved) {
    const [x, y, z] = mine.position_m;
    return { position_m: [x, y, z - mineM + theirsM], instrument_height_m: theirsM, floor: mine.floor };
  }
  if (iRaised && theyMoved && !iMoved && !theyRaised) {
    const [x, y, z] = theirs.positionM;
    return { position_m: [x, y, z - theirsM + mineM], instrument_height_m: mineM, floor: theirs.floorId };
  }
  return null;
}

const isOther = (heightM: number, than: number | null): boolean => than === null || Math.abs(heightM - than) > SAME_M;

function isElsewhere([x, y]: readonly number[], floorId: string, { positionM, floorId: was }: DraftStation): boolean {
  return floorId !== was || Math.hypot(x - positionM[0], y - positionM[1]) > SAME_M;
}

/** Parts of an unseen piece that a view of it is judged by. */
import type { UnseenSurface } from '../load/plan-json.ts';
import type { Stage, StageElement } from '../load/stage.ts';
import type { PatchPlaces } from './patch-places.ts';
import type { PiecePart, PieceToSee } from './viewpoint.ts';

type Piece = UnseenSurface['pieces'][number];

/** A view is judged by so many places: each costs a ray, and each view that is tried as many. */
const MOST_PARTS = 16;
/** A piece's box says where its patches lie to the micrometre, and middles of patches lie inside it. */
const BOX_SLACK_M = 1e-3;
/** Of bent pieces what faces otherwise is seen from elsewhere. */
const SAME_WAY_COS = 0.5;

/** The box of a piece in the local frame, a little larger. */
export function boxOf({ box }: Piece, offsetM: Stage['offsetM']): readonly [readonly number[], readonly number[]] {
  const corner = (at: readonly number[], by: number): number[] => at.map((x, k) => x - offsetM[k] + by);
  return [corner(box[0], -BOX_SLACK_M), corner(box[1], BOX_SLACK_M)];
}

/** What of the element lies in the piece's box and faces as its middle does; null: the stage has no such patch. */
export function partsOf(
  piece: Piece,
  element: StageElement | undefined,
  { offsetM }: Pick<Stage, 'offsetM'>,
  places: PatchPlaces,
  bodySide: Int8Array,
): PieceToSee | null {
  const frontOf = (patch: number): PiecePart | null => {
    const place = places.placeOf(patch);
    const isInsideOut = bodySide[places.triangleOf(patch)] < 0;
    return place && isInsideOut ? { ...place, normal: place.normal.negate() } : place;
  };
  const middle = frontOf(piece.patch);
  if (middle === null || element === undefined) return null;
  const others = places.patchesIn(element, boxOf(piece, offsetM), (patch) => patch !== piece.patch);
  const every = Math.ceil(others.length / (MOST_PARTS - 1));
  const parts = others
    .filter((_, i) => i % every === 0)
    .flatMap((patch) => frontOf(patch) ?? [])
    .filter(({ normal }) => normal.dot(middle.normal) > SAME_WAY_COS);
  const sizeM = Math.hypot(...[0, 1, 2].map((k) => piece.box[1][k] - piece.box[0][k]));
  return { parts: [middle, ...parts], isOneSided: bodySide[places.triangleOf(piece.patch)] !== 0, sizeM };
}

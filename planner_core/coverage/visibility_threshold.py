"""What of a patch counts, and when it counts as seen: docs/method/coverage.md.

Patches end inside walls, below floors and behind furniture. Of each, what candidates together can see counts, and a
position sees the patch where it sees enough of that. At half, as much is rounded up as down for positions that nobody
chose; a plan chooses those for which more is rounded up, so that it is a little more than half.

Samples lie alike in all patches, so that where all cuts are alike, as along a wall, one sample more or less on each is
a fault of the whole. Of patches that something cuts, how much is seen together is therefore counted at points of their
own (`shares_of_cut_patches`), shifted from patch to patch: what is too much on one is too little on the next.
"""

from __future__ import annotations

import numpy as np

from planner_core.engine.open_engine import engine_facts
from planner_core.engine.patch_samples import (
    SLACK,
    SLACK_MOST,
    UInt32Array,
    in_view,
    places_of,
    rounding_of,
    share_of,
    view_of,
)
from planner_core.engine.scan_engine import ScanEngine
from planner_core.kept import hash_of, hash_of_scene, kept
from planner_core.model import BoolArray, FloatArray, Int32Array, Int64Array, Survey, UInt8Array, Visibility
from planner_core.model.arrays import dots, lengths

#: `Patches.countable_share` of a patch that counts whole.
WHOLE = 255
#: Part of what counts that is enough, eleven twentieths: at which areas of plans are those of independent checks, see
#: docs/decisions/0014-what-counts-as-covered.md.
_ENOUGH, _OF = 11, 20
#: Points of a patch.
_N_POINTS = 32
#: Positions that look at a patch, those that see most of it first: nearly all of what any sees, they see together.
_MOST_LOOKS = 64
#: Rays in one go.
_BATCH_RAYS = 2_000_000


def shares_of(part: UInt32Array) -> UInt8Array:
    """(M,) uint8: how much of its patch each part is, in 255ths; of any part at least one."""
    share = np.rint(WHOLE * share_of(part))
    return np.where(part > 0, np.maximum(share, 1), 0).astype(np.uint8)


def sees_enough(share: UInt8Array, countable_share: UInt8Array) -> BoolArray:
    """(M,) bool: whether shares (M,) are enough of what counts of their patches, (M,)."""
    enough: BoolArray = _OF * share.astype(np.int32) >= _ENOUGH * countable_share.astype(np.int32)
    return enough


def most_countable(best: Int32Array) -> Int32Array:
    """(P,) the most that may count of patches of which one position sees `best` (P,) and no other more: enough of it
    is seen then.
    """
    return best * _OF // _ENOUGH


def shares_of_cut_patches(
    survey: Survey,
    engine: ScanEngine,
    positions_m: FloatArray,
    rows: Visibility,
    share: UInt8Array,
    patches: Int32Array,
) -> UInt8Array:
    """(K,) uint8, how much of `patches` (K,), sorted, positions see together, in 255ths; at least one.

    rows : what each position sees; patches may be stacked, see `planner_core.requirements.demand`. share : (M,) along
    the rows' patches. Each of `patches` is in some row.
    """
    if patches.size == 0:
        return np.empty(0, dtype=np.uint8)
    if type(rows) is not Visibility:  # of rows on disk, beyond a budget of memory
        return _shares_now(survey, engine, positions_m, rows, share, patches)
    own = hash_of(survey.patches, without=("countable_share",))
    inputs = [
        hash_of_scene(survey.scene),
        own,
        survey.template,
        engine_facts(engine),
        positions_m,
        rows,
        share,
        patches,
    ]
    return kept("cut-patches", inputs, lambda: _shares_now(survey, engine, positions_m, rows, share, patches))


def _shares_now(
    survey: Survey,
    engine: ScanEngine,
    positions_m: FloatArray,
    rows: Visibility,
    share: UInt8Array,
    patches: Int32Array,
) -> UInt8Array:
    """See `shares_of_cut_patches`."""
    position, rank_of_patch, look = _best_looks(rows, share, patches, survey.patches.n_patches)
    places = places_of(survey.scene, survey.patches, patches)
    u, v = points_of(patches)
    edge = places.corners_m[:, 1:] - places.corners_m[:, :1]
    at_m = places.corners_m[:, :1] + u[..., None] * edge[:, None, 0] + v[..., None] * edge[:, None, 1]
    view, rounding_m = view_of(survey.template), rounding_of(survey.scene)
    seen = np.zeros((patches.size, _N_POINTS), dtype=np.bool_)
    for number in range(_MOST_LOOKS):
        of_look = np.flatnonzero(look == number)
        for first in range(0, of_look.size, _BATCH_RAYS // _N_POINTS):
            entry = of_look[first : first + _BATCH_RAYS // _N_POINTS]
            patch = rank_of_patch[entry]
            which, point = np.nonzero(~seen[patch])
            away_m = at_m[patch[which], point] - positions_m[position[entry[which]]]
            inside = in_view(view, away_m[:, None], places.normal[patch[which]])[:, 0]
            which, point, away_m = which[inside], point[inside], away_m[inside]
            from_m, normal = positions_m[position[entry[which]]], places.normal[patch[which]]
            free = _are_free(engine, from_m, away_m, normal, rounding_m)
            seen[patch[which[free]], point[free]] = True
    found: UInt8Array = np.maximum(np.rint(WHOLE * seen.mean(axis=1)), 1).astype(np.uint8)
    return found


def points_of(patches: Int32Array) -> tuple[FloatArray, FloatArray]:
    """(K, 32) weights of each patch's second and third corner: an even lattice, shifted by the patch's number.

    References
    ----------
    Roberts, M.: The unreasonable effectiveness of quasirandom sequences (2018), the plastic number's lattice in two
    dimensions. Both halves of the unit square fold onto the triangle.
    """
    plastic = 1.324717957244746
    along = np.arange(_N_POINTS)
    number = patches.astype(np.uint64)[:, None]
    # Knuth's multiplicative hash, a half for each direction.
    mixed = (number * np.uint64(0x9E3779B97F4A7C15)) & np.uint64(0xFFFFFFFFFFFFFFFF)
    shift_u = (mixed >> np.uint64(40)).astype(np.float64) / 2**24
    shift_v = (mixed >> np.uint64(16) & np.uint64(0xFFFFFF)).astype(np.float64) / 2**24
    u, v = (along / plastic + shift_u) % 1.0, (along / plastic**2 + shift_v) % 1.0
    over = u + v > 1.0
    return np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)


def _best_looks(
    rows: Visibility, share: UInt8Array, patches: Int32Array, n_patches: int
) -> tuple[Int64Array, Int64Array, Int64Array]:
    """Position, rank among `patches`, and number of the look at the patch, from 0, of the best few looks at each."""
    patch = rows.patch if rows.n_patches == n_patches else rows.patch % n_patches
    wanted = np.zeros(n_patches, dtype=np.bool_)
    wanted[patches] = True
    entry = np.flatnonzero(wanted[patch])
    # The first of equals is the first position's.
    entry = entry[np.lexsort((entry, -share[entry].astype(np.int16), patch[entry]))]
    of_patch = patch[entry]
    first = np.searchsorted(of_patch, patches)
    rank = np.searchsorted(patches, of_patch)
    look = np.arange(entry.size) - first[rank]
    few = look < _MOST_LOOKS
    entry = entry[few]
    position = np.searchsorted(rows.starts, entry, side="right") - 1
    return position.astype(np.int64), rank[few].astype(np.int64), look[few].astype(np.int64)


def _are_free(
    engine: ScanEngine, from_m: FloatArray, away_m: FloatArray, normal: FloatArray, rounding_m: float
) -> BoolArray:
    """(R,) bool: whether nothing lies before points, by the margins of `docs/method/patch-mode.md`."""
    if from_m.shape[0] == 0:
        return np.empty(0, dtype=np.bool_)
    range_m = lengths(away_m)
    hits = engine.cast_rays(from_m, away_m, range_max_m=float(range_m.max()), through_glass=True)
    off_plane_m = np.maximum(np.abs(dots(away_m, normal)), 1e-12)
    slack = np.minimum(SLACK + rounding_m / off_plane_m, SLACK_MOST)
    free: BoolArray = ~(hits.range_m.astype(np.float64) < range_m * (1.0 - slack))  # a miss is NaN, and free
    return free

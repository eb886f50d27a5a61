"""Where a list of stations lies by its shape alone: no names, no coordinates in common with the plan, only distances.

Planned and listed places (N, 3), metres, z up -> turn about z and shift between them. Two stations of each, as far
apart in both, give a turn and a shift; what most of the others agree with is refined and counted. What else fits nearly
as well is searched for, too: in buildings with an axis of symmetry, or a grid of columns, a list fits in several ways.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.model import FloatArray, Int64Array

AT_STATION_M = 0.5
"""A station counts the less the further it is from a planned one, and from here on not at all."""
FEWEST = 5
"""Of fewer stations any shape is found somewhere in a plan."""
#: A list fits where its stations count so much on average, and together; and in one way only where any other counts so
#: much less. Few stations have to be near, all of them: of random lists of 6 or 7 one in twenty reaches the share.
_LEAST_SHARE, _LEAST_COUNT, _OTHER_SHARE = 0.6, 4.999, 0.8
#: A fit without a turn is taken for the true one where a turn gains less than this.
_TURN_GAIN = 1.05
#: Crews deviate: distances may differ so much before a fit is refined.
_SAME_DISTANCE_M, _LOOSE_M = 0.8, 1.0
#: Bounds of the search, which keep it to seconds with hundreds of stations.
_MOST_PAIRS, _MOST_COMPARED, _MOST_REFINED, _AT_ONCE = 40, 24, 64, 4_000_000
_REFINEMENTS = 4


@dataclass(frozen=True, eq=False)
class ShapeFit:
    """listed = turned by `turn_rad` about z, counter-clockwise, and shifted by `shift_m` (3,) from planned.

    pairs : (K, 2) int64, listed and planned, of those that agree. rms_m : of their distances. other_share : how much
    the next best way counts of this one; at `_OTHER_SHARE` it is not certain any more.
    """

    turn_rad: float
    shift_m: FloatArray
    pairs: Int64Array
    rms_m: float
    other_share: float

    @property
    def is_certain(self) -> bool:
        """Whether nothing else fits nearly as well."""
        return bool(self.other_share < _OTHER_SHARE)


def shape_fit(listed_m: FloatArray, planned_m: FloatArray, *, may_turn: bool = True) -> ShapeFit | None:
    """Find how a list lies to the plan; None where too few of its stations agree with any way.

    Parameters
    ----------
    listed_m, planned_m
        (N, 3) and (M, 3); listed ones may be missing, be additional, and stand decimetres from where planned. Planned
        ones with not-a-number in them are left out.
    may_turn
        Look for turns besides shifts.
    """
    if len(listed_m) < FEWEST or not np.isfinite(listed_m).all():
        return None
    known = np.flatnonzero(np.isfinite(planned_m).all(axis=1)) if len(planned_m) else np.zeros(0, dtype=np.int64)
    if len(known) < FEWEST:
        return None
    planned_m = planned_m[known]
    # About their middles: far out, products of coordinates have no digits left.
    middle_listed_m, middle_planned_m = listed_m.mean(axis=0), planned_m.mean(axis=0)
    here, there = planned_m - middle_planned_m, listed_m - middle_listed_m
    ways = _refined(_shifts(there, here), there, here, may_turn=False)
    if may_turn:
        turned = _refined(_turns(there, here), there, here, may_turn=True)
        ways = np.concatenate([ways, turned])
    if not len(ways):
        return None
    counts = _counted(ways, there, here, AT_STATION_M)
    best = _best(ways, counts)
    apart = np.linalg.norm(_back(ways, there) - _back(ways[best : best + 1], there), axis=2).max(axis=1)
    other = float(counts[apart > 2 * AT_STATION_M].max(initial=0.0))
    pairs, away_m = _pairs(ways[best], there, here, AT_STATION_M)
    if counts[best] < max(_LEAST_COUNT, _LEAST_SHARE * len(listed_m)) or len(pairs) < FEWEST:
        return None
    turn_rad = float(ways[best, 0])
    shift_m = middle_listed_m + ways[best, 1:] - _turned(np.array([turn_rad]), middle_planned_m[None])[0, 0]
    pairs[:, 1] = known[pairs[:, 1]]
    return ShapeFit(turn_rad, shift_m, pairs, float(np.sqrt((away_m**2).mean())), other / float(counts[best]))


def _best(ways: FloatArray, counts: FloatArray) -> int:
    straight = np.flatnonzero(ways[:, 0] == 0.0)
    best = int(np.argmax(counts))
    if straight.size:
        along = int(straight[np.argmax(counts[straight])])
        if counts[best] < _TURN_GAIN * counts[along]:
            return along
    return best


# ------------------------------------------------------------------------------------------ ways: (W, 4) turn, shift
def _shifts(listed_m: FloatArray, planned_m: FloatArray) -> FloatArray:
    """Ways without a turn: of each listed station onto each planned one."""
    compared_m = listed_m[_spread(len(listed_m), _MOST_COMPARED)]
    shifts_m = (compared_m[:, None] - planned_m[None]).reshape(-1, 3)
    return np.column_stack([np.zeros(len(shifts_m)), shifts_m])


def _turns(listed_m: FloatArray, planned_m: FloatArray) -> FloatArray:
    """Ways of pairs of listed stations, far apart, onto pairs of planned ones that are as far apart."""
    i, j = _far_pairs(listed_m)
    k, m = np.nonzero(~np.eye(len(planned_m), dtype=np.bool_))
    along, along_planned = listed_m[j] - listed_m[i], planned_m[m] - planned_m[k]
    length_m, length_planned_m = np.hypot(*along.T[:2]), np.hypot(*along_planned.T[:2])
    same = np.abs(length_m[:, None] - length_planned_m[None]) < _SAME_DISTANCE_M
    same &= np.abs(along[:, None, 2] - along_planned[None, :, 2]) < _SAME_DISTANCE_M
    same &= np.minimum(length_m[:, None], length_planned_m[None]) > _SAME_DISTANCE_M
    p, q = np.nonzero(same)
    turn_rad = np.arctan2(along[p, 1], along[p, 0]) - np.arctan2(along_planned[q, 1], along_planned[q, 0])
    turn_rad = np.arctan2(np.sin(turn_rad), np.cos(turn_rad))
    middle_m, middle_planned_m = (listed_m[i] + listed_m[j])[p] / 2, (planned_m[k] + planned_m[m])[q] / 2
    return np.column_stack([turn_rad, middle_m - _turned(turn_rad, middle_planned_m[:, None])[:, 0]])


def _far_pairs(points_m: FloatArray) -> tuple[Int64Array, Int64Array]:
    """Pairs of points that are far apart in plan, no point in many of them."""
    i, j = np.triu_indices(len(points_m), 1)
    length_m = np.hypot(*(points_m[j] - points_m[i]).T[:2])
    most = max(2, 4 * _MOST_PAIRS // len(points_m))
    taken = np.zeros(len(points_m), dtype=np.int64)
    kept: list[int] = []
    for pair in np.argsort(-length_m, kind="stable").tolist():
        if len(kept) < _MOST_PAIRS and max(taken[i[pair]], taken[j[pair]]) < most:
            taken[i[pair]] += 1
            taken[j[pair]] += 1
            kept.append(pair)
    return i[kept].astype(np.int64), j[kept].astype(np.int64)


def _spread(n: int, most: int) -> Int64Array:
    """Up to `most` of the numbers below n, evenly."""
    return np.unique(np.linspace(0, n - 1, min(n, most)).round().astype(np.int64))


def _refined(ways: FloatArray, listed_m: FloatArray, planned_m: FloatArray, *, may_turn: bool) -> FloatArray:
    """The most promising ways, each fitted to the stations that agree with it."""
    if not len(ways):
        return ways
    few = listed_m[_spread(len(listed_m), _MOST_COMPARED)]
    order = np.argsort(-_counted(ways, few, planned_m, _LOOSE_M), kind="stable")
    return np.array([_fitted(way, listed_m, planned_m, may_turn=may_turn) for way in ways[order[:_MOST_REFINED]]])


def _fitted(way: FloatArray, listed_m: FloatArray, planned_m: FloatArray, *, may_turn: bool) -> FloatArray:
    for within_m in np.linspace(_LOOSE_M, AT_STATION_M, _REFINEMENTS).tolist():
        pairs, _ = _pairs(way, listed_m, planned_m, within_m)
        if len(pairs) < 2:
            return way
        to_m, from_m = listed_m[pairs[:, 0]], planned_m[pairs[:, 1]]
        middle_m, middle_planned_m = to_m.mean(axis=0), from_m.mean(axis=0)
        turn_rad = 0.0
        if may_turn:
            a, b = (to_m - middle_m) @ [1, 1j, 0], (from_m - middle_planned_m) @ [1, 1j, 0]
            turn_rad = float(np.angle((a * b.conj()).sum()))
        shift_m = middle_m - _turned(np.array([turn_rad]), middle_planned_m[None])[0, 0]
        way = np.array([turn_rad, *shift_m])
    return way


def _turned(turn_rad: FloatArray, points_m: FloatArray) -> FloatArray:
    """Points (N, 3), or (W, N, 3) one set a turn (W,), turned about z: (W, N, 3)."""
    cos, sin = np.cos(turn_rad)[:, None], np.sin(turn_rad)[:, None]
    x, y, z = np.moveaxis(points_m, -1, 0)
    return np.stack(np.broadcast_arrays(cos * x - sin * y, sin * x + cos * y, z), axis=-1)


def _back(ways: FloatArray, listed_m: FloatArray) -> FloatArray:
    """(W, N, 3) where listed stations (N, 3) lie in the plan."""
    return _turned(-ways[:, 0], listed_m[None] - ways[:, None, 1:])


def _counted(ways: FloatArray, listed_m: FloatArray, planned_m: FloatArray, within_m: float) -> FloatArray:
    """(W,) how many stations agree: each by 1 less the square of its distance over `within_m`, once on either side."""
    counts = [np.zeros(0)]
    step = max(1, _AT_ONCE // (len(listed_m) * len(planned_m)))
    for start in range(0, len(ways), step):
        at_m = _back(ways[start : start + step], listed_m)
        away2 = sum((at_m[:, :, None, axis] - planned_m[:, axis]) ** 2 for axis in range(3)) / within_m**2
        each = np.maximum(0.0, 1.0 - away2)
        counts.append(np.minimum(each.max(axis=2).sum(axis=1), each.max(axis=1).sum(axis=1)))
    return np.concatenate(counts)


def _pairs(
    way: FloatArray, listed_m: FloatArray, planned_m: FloatArray, within_m: float
) -> tuple[Int64Array, FloatArray]:
    """Stations that are each other's nearest: (K, 2) listed, planned, and (K,) how far apart."""
    at_m = _back(way[None], listed_m)[0]
    away_m = np.linalg.norm(at_m[:, None] - planned_m[None], axis=2)
    planned = away_m.argmin(axis=1)
    listed = np.arange(len(at_m))
    mutual = (away_m.argmin(axis=0)[planned] == listed) & (away_m[listed, planned] <= within_m)
    pairs = np.column_stack([listed, planned])[mutual].astype(np.int64)
    return pairs, away_m[pairs[:, 0], pairs[:, 1]]

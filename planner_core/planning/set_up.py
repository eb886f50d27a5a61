"""Links and coverage as stations are set up: beside their marks, where crews stand.

Input a `Pool` and chosen rows of it; output which links between these fall below what is required when both stations
stand anywhere within the set-up tolerance, pools without such links, and how much set-ups cover.

Each station is scanned at eight places around its mark as well, at the tolerance in plan, half of it higher and lower
by turns. Of links the worst of all pairs of places of two stations counts: they are set up independently. Coverage is
one of all stations together, which never stand at their worst places all at once: it is that of set-ups by chance, for
which each is scanned at eight places nearer to its mark, too.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from planner_core.coverage.coverage import stacked_rows, times_seen
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import BoolArray, FloatArray, Int32Array, Int64Array, Visibility
from planner_core.network.candidate_links import CandidateLinks, parts_of
from planner_core.network.links import least_listed_overlap, probabilities, surface_of_patches
from planner_core.network.pair_overlap import PairOverlaps, PairSums
from planner_core.network.shut_doors import with_all_doors_shut
from planner_core.planning.pool import FragileLinks, Pool, kept_links, links_among
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.requirements.compliance import rows_of_overlap
from planner_core.requirements.demand import rows_from
from planner_core.requirements.observe_candidates import SeenPatches, stacked
from planner_core.select.problem import TICKS_PER_M2

#: Places around a mark, and nearer to it.
_N_AROUND = _N_NEARER = 8
#: Share of coverage that setting up beside the marks may cost: a plan that holds as set up lacks no more of what is
#: required.
SET_UP_LOSS = 0.005
#: Set-ups that coverage is computed of, how many of them may cover less than the figure, half of one in a hundred as
#: places are a sample, too, and where chance begins.
_N_SET_UPS, _N_WORSE, _SEED = 400, 2, 20261129
#: One in so many of their stations stands at a place around its mark, for the outermost quarter of the disc.
_ONE_AROUND = 4


@dataclass
class SeenAround:
    """What is seen from places around marks, kept for all rounds of a choice: most stations stay in the next round."""

    shift_m: FloatArray
    """(n, 3) places, from a mark."""
    _rows: Int64Array = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    _seen: SeenPatches | None = None

    def of(self, pool: Pool, rows: Int64Array, engine: ScanEngine, *, progress: Progress = silent) -> SeenPatches:
        """What each place around the marks of rows of the pool sees, mark by mark."""
        new = np.setdiff1d(rows, self._rows)
        if self._seen is None or new.size:
            at_m = (pool.candidates.position_m[new][:, None] + self.shift_m).reshape(-1, 3)

            def set_up(event: ProgressEvent) -> None:
                progress(replace(event, stage="set up"))

            more = rows_from(pool.survey, engine, at_m, pool.demand, progress=set_up)
            self._seen = more if self._seen is None else stacked(self._seen, more)
            self._rows = np.concatenate([self._rows, new])
        order = np.argsort(self._rows)
        at = order[np.searchsorted(self._rows, rows, sorter=order)]
        n = self.shift_m.shape[0]
        return self._seen.take((n * at[:, None] + np.arange(n)).ravel())


class SeenAsSetUp:
    """What is seen from where stations may stand within a tolerance. around, nearer : see `_around_m`, `_nearer_m`."""

    def __init__(self, tolerance_m: float) -> None:
        self.around, self.nearer = SeenAround(_around_m(tolerance_m)), SeenAround(_nearer_m(tolerance_m))


def fragile_links(
    pool: Pool,
    chosen: tuple[int, ...],
    engine: ScanEngine,
    tolerance_m: float,
    *,
    seen: SeenAsSetUp | None = None,
    progress: Progress = silent,
) -> FragileLinks:
    """Find the links of chosen rows that do not hold wherever within `tolerance_m` the stations stand.

    A link that would not be listed does not hold either. Links to other candidates are among them that do not hold even
    where these stand on their marks. Scanned stations stand where they were scanned. Targets hang where both stations
    see them as they are set up: they always hold.
    `seen` : of earlier rounds with this engine and tolerance.
    """
    assert pool.links is not None
    required, links, n = pool.demand.goals.requirements, pool.links, pool.n_candidates
    rows = np.array(sorted(chosen), dtype=np.int64)
    by_surface = links.by_surface
    neighbours = [links.neighbour[links.row(row)][by_surface[links.row(row)]] for row in rows.tolist()]
    if not sum(map(len, neighbours)):
        return FragileLinks.none()
    n_around = 1 + _N_AROUND
    around_marks = (seen or SeenAsSetUp(tolerance_m)).around.of(pool, rows, engine, progress=progress)
    around = rows_of_overlap(pool.demand, around_marks, required.overlap_of)
    near = np.setdiff1d(np.concatenate(neighbours), rows)
    of_near = rows_of_overlap(pool.demand, pool.rows.take(near), required.overlap_of)
    position_m = pool.candidates.position_m
    around_m, near_m = (position_m[rows][:, None] + _around_m(tolerance_m)).reshape(-1, 3), position_m[near]
    # Where somebody stands, by row of `counted`: places around marks, then other candidates.
    row_around = np.repeat(rows, n_around)
    stands = np.ones((rows.size, n_around), dtype=bool)
    stands[np.isin(rows, pool.scanned), 1:] = False
    n_places = np.ones(n, dtype=np.int64)
    n_places[rows] = stands.sum(axis=1)
    own = np.repeat(rows, [len(each) for each in neighbours])
    key = np.unique(_key(own, np.concatenate(neighbours), n))
    n_states = 1
    if required.doors_change:  # a place with doors shut is one more of its station's places
        n_states, n_places = 2, 2 * n_places
        around = stacked_rows(around, with_all_doors_shut(pool.survey, around, around_m))
        of_near = stacked_rows(of_near, with_all_doors_shut(pool.survey, of_near, near_m))
    places = _Places(
        stacked_rows(around, of_near),
        np.concatenate([np.tile(around_m, (n_states, 1)), np.tile(near_m, (n_states, 1))]),
        around.n_positions,
        np.concatenate([np.tile(row_around, n_states), np.tile(near, n_states)]),
        np.concatenate([np.tile(stands.ravel(), n_states), np.ones(n_states * near.size, dtype=bool)]),
    )
    overlap, strength, probability = _least_of_links(pool, places, key, n_places)
    limits = required.link_limits.as_set_up()
    least_overlap = max(limits.overlap, least_listed_overlap(required.overlap))
    falls = (overlap < least_overlap) | (strength < limits.strength) | (probability < limits.probability)
    first, second = np.divmod(key, n)
    return FragileLinks(first.astype(np.int32), second.astype(np.int32), overlap, strength, probability).take(falls)


@dataclass(frozen=True)
class _Places:
    """Places (R,) where somebody stands: around marks, the first `n_around`, then other candidates.

    counted : what overlap is counted on of each. at_m : (R, 3) local. row : (R,) of the pool. stands : (R,) whether
    anybody does.
    """

    counted: Visibility
    at_m: FloatArray
    n_around: int
    row: Int64Array
    stands: BoolArray


def _least_of_links(pool: Pool, places: _Places, key: Int64Array, n_places: Int64Array) -> FloatArray:
    """(3, K) least overlap, strength and probability of links by their keys, over all pairs of places of their
    stations; NaN where no probability is required.
    """
    required, area_m2 = pool.demand.goals.requirements, pool.survey.patches.area_m2
    counted, row, stands = places.counted, places.row, places.stands
    overlaps = PairOverlaps(counted, area_m2, min_overlap=0.0, measure=required.overlap_measure)
    pairs = overlaps.of_rows(0, places.n_around)
    of_pair = _key(row[pairs.first], row[pairs.second], pool.n_candidates)
    link = np.minimum(np.searchsorted(key, of_pair), key.size - 1)
    counts = (key[link] == of_pair) & stands[pairs.first] & stands[pairs.second]
    link, pairs = link[counts], pairs.take(counts)
    surface = surface_of_patches(pool.survey.scene, pool.survey.patches, times_seen(counted) > 0)
    sums = PairSums(counted, area_m2, surface, places.at_m, seen=overlaps.seen)
    held = sums.held(pairs.first, pairs.second)
    figures = [pairs.overlap, held.strength]
    if required.min_probability > 0.0:
        start = required.start_of(pool.survey.scanner)
        figures.append(probabilities(pairs.share, held, start))
    least = np.full((len(figures), key.size), np.inf)
    for of, figure in zip(least, figures, strict=True):
        np.minimum.at(of, link, figure)
    # Where some two places have nothing in common, they make no pair.
    one, other = np.divmod(key, pool.n_candidates)
    least[:, np.bincount(link, minlength=key.size) < n_places[one] * n_places[other]] = 0.0
    return np.concatenate([least, np.full((3 - len(figures), key.size), np.nan)])


def _key(one: Int64Array | Int32Array, other: Int64Array | Int32Array, n: int) -> Int64Array:
    """(K,) number of pairs of rows, (K,) each, of n."""
    return np.minimum(one, other).astype(np.int64) * n + np.maximum(one, other)


def coverage_as_set_up(
    pool: Pool,
    chosen: tuple[int, ...],
    engine: ScanEngine,
    tolerance_m: float,
    *,
    seen: SeenAsSetUp | None = None,
    progress: Progress = silent,
) -> FloatArray:
    """(K,) fraction of the achievable area of each constraint of the pool that 99 of 100 set-ups cover at least.

    In a set-up each station stands, by chance and by itself, at one of the places in the disc of the tolerance, as
    often around its mark as the outermost quarter of the disc is large. Scanned stations stand where they were scanned.
    """
    rows = np.array(sorted(chosen), dtype=np.int64)
    seen = seen or SeenAsSetUp(tolerance_m)
    around, nearer = (each.of(pool, rows, engine, progress=progress).met for each in (seen.around, seen.nearer))
    is_scanned = np.isin(rows, pool.scanned)
    n_around = 1 + _N_AROUND
    # Of each station what its mark, the places around it and those nearer to it see.
    from_places = [
        [around.row(n_around * station + at) for at in range(n_around)]
        + [nearer.row(_N_NEARER * station + at) for at in range(_N_NEARER)]
        for station in range(rows.size)
    ]
    draw, shape = np.random.default_rng(_SEED), (_N_SET_UPS, rows.size)
    is_around = draw.integers(_ONE_AROUND, size=shape) == 0
    place = np.where(is_around, draw.integers(1, n_around, size=shape), n_around + draw.integers(_N_NEARER, size=shape))
    place[:, is_scanned] = 0
    part = np.stack([constraint.part for constraint in pool.constraints])
    enough = np.array([constraint.seen_from for constraint in pool.constraints])[:, None]
    # Most patches are seen from all places of enough stations: no set-up loses these.
    n_sure = np.zeros(around.n_patches, dtype=np.int64)
    for places, scanned in zip(from_places, is_scanned.tolist(), strict=True):
        stands = places[:1] if scanned else places[1:]
        n_sure += np.bincount(np.concatenate(stands), minlength=around.n_patches) == len(stands)
    ticks = np.rint(pool.demand.area_m2 * TICKS_PER_M2).astype(np.int64)
    whole = (part * ticks).sum(axis=1)
    sure = (part & (n_sure >= enough)) @ ticks
    unsure = np.flatnonzero((part & (n_sure < enough)).any(axis=0))
    number = np.full(around.n_patches, -1, dtype=np.int64)
    number[unsure] = np.arange(unsure.size)
    numbers = [[number[each][number[each] >= 0] for each in places] for places in from_places]
    counted, still = part[:, unsure] & (n_sure[unsure] < enough), ticks[unsure]
    covered = np.empty((_N_SET_UPS, enough.size), dtype=np.int64)
    for set_up, at in enumerate(place.tolist()):
        n_seen = np.zeros(unsure.size, dtype=np.int64)
        for station, where in enumerate(at):
            n_seen[numbers[station][where]] += 1
        covered[set_up] = sure + (counted & (n_seen >= enough)) @ still
    low = np.sort(covered, axis=0)[_N_WORSE]
    return np.where(whole > 0, low / np.maximum(whole, 1), 1.0)


def without_fragile(pool: Pool, fragile: FragileLinks) -> Pool:
    """Leave out links that do not hold as set up, but for those without which candidates are in more parts."""
    assert pool.links is not None
    links = pool.links
    owner, n = _owner(links), links.n_candidates
    gone = np.isin(_key(owner, links.neighbour, n), _key(fragile.first, fragile.second, n))
    left = kept_links(links, ~gone, owner, links.part)
    part = parts_of(left.starts, left.neighbour)
    keep = ~gone | (part[owner] != part[links.neighbour])
    return pool.with_links(kept_links(links, keep, owner, links.part))


def _owner(links: CandidateLinks) -> Int64Array:
    """(L,) the candidate whose link each entry of `neighbour` is."""
    return np.repeat(np.arange(links.n_candidates, dtype=np.int64), np.diff(links.starts))


def _around_m(tolerance_m: float) -> FloatArray:
    """(9, 3) from a mark: itself, and places around it."""
    angle = 2.0 * np.pi / _N_AROUND * np.arange(_N_AROUND)
    rise = 0.5 * np.where(np.arange(_N_AROUND) % 2, 1.0, -1.0)
    around = np.column_stack([np.cos(angle), np.sin(angle), rise])
    return tolerance_m * np.concatenate([np.zeros((1, 3)), around])


def _nearer_m(tolerance_m: float) -> FloatArray:
    """(8, 3) from a mark: places that stand for equal parts of the disc but its outermost quarter, and of the heights.

    Each is turned by the golden angle from the one before it (Vogel's spiral).
    """
    part = (np.arange(_N_NEARER) + 0.5) / _N_NEARER
    radius, angle = np.sqrt((1.0 - 1.0 / _ONE_AROUND) * part), np.pi * (3.0 - np.sqrt(5.0)) * np.arange(_N_NEARER)
    rise = part[3 * np.arange(_N_NEARER) % _N_NEARER] - 0.5
    return tolerance_m * np.column_stack([radius * np.cos(angle), radius * np.sin(angle), rise])


def decisive(pool: Pool, chosen: tuple[int, ...], fragile: FragileLinks) -> FragileLinks:
    """Those of the fragile links between chosen rows without which these are in more groups."""
    assert pool.links is not None
    rows, n = np.array(sorted(chosen), dtype=np.int64), len(chosen)
    place = np.full(pool.n_candidates, -1, dtype=np.int64)
    place[rows] = np.arange(n)
    among = links_among(pool.links, rows, place)
    owner = _owner(among)
    both = (place[fragile.first] >= 0) & (place[fragile.second] >= 0)
    fragile = fragile.take(both)
    one, other = place[fragile.first], place[fragile.second]
    gone = np.isin(owner * n + among.neighbour, np.concatenate([one * n + other, other * n + one]))
    rest = kept_links(among, ~gone, owner, among.part)
    part = parts_of(rest.starts, rest.neighbour)
    return fragile.take(part[one] != part[other])

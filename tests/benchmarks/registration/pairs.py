"""Pairs of stations to register, with what a planner knows of each before anybody has scanned.

A scene -> stations drawn from its candidate positions, and `Pair`s of them: as many of little overlap as of much.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import BoolArray, FloatArray, PlanSettings, Requirements, Scene, VisibilityMode
from planner_core.network.links import overlap_links, surface_of_patches
from planner_core.network.pair_overlap import PairSums, SharedSurface
from planner_core.positions.admissibility import Tripods
from planner_core.positions.allowed_positions import find_positions
from planner_core.positions.free_space import free_space
from planner_core.positions.local_site import local_site
from planner_core.requirements.goals import goals_of
from planner_core.requirements.observe_candidates import observe_candidates
from planner_core.scanner.load_scanner import load_scanner

N_STATIONS = 64
LEAST_OVERLAP, LEAST_COMMON_M2 = 0.02, 0.3
OVERLAPS = (0.02, 0.05, 0.08, 0.12, 0.16, 0.2, 0.25, 0.3, 0.4, 0.6, 1.01)
"""Pairs are drawn from each of these bins alike, as far as there are any."""
#: Two faces this near to each other may be taken for one: the start of a hand-placed scan is as uncertain.
_MISTAKEN_M, _SAME_PLANE_M, _PARALLEL = 0.3, 0.02, 0.95


@dataclass(frozen=True)
class Pair:
    """Two stations, a < b, by number. Areas in m2, of all that each sees.

    overlap, strength : as links have them. least_normal : the smallest eigenvalue of sum a n n' / sum a, times 3.
    common_range_m : root mean square range of the common surface, from the station for which it is more.
    opposed_m2, parallel_m2 : what only one of the two sees, and beside it, within 0.3 m, a parallel face that only the
    other sees: facing the other way (the two sides of a wall), or the same. hold_m2 : as the rule has it.
    """

    a: int
    b: int
    distance_m: float
    common_m2: float
    share_a: float
    share_b: float
    overlap: float
    strength: float
    least_normal: float
    common_range_m: float
    opposed_m2: float
    parallel_m2: float
    hold_m2: float

    def written(self) -> list[str]:
        """For a row of a table."""
        return [f"{value:.5g}" if isinstance(value, float) else str(value) for value in vars(self).values()]


COLUMNS = tuple(field.name for field in fields(Pair))


@dataclass(frozen=True)
class Stations:
    """positions_m : (S, 3), local. pairs : in the order in which they are registered."""

    scene: Scene
    engine: ScanEngine
    positions_m: FloatArray
    pairs: tuple[Pair, ...]


def stations_of(scene: Scene, *, n_pairs: int, seed: int) -> Stations:
    """Draw stations and pairs of a scene."""
    random = np.random.default_rng(seed)
    settings = PlanSettings(
        scanner=load_scanner("rtc360"), requirements=Requirements(), scan_mode=VisibilityMode.PATCHES
    )
    survey = make_survey(scene, settings)
    engine = open_engine(survey.scene, survey.patches)
    tripods = Tripods(survey, settings, engine)
    found = find_positions(tripods, local_site(survey, settings.site), space=free_space(survey))
    at_m = found.candidates.position_m
    # Half of them anywhere, and half beside these: neighbours overlap, and few of a large building would.
    first = random.choice(len(at_m), min(N_STATIONS // 2, len(at_m)), replace=False)
    near = cKDTree(at_m).query(at_m[first], k=min(40, len(at_m)))[1]
    chosen = np.unique(np.concatenate([first, [random.choice(row) for row in np.atleast_2d(near)]]))
    positions_m = at_m[random.permutation(chosen)]
    rows = observe_candidates(survey, engine, positions_m, goals_of(survey, settings.requirements)).rows.seen
    seen = np.zeros((len(positions_m), rows.n_patches), dtype=bool)
    for station in range(len(positions_m)):
        seen[station, rows.row(station)] = True
    surface = surface_of_patches(survey.scene, survey.patches, seen.any(axis=0))
    names = tuple(str(number) for number in range(len(positions_m)))
    links = overlap_links(rows, survey.patches.area_m2, names, surface, positions_m, min_overlap=LEAST_OVERLAP)
    one, other = (
        np.array([int(name) for name in ends], dtype=np.int32)
        for ends in zip(*((x.a, x.b) for x in links), strict=True)
    )
    held = PairSums(rows, survey.patches.area_m2, surface, positions_m).held(one, other)
    found_pairs = _pairs(links, held.hold_m2, positions_m, seen, survey.patches.area_m2, surface)
    return Stations(survey.scene, engine, positions_m, _drawn(found_pairs, n_pairs, random))


def _pairs(
    links: tuple,
    hold_m2: FloatArray,
    positions_m: FloatArray,
    seen: BoolArray,
    area_m2: FloatArray,
    surface: SharedSurface,
) -> list[Pair]:
    opposed, parallel = (_beside(each, seen) for each in _mistaken(surface, seen.any(axis=0)))
    pairs = []
    for link, holds_m2 in zip(links, hold_m2.tolist(), strict=True):
        a, b = int(link.a), int(link.b)
        common = seen[a] & seen[b]
        common_m2 = float(area_m2[common].sum())
        if common_m2 < LEAST_COMMON_M2:
            continue
        normal, weight = surface.normal[common], area_m2[common]
        held = np.linalg.eigvalsh((normal * weight[:, None]).T @ normal / weight.sum())
        at_m = surface.centroid_m[common]
        squares_m2 = [((at_m - positions_m[each]) ** 2).sum(axis=1) for each in (a, b)]
        only = seen[a] & ~seen[b], seen[b] & ~seen[a]
        mistaken = [
            float(min(area_m2[only[0] & each[b]].sum(), area_m2[only[1] & each[a]].sum()))
            for each in (opposed, parallel)
        ]
        pairs.append(
            Pair(
                a,
                b,
                float(np.linalg.norm(positions_m[a] - positions_m[b])),
                common_m2,
                common_m2 / float(area_m2[seen[a]].sum()),
                common_m2 / float(area_m2[seen[b]].sum()),
                link.overlap,
                link.strength,
                float(3.0 * held[0]),
                float(np.sqrt(max(np.average(each, weights=weight) for each in squares_m2))),
                *mistaken,
                holds_m2,
            )
        )
    return pairs


def _mistaken(surface: SharedSurface, used: BoolArray) -> tuple[sparse.csr_array, sparse.csr_array]:
    """(P, P) which patches lie beside which, in another plane: facing each other's back, and facing the same way."""
    patch = np.flatnonzero(used)
    at_m, normal = surface.centroid_m[patch], surface.normal[patch]
    near = cKDTree(at_m).query_pairs(_MISTAKEN_M, output_type="ndarray")
    one, other = np.concatenate([near, near[:, ::-1]]).T
    facing = np.einsum("ij,ij->i", normal[one], normal[other])
    apart_m = np.abs(np.einsum("ij,ij->i", at_m[other] - at_m[one], normal[one]))
    aside = apart_m > _SAME_PLANE_M
    n = used.size
    kept = (aside & (facing < -_PARALLEL), aside & (facing > _PARALLEL))
    opposed, parallel = (
        sparse.csr_array((np.ones(int(each.sum()), dtype=np.int32), (patch[one[each]], patch[other[each]])), (n, n))
        for each in kept
    )
    return opposed, parallel


def _beside(near: sparse.csr_array, seen: BoolArray) -> BoolArray:
    """(S, P) patches beside which a station sees another plane."""
    return np.asarray((near @ seen.T.astype(np.int32)).T > 0)


def _drawn(pairs: list[Pair], n: int, random: np.random.Generator) -> tuple[Pair, ...]:
    """At most `n` pairs, one of each bin of overlap after the other: however early one stops, all bins are there."""
    bins: list[list[Pair]] = [[] for _ in OVERLAPS[1:]]
    for place in random.permutation(len(pairs)):
        bins[int(np.searchsorted(OVERLAPS, pairs[place].overlap, side="right")) - 1].append(pairs[place])
    drawn: list[Pair] = []
    while len(drawn) < n and any(bins):
        drawn += [each.pop() for each in bins if each]
    return tuple(drawn[:n])

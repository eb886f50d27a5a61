"""Targets: where three of them register two stations that have too little surface in common.

Input what stations see and their sensors (local frame, metres); output places, links that targets make, and the pairs
of many candidates that have such places. Targets join groups that no common surface does, and nothing else: each costs
a crew a walk.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from planner_core.coverage.coverage import take_rows
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import (
    BoolArray,
    FloatArray,
    Int32Array,
    Int64Array,
    Link,
    Registration,
    Requirements,
    Survey,
    Visibility,
)
from planner_core.network.links import overlap_links
from planner_core.network.pair_overlap import SharedSurface
from planner_core.network.shut_doors import doors_in_sight, with_all_doors_shut
from planner_core.requirements.goals import NO_COVER

#: What moves between two scans, or may not be stuck on.
NO_TARGETS = (*NO_COVER, "IfcDoor", "IfcWindow")
#: Smaller triangles take none: a target of 0.15 m covers as much.
_LEAST_FACE_M2 = 0.02
#: A ray that ends this near to a place meets it.
_SAME_PLACE_M = 0.005
#: A target is measured well from as far as this, at this angle to the plumb of its face (60 degrees), and hangs on
#: walls, where a person reaches: from below the lower sensor to above the upper one, which may be a floor above.
_FARTHEST_M, _LEAST_COSINE, _UPRIGHT, _REACH_M = 20.0, 0.5, 0.2, (-1.2, 0.8)
#: Three targets hold a scan if two are as far apart as this, level, and the third as far off their line as that.
_LEAST_APART_M, _LEAST_OFF_LINE_M = 1.5, 0.75
#: Of a link: so far, and so many times the range to their middle. Of centres measured to a millimetre (standard
#: deviation) these keep 99 of 100 level scans within 0.1 degrees and 10 mm: docs/method/registration.md.
_LINK_APART_M, _LINK_APART_OF_RANGE = 3.0, 0.6
#: Of the patches of a triangle, by their numbers, one of so many is tried.
_ONE_OF = 4
_InPlainView = Callable[[FloatArray, FloatArray], BoolArray]


def target_places(
    common: BoolArray,
    surface: SharedSurface,
    sensors_m: FloatArray,
    in_plain_view: _InPlainView,
    *,
    makes_link: bool = False,
) -> FloatArray:
    """Choose places for three targets on upright surface that two stations see, far from each other and from one line.

    Parameters
    ----------
    common
        (P,) patches that both see and that targets may hang on.
    sensors_m
        (2, 3).
    in_plain_view
        Of a sensor (3,) and places (N, 3): (N,) whether nothing is in between. Of a patch that is seen, the middle may
        be hidden.
    makes_link
        Whether they have to hold as well as a link does; else they are what is best there.

    Returns
    -------
    (3, 3) centroids of patches; (0, 3) where no three would hold.
    """
    at_m, normal = surface.centroid_m[common], surface.normal[common]
    low_m, high_m = sensors_m[:, 2].min(), sensors_m[:, 2].max()
    usable = np.abs(normal[:, 2]) <= _UPRIGHT
    usable &= (at_m[:, 2] >= low_m + _REACH_M[0]) & (at_m[:, 2] <= high_m + _REACH_M[1])
    for sensor_m in sensors_m:
        usable &= _measured_well(at_m - sensor_m, normal)
    for sensor_m in sensors_m:
        usable[usable] = in_plain_view(sensor_m, at_m[usable])
    places_m = at_m[usable]
    if places_m.shape[0] < 3:
        return np.empty((0, 3))
    first = places_m[_farthest(np.hypot(*(places_m - places_m.mean(axis=0))[:, :2].T))]
    from_first_m = places_m - first
    second = places_m[_farthest(np.hypot(*from_first_m[:, :2].T))]
    along_m, two_m = second - first, np.stack([first, second])
    if _apart_m(two_m) < (_link_apart_m(two_m, sensors_m) if makes_link else _LEAST_APART_M):
        return np.empty((0, 3))
    off_line_m = np.linalg.norm(np.cross(from_first_m, along_m / np.linalg.norm(along_m)), axis=1)
    third = _farthest(off_line_m)
    if off_line_m[third] < _LEAST_OFF_LINE_M:
        return np.empty((0, 3))
    return np.stack([first, second, places_m[third]])


def target_pairs(
    seen: Visibility,
    surface: SharedSurface,
    survey: Survey,
    engine: ScanEngine,
    position_m: FloatArray,
    part: Int32Array,
) -> Int64Array:
    """(K, 2) pairs of rows of `seen`, of different parts (N,), that see places which hold three targets."""
    if np.unique(part).size < 2:
        return np.empty((0, 2), dtype=np.int64)
    return _pairs(_hung_rows(seen, surface, survey, engine, position_m), surface, position_m, part)


def _pairs(hung: Visibility, surface: SharedSurface, position_m: FloatArray, part: Int32Array) -> Int64Array:
    from planner_core.network.compiled_pairs import hold_targets

    pairs, found = [np.empty((0, 2), dtype=np.int64)], np.empty(part.size, dtype=np.bool_)
    limits = (2.0 * _FARTHEST_M, _LINK_APART_M, _LINK_APART_OF_RANGE, _LEAST_OFF_LINE_M)
    for row in range(part.size):
        hold_targets(row, hung.starts, hung.patch, surface.centroid_m, part, position_m, limits, found)
        others = np.flatnonzero(found)
        pairs.append(np.column_stack([np.full(others.size, row), others]))
    return np.concatenate(pairs)


def joined_by_targets(
    links: Sequence[Link],
    survey: Survey,
    requirements: Requirements,
    seen: Visibility,
    surface: SharedSurface,
    station_ids: tuple[str, ...],
    position_m: FloatArray,
    engine: ScanEngine,
) -> tuple[Link, ...]:
    """Have targets register pairs of stations until all are one group, or no places hold three: those that targets hold
    firmest first. Pairs that were too little to be listed join the links.

    seen, surface, position_m : of the stations, as links are counted on.
    """
    place = {name: number for number, name in enumerate(station_ids)}
    part = np.arange(len(station_ids), dtype=np.int32)
    for link in links:
        if link.counts(requirements.link_limits):
            _join(part, place[link.a], place[link.b])
    if np.unique(part).size < 2:
        return tuple(links)
    always = with_all_doors_shut(survey, seen, position_m) if requirements.doors_change else seen
    hung = _hung_rows(always, surface, survey, engine, position_m)
    firmest_first = []
    for one, other in _pairs(hung, surface, position_m, part).tolist():
        ends_m = position_m[[one, other]]
        places_m = target_places(_common(hung, one, other), surface, ends_m, _everything, makes_link=True)
        if places_m.size:
            firmest_first.append((-_apart_m(places_m) / _link_apart_m(places_m, ends_m), one, other, places_m))
    firmest_first.sort(key=lambda each: each[:3])
    link_of = {frozenset((link.a, link.b)): link for link in links}
    made: dict[frozenset[str], Link] = {}
    for _, one, other, places_m in firmest_first:
        if part[one] != part[other]:
            ids, rows = (station_ids[one], station_ids[other]), [one, other]
            ends = frozenset(ids)
            if ends not in link_of:
                (link_of[ends],) = overlap_links(
                    take_rows(seen, rows), survey.patches.area_m2, ids, surface, position_m[rows], min_overlap=0.0,
                    measure=requirements.overlap_measure, pre_alignment=requirements.start_of(survey.scanner),
                )  # fmt: skip
            doors = {door for at in rows for door in doors_in_sight(survey.scene, position_m[at], places_m)}
            made[ends] = replace(
                link_of[ends], targets_m=_as_places(places_m), only_open=tuple(sorted(doors)), only_shut=()
            )
            _join(part, one, other)
    of_known = [made.pop(frozenset((link.a, link.b)), link) for link in links]
    return (*of_known, *made.values())


def with_target_places(
    registration: Registration,
    survey: Survey,
    seen: Visibility,
    surface: SharedSurface,
    station_ids: Sequence[str],
    position_m: FloatArray,
    engine: ScanEngine,
) -> Registration:
    """Add places for targets to the gaps; arrays as in `joined_by_targets`."""
    if not registration.gaps:
        return registration
    row = {station: number for number, station in enumerate(station_ids)}
    hangs, in_plain_view = _may_hang(survey), plain_view(engine)
    gaps = []
    for gap in registration.gaps:
        ends = [row[gap.best.a], row[gap.best.b]]
        places_m = target_places(_common(seen, *ends) & hangs, surface, position_m[ends], in_plain_view)
        gaps.append(replace(gap, targets_m=_as_places(places_m)))
    return replace(registration, gaps=tuple(gaps))


def plain_view(engine: ScanEngine) -> _InPlainView:
    """Whether nothing is between a sensor (3,) and places (N, 3), by rays."""

    def in_plain_view(sensor_m: FloatArray, places_m: FloatArray) -> BoolArray:
        away_m = places_m - sensor_m
        distance_m = np.linalg.norm(away_m, axis=1)
        hits = engine.cast_rays(np.tile(sensor_m, (len(away_m), 1)), away_m, range_max_m=2 * _FARTHEST_M)
        return np.asarray(np.abs(hits.range_m - distance_m) <= _SAME_PLACE_M)

    return in_plain_view


def _may_hang(survey: Survey) -> BoolArray:
    """(P,) patches that targets may hang on."""
    fixed = ~np.array([element.kind in NO_TARGETS for element in survey.scene.elements], dtype=bool)
    takes_one = fixed[survey.scene.element_of_triangle] & (survey.patches.triangle_area_m2 >= _LEAST_FACE_M2)
    return np.asarray(takes_one[survey.patches.triangle_of_patch])


def _hung_rows(
    seen: Visibility, surface: SharedSurface, survey: Survey, engine: ScanEngine, position_m: FloatArray
) -> Visibility:
    """Rows of the patches that each position measures well and a person reaches; one of `_ONE_OF`."""
    hangs = _may_hang(survey) & (np.abs(surface.normal[:, 2]) <= _UPRIGHT) & surface.normal.any(axis=1)
    first = survey.patches.first_patch
    hangs &= (np.arange(first[-1]) - np.repeat(first[:-1], np.diff(first))) % _ONE_OF == 0
    rows, in_plain_view = [], plain_view(engine)
    for number, sensor_m in enumerate(position_m):
        row = seen.row(number)
        row = row[hangs[row]]
        away_m = surface.centroid_m[row] - sensor_m
        reached = (away_m[:, 2] >= _REACH_M[0]) & (away_m[:, 2] <= _REACH_M[1])
        row = row[reached & _measured_well(away_m, surface.normal[row])]
        rows.append(row[in_plain_view(sensor_m, surface.centroid_m[row])] if row.size else row)
    starts = np.concatenate([[0], np.cumsum([row.size for row in rows])]).astype(np.int64)
    return Visibility(starts, np.concatenate([np.empty(0, dtype=np.int32), *rows]), seen.n_patches)


def _everything(_sensor_m: FloatArray, places_m: FloatArray) -> BoolArray:
    """In plain view: rows of `_hung_rows` are."""
    return np.ones(places_m.shape[0], dtype=bool)


def _apart_m(places_m: FloatArray) -> float:
    """Between the first two of places, level."""
    return float(np.hypot(*(places_m[1] - places_m[0])[:2]))


def _link_apart_m(places_m: FloatArray, sensors_m: FloatArray) -> float:
    """How far apart the first two of places have to be, level, for a link of sensors (2, 3)."""
    range_m = np.linalg.norm(sensors_m - 0.5 * (places_m[0] + places_m[1]), axis=1).max()
    return max(_LINK_APART_M, _LINK_APART_OF_RANGE * float(range_m))


def _measured_well(away_m: FloatArray, normal: FloatArray) -> BoolArray:
    """(N,) of places away_m (N, 3) from a sensor: near enough, and not seen too obliquely."""
    range_m = np.linalg.norm(away_m, axis=1)
    across_m = np.abs(np.einsum("ij,ij->i", away_m, normal))
    return np.asarray((range_m <= _FARTHEST_M) & (across_m >= _LEAST_COSINE * range_m))


def _common(seen: Visibility, one: int, other: int) -> BoolArray:
    """(P,) patches that two rows see."""
    common = np.zeros(seen.n_patches, dtype=bool)
    common[np.intersect1d(seen.row(one), seen.row(other), assume_unique=True)] = True
    return common


def _join(part: Int32Array, one: int, other: int) -> None:
    part[part == part[other]] = part[one]


def _as_places(places_m: FloatArray) -> tuple[tuple[float, float, float], ...]:
    return tuple((float(x), float(y), float(z)) for x, y, z in places_m)


def _farthest(distance_m: FloatArray) -> int:
    """The first of those that are as far as any, to a micrometre: the same on every machine."""
    return int(np.flatnonzero(distance_m >= distance_m.max() - 1e-6)[0])

"""The reason of every patch: what keeps it from being covered. docs/method/unseen.md.

Input what candidates see and what the plan covers, output `REASONS` by patch. What candidates see is known of every
patch. For the others lines of sight are cast, for a sample of them: one patch stands for all of its element that face
the same way in the same room within 0.4 m. So the cost is bounded, and areas still add up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.coverage.sightlines import first_surfaces, sight_reasons, viewpoints
from planner_core.coverage.surfaces import Surfaces
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import (
    BoolArray,
    FloatArray,
    Int32Array,
    Int64Array,
    Optics,
    PointLimits,
    SealedArea,
    Survey,
    UInt8Array,
)
from planner_core.model.unseen import (
    COVERED,
    IN_SOLIDS,
    NO_RETURN,
    NO_SPOT,
    NOT_WORTH,
    OCCLUDED,
    OUT_OF_SCOPE,
    TOO_FEW,
)
from planner_core.scene.inside import enclosures
from planner_core.scene.rooms import IN_FRONT_M, room_of_points
from planner_core.scene.unique_rows import groups_of_equal_rows

#: Patches of one element, room and direction in a cube of this side have one sample; of larger cubes where that would
#: be more than `MAX_SAMPLES` in all.
SAMPLE_M = 0.4
MAX_SAMPLES = 65536
#: A row in this many shows at once that there would be too many samples.
_PART_OF_ROWS = 16
#: A surface with another one this near in front of it touches it.
TOUCHING_M = 0.02
#: A line of sight begins this far off its surface: float32 coordinates.
_OFF_M = 1e-4
#: Ground of sealed rooms is known in cells of some centimetres.
_STRIP_MARGIN_M = 0.1
#: A room is no higher above its ground than this, for telling what lies in a sealed one.
_ROOM_HEIGHT_M = 6.0
#: Up, half up to four sides, level to four sides: where `_N_OUTDOORS` of these, or its normal, meet nothing from in
#: front of a surface, not even a pane, it is outdoors. One or two get out of any room with an open door.
_SKYWARD = np.array([[x, y, z] for z in (1.0, 0.0) for x, y in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))])
_UP = np.array([[0.0, 0.0, 1.0]])
_N_OUTDOORS = 3


@dataclass(frozen=True)
class Seen:
    """What candidates see and the plan covers, by patch. All (P,).

    n_candidates : int32, number of candidates that see the patch as required. achievable : bool, enough of them do.
    covered : bool, the plan's stations do. scope : bool, patches that are required.
    """

    n_candidates: Int32Array
    achievable: BoolArray
    covered: BoolArray
    scope: BoolArray


def reasons_of_patches(
    survey: Survey,
    engine: ScanEngine,
    seen: Seen,
    candidates_m: FloatArray,
    unseen: Surfaces,
    *,
    required: PointLimits,
    sealed: tuple[SealedArea, ...] = (),
) -> UInt8Array:
    """(P,) uint8 of `REASONS`; `OUT_OF_SCOPE` where not required.

    Parameters
    ----------
    candidates_m
        (N, 3), local frame, all of them.
    unseen
        The patches that are in scope and not covered.
    sealed
        Rooms that nobody can walk into.
    """
    out = np.full(survey.patches.n_patches, OUT_OF_SCOPE, dtype=np.uint8)
    out[seen.scope] = COVERED
    # None of these is covered: the word stands for a reason that is not known yet, here and in `sight_reasons`.
    reason = np.where(seen.achievable[unseen.patch], NOT_WORTH, COVERED)
    reason[(reason == COVERED) & (seen.n_candidates[unseen.patch] > 0)] = TOO_FEW
    optics = survey.scene.optics_of_triangle
    if optics is not None:
        reason[optics[unseen.triangle] != Optics.RETURNS] = NO_RETURN
    left = np.flatnonzero(reason == COVERED)
    sample, of_sample = samples_of(unseen, left)
    samples, views_m = unseen.take(sample), viewpoints(candidates_m)
    found = sight_reasons(survey, required, engine, samples, views_m)
    hidden = np.flatnonzero(found == COVERED)
    found[hidden] = _hidden_reasons(survey, engine, samples.take(hidden), views_m, candidates_m, sealed)
    reason[left] = found[of_sample]
    out[unseen.patch] = reason
    return out


def samples_of(unseen: Surfaces, rows: Int64Array) -> tuple[Int64Array, Int64Array]:
    """The rows that are examined (K,), and which of these stands for each of `rows`."""
    facing = np.abs(unseen.normal[rows]).argmax(axis=1) if rows.size else rows
    facing = 2 * facing + (unseen.normal[rows, facing] > 0)
    place = np.column_stack([unseen.element[rows], unseen.room[rows], facing])

    def grouped(some: slice, side_m: float) -> tuple[Int64Array, Int64Array]:
        cube = np.floor(unseen.centroid_m[rows[some]] / side_m).astype(np.int64)
        return groups_of_equal_rows(np.column_stack([place[some], cube]))

    side_m = SAMPLE_M
    while True:
        whole = side_m > 1e5  # all of an element's faces in one cube: this is as few as it gets
        # Where a part of the rows alone has too many, all of them have.
        if whole or grouped(slice(None, None, _PART_OF_ROWS), side_m)[0].size <= MAX_SAMPLES:
            first, group = grouped(slice(None), side_m)
            n_groups = first.size
            if n_groups <= MAX_SAMPLES or whole:
                break
        side_m *= 1.5
    order = np.argsort(group, kind="stable")
    count = np.bincount(group, minlength=n_groups)
    middle = np.cumsum(count) - count + count // 2  # patches are in order along their triangles
    return rows[order[middle]], group


def _hidden_reasons(
    survey: Survey,
    engine: ScanEngine,
    samples: Surfaces,
    views_m: FloatArray,
    candidates_m: FloatArray,
    sealed: tuple[SealedArea, ...],
) -> Int64Array:
    """(N,) reasons of samples that no viewpoint sees, however far and fine it looks."""
    out = np.full(samples.patch.size, IN_SOLIDS, dtype=np.int64)
    solids = _Solids(survey, views_m)
    rooms_with_position = np.unique(room_of_points(survey.scene, candidates_m))
    outdoors = bool(_n_escapes(engine, views_m, _UP).any())
    for side in (1.0, -1.0):
        normal = side * samples.normal
        off_m, _ = first_surfaces(survey, engine, samples.centroid_m + _OFF_M * normal, normal)
        is_open = ~(off_m <= TOUCHING_M)
        is_open[is_open] = ~solids.hold(samples.centroid_m[is_open] + 0.5 * TOUCHING_M * normal[is_open])
        front_m = samples.centroid_m + IN_FRONT_M * normal
        room = room_of_points(survey.scene, front_m)
        no_position = (room >= 0) & ~np.isin(room, rooms_with_position)
        no_position |= _in_sealed(survey, sealed, front_m)
        if not outdoors:
            begin_m = samples.centroid_m + 0.5 * TOUCHING_M * normal
            n_escapes = _n_escapes(engine, begin_m, np.concatenate([_UP, _SKYWARD]))
            no_position |= (room < 0) & (np.isnan(off_m) | (n_escapes >= _N_OUTDOORS))
        # Of two open sides the one without a spot is the better sign: the other is mostly inside a shape that is not
        # closed.
        out[is_open & ~no_position & (out == IN_SOLIDS)] = OCCLUDED
        out[is_open & no_position] = NO_SPOT
    return out


class _Solids:
    """Elements that are closed shapes and hold no viewpoint: a shell with candidates in it is a room."""

    def __init__(self, survey: Survey, views_m: FloatArray) -> None:
        scene = survey.scene
        corners_m, element = scene.vertices_m[scene.triangles], scene.element_of_triangle.astype(np.int64)
        hollow = np.unique(enclosures(views_m, corners_m, element).shape)
        solid = ~np.isin(element, hollow)
        self._corners_m, self._element = corners_m[solid], element[solid]

    def hold(self, points_m: FloatArray) -> BoolArray:
        """(N,) bool: points (N, 3) inside any of them."""
        out = np.zeros(points_m.shape[0], dtype=np.bool_)
        out[enclosures(points_m, self._corners_m, self._element).point] = True
        return out


def _n_escapes(engine: ScanEngine, points_m: FloatArray, directions: FloatArray) -> Int64Array:
    """(N,) in how many of directions (K, 3) nothing is met from points (N, 3)."""
    out = np.zeros(points_m.shape[0], dtype=np.int64)
    for direction in directions:
        hits = engine.cast_rays(points_m, np.tile(direction, (points_m.shape[0], 1)), range_max_m=np.inf)
        out += hits.triangle < 0
    return out


def _in_sealed(survey: Survey, sealed: tuple[SealedArea, ...], points_m: FloatArray) -> BoolArray:
    """(N,) bool: points (N, 3) above the ground of a room that nobody can walk into."""
    out = np.zeros(points_m.shape[0], dtype=np.bool_)
    elevations_m = np.array([floor.elevation_m for floor in survey.floors])
    for area in sealed:
        ground_m = float(area.inside_m[2])
        above = elevations_m[elevations_m > ground_m + 1.0]
        top_m = float(above.min()) if above.size else ground_m + _ROOM_HEIGHT_M
        low, high = area.strips_m[:, 0] - _STRIP_MARGIN_M, area.strips_m[:, 1] + _STRIP_MARGIN_M
        level = np.flatnonzero((points_m[:, 2] > ground_m - _STRIP_MARGIN_M) & (points_m[:, 2] < top_m))
        # Most points are nowhere near: not every strip is tested with them.
        plan_m = points_m[level, :2]
        level = level[np.all((plan_m >= low.min(axis=0)) & (plan_m <= high.max(axis=0)), axis=1)]
        at = points_m[level, None, :2]
        out[level] |= np.any(np.all((at >= low) & (at <= high), axis=2), axis=1)
    return out

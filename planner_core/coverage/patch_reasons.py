"""The reason of every patch: what keeps it from being covered. docs/method/unseen.md.

Input what candidates see and what the plan covers, output `REASONS` by patch. What candidates see is known of every
patch. For the others lines of sight are cast, for a sample of them: one patch stands for all of its element that face
the same way in the same room within 0.4 m. So the cost is bounded, and areas still add up.

Lines of sight show which limit keeps a surface from being seen well enough where candidates have it in plain view:
those of samples that some viewpoint sees when range, field of view and density do not matter.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from planner_core.coverage.observations import Observations, with_noise
from planner_core.engine.patch_mode import LEAST_RETURNS
from planner_core.engine.patch_samples import View, expected_returns, in_view, places_of, view_of
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import (
    BeamTemplate,
    BoolArray,
    FloatArray,
    Int32Array,
    Int64Array,
    Optics,
    PointLimits,
    Survey,
    UInt8Array,
    UnreachableArea,
)
from planner_core.model.arrays import dots, lengths
from planner_core.model.unseen import (
    COVERED,
    IN_SOLIDS,
    NO_RETURN,
    NO_SPOT,
    NOT_WORTH,
    OCCLUDED,
    OUT_OF_RANGE,
    OUT_OF_SCOPE,
    OUT_OF_VIEW,
    TOO_FEW,
    TOO_NOISY,
    TOO_OBLIQUE,
    TOO_SPARSE,
)
from planner_core.scene.array_rows import groups_of_equal_rows
from planner_core.scene.inside import enclosures
from planner_core.scene.rooms import IN_FRONT_M, room_of_points, room_of_surfaces

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
#: Ground of unreachable rooms is known in cells of some centimetres.
_STRIP_MARGIN_M = 0.1
#: A room is no higher above its ground than this, for telling what lies in an unreachable one.
_ROOM_HEIGHT_M = 6.0
#: Up, half up to four sides, level to four sides: where `_N_OUTDOORS` of these, or its normal, meet nothing from in
#: front of a surface, not even a pane, it is outdoors. One or two get out of any room with an open door.
_SKYWARD = np.array([[x, y, z] for z in (1.0, 0.0) for x, y in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))])
_UP = np.array([[0.0, 0.0, 1.0]])
_N_OUTDOORS = 3
#: A sample is tested from this many viewpoints near by, and as many spread over all: across halls and atria.
N_NEAR, _N_SPREAD = 48, 16
#: Viewpoints are candidates, one of each cube of this side; of larger ones where that would be more than
#: `_MAX_VIEWPOINTS`.
_VIEWPOINT_M = 0.75
_MAX_VIEWPOINTS = 2048
#: Beyond this incidence a surface without returns is too oblique, and not the scan too sparse, whatever is required.
GRAZING_RAD = float(np.deg2rad(80.0))
#: A ray that ends this near the sample, and a share of its length, ends on it: float32 coordinates.
_ON_SURFACE_M, _ON_SURFACE_SHARE = 1e-3, 2e-5
#: Panes that a line of sight is followed through.
_MAX_PANES = 8
_BATCH_RAYS = 200_000
#: In the order in which they are named where the best view fails by several.
_LIMITS = np.array([OUT_OF_RANGE, OUT_OF_VIEW, TOO_OBLIQUE, TOO_SPARSE, TOO_NOISY], dtype=np.uint8)


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
    unreachable: tuple[UnreachableArea, ...] = (),
) -> UInt8Array:
    """(P,) uint8 of `REASONS`; `OUT_OF_SCOPE` where not required.

    Parameters
    ----------
    candidates_m
        (N, 3), local frame, all of them.
    unseen
        The patches that are in scope and not covered.
    unreachable
        Rooms that nobody can walk into.
    """
    out = np.full(survey.patches.n_patches, OUT_OF_SCOPE, dtype=np.uint8)
    out[seen.scope] = COVERED
    # None of these is covered: the word stands for a reason that is not known yet, here and in `_sight_reasons`.
    reason = np.where(seen.achievable[unseen.patch], NOT_WORTH, COVERED)
    reason[(reason == COVERED) & (seen.n_candidates[unseen.patch] > 0)] = TOO_FEW
    optics = survey.scene.optics_of_triangle
    if optics is not None:
        reason[optics[unseen.triangle] != Optics.RETURNS] = NO_RETURN
    left = np.flatnonzero(reason == COVERED)
    sample, of_sample = samples_of(unseen, left)
    samples, views_m = unseen.take(sample), viewpoints(candidates_m)
    found = _sight_reasons(survey, required, engine, samples, views_m)
    hidden = np.flatnonzero(found == COVERED)
    found[hidden] = _hidden_reasons(survey, engine, samples.take(hidden), views_m, candidates_m, unreachable)
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


def viewpoints(positions_m: FloatArray) -> FloatArray:
    """(V, 3) of positions (N, 3): the first of each cube, at most `_MAX_VIEWPOINTS`."""
    side_m = _VIEWPOINT_M
    while True:
        cube = np.floor(positions_m / side_m).astype(np.int64)
        _, first = np.unique(cube, axis=0, return_index=True)
        if first.size <= _MAX_VIEWPOINTS:
            return positions_m[np.sort(first)]
        side_m *= 1.25


def _sight_reasons(
    survey: Survey,
    required: PointLimits,
    engine: ScanEngine,
    samples: Surfaces,
    views_m: FloatArray,
) -> Int64Array:
    """(N,) why each sample is not seen well enough though in plain view; `COVERED` where no viewpoint (V, 3) has it so.

    `IN_SOLIDS`: another surface lies in the same place, and no beam can distinguish which of both it meets.
    """
    out = np.full(samples.patch.size, COVERED, dtype=np.int64)
    if not views_m.size:
        return out
    for rows, views in _pairs(samples, views_m):
        sample = np.repeat(rows, views.shape[1])
        at_m = views_m[views.ravel()]
        own, other = _plain_view(survey, engine, samples, sample, at_m)
        out[np.setdiff1d(sample[other], sample[own])] = IN_SOLIDS
        sample, at_m = sample[own], at_m[own]
        fails, range_m = _failures(survey, required, samples.take(sample), at_m)
        # The view that fails by the fewest limits, of those the nearest.
        order = np.lexsort((range_m, fails.sum(axis=1), sample))
        seen, best = np.unique(sample[order], return_index=True)
        fails = fails[order[best]]
        out[seen] = np.where(fails.any(axis=1), _LIMITS[fails.argmax(axis=1)], TOO_SPARSE)
    return out


def _first_surfaces(
    survey: Survey, engine: ScanEngine, origins_m: FloatArray, directions: FloatArray
) -> tuple[FloatArray, Int64Array]:
    """Range (M,), NaN on a miss, and triangle (M,), -1, of what unit rays meet first; panes let them through."""
    hits = engine.cast_rays(origins_m, directions, range_max_m=np.inf)
    range_m, triangle = hits.range_m.astype(np.float64), hits.triangle.astype(np.int64)
    optics = survey.scene.optics_of_triangle
    if optics is None:
        return range_m, triangle
    for _ in range(_MAX_PANES):
        behind = np.flatnonzero((triangle >= 0) & (optics[triangle] == Optics.PASSES))
        if not behind.size:
            break
        gone_m = range_m[behind] + _ON_SURFACE_M
        hits = engine.cast_rays(
            origins_m[behind] + gone_m[:, None] * directions[behind], directions[behind], range_max_m=np.inf
        )
        range_m[behind], triangle[behind] = gone_m + hits.range_m, hits.triangle
    return range_m, triangle


@dataclass(frozen=True)
class _SightLines:
    """One line of sight a row. to_m : (M, 3) from the viewpoint to the sample."""

    to_m: FloatArray
    range_m: FloatArray
    cosine: FloatArray


@dataclass(frozen=True)
class Surfaces:
    """Patches (N,) int32 and what they are parts of.

    triangle, element, room, floor : (N,) int64; room and floor are -1 for none. corners_m : (N, 3, 3). centroid_m,
    normal : (N, 3), normals unit, as the faces wind. area_m2 : (N,).
    """

    patch: Int32Array
    triangle: Int64Array
    element: Int64Array
    room: Int64Array
    floor: Int64Array
    corners_m: FloatArray
    centroid_m: FloatArray
    normal: FloatArray
    area_m2: FloatArray

    def take(self, rows: Int64Array) -> Surfaces:
        """Some of them, in the order given."""
        return Surfaces(**{name: values[rows] for name, values in vars(self).items()})


def surfaces_of(survey: Survey, patch: Int32Array) -> Surfaces:
    """Describe patches (N,)."""
    scene, patches = survey.scene, survey.patches
    triangle = (np.searchsorted(patches.first_patch, patch, side="right") - 1).astype(np.int64)
    places = places_of(scene, patches, patch)
    centroid_m = places.corners_m.mean(axis=1)
    normal = places.normal.copy()
    normal[(normal == 0).all(axis=1)] = (0.0, 0.0, 1.0)  # slivers that float32 makes lines of: any direction will do
    return Surfaces(
        patch=patch,
        triangle=triangle,
        element=scene.element_of_triangle[triangle].astype(np.int64),
        room=room_of_surfaces(scene, centroid_m, normal).astype(np.int64),
        floor=survey.floor_of_triangle[triangle].astype(np.int64),
        corners_m=places.corners_m,
        centroid_m=centroid_m,
        normal=normal,
        area_m2=patches.area_m2[patch],
    )


def _hidden_reasons(
    survey: Survey,
    engine: ScanEngine,
    samples: Surfaces,
    views_m: FloatArray,
    candidates_m: FloatArray,
    unreachable: tuple[UnreachableArea, ...],
) -> Int64Array:
    """(N,) reasons of samples that no viewpoint sees, however far and fine it looks."""
    out = np.full(samples.patch.size, IN_SOLIDS, dtype=np.int64)
    solids = _Solids(survey, views_m)
    rooms_with_position = np.unique(room_of_points(survey.scene, candidates_m))
    outdoors = bool(_n_escapes(engine, views_m, _UP).any())
    for side in (1.0, -1.0):
        normal = side * samples.normal
        off_m, _ = _first_surfaces(survey, engine, samples.centroid_m + _OFF_M * normal, normal)
        is_open = ~(off_m <= TOUCHING_M)
        is_open[is_open] = ~solids.hold(samples.centroid_m[is_open] + 0.5 * TOUCHING_M * normal[is_open])
        front_m = samples.centroid_m + IN_FRONT_M * normal
        room = room_of_points(survey.scene, front_m)
        no_position = (room >= 0) & ~np.isin(room, rooms_with_position)
        no_position |= _in_unreachable(survey, unreachable, front_m)
        if not outdoors:
            begin_m = samples.centroid_m + 0.5 * TOUCHING_M * normal
            n_escapes = _n_escapes(engine, begin_m, np.concatenate([_UP, _SKYWARD]))
            no_position |= (room < 0) & (np.isnan(off_m) | (n_escapes >= _N_OUTDOORS))
        # Of two open sides the one without a spot is the better sign: the other is mostly inside a shape that is not
        # closed.
        out[is_open & ~no_position & (out == IN_SOLIDS)] = OCCLUDED
        out[is_open & no_position] = NO_SPOT
    return out


def _n_escapes(engine: ScanEngine, points_m: FloatArray, directions: FloatArray) -> Int64Array:
    """(N,) in how many of directions (K, 3) nothing is met from points (N, 3)."""
    out = np.zeros(points_m.shape[0], dtype=np.int64)
    for direction in directions:
        hits = engine.cast_rays(points_m, np.tile(direction, (points_m.shape[0], 1)), range_max_m=np.inf)
        out += hits.triangle < 0
    return out


def _in_unreachable(survey: Survey, unreachable: tuple[UnreachableArea, ...], points_m: FloatArray) -> BoolArray:
    """(N,) bool: points (N, 3) above the ground of a room that nobody can walk into."""
    out = np.zeros(points_m.shape[0], dtype=np.bool_)
    elevations_m = np.array([floor.elevation_m for floor in survey.floors])
    for area in unreachable:
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


def _pairs(samples: Surfaces, views_m: FloatArray) -> Iterator[tuple[Int64Array, Int64Array]]:
    """Samples (B,) and the viewpoints (B, W) that each is tested from, some samples at a time."""
    from scipy.spatial import cKDTree

    n_views = views_m.shape[0]
    spread = np.arange(0, n_views, max(1, n_views // _N_SPREAD))[:_N_SPREAD] if n_views > N_NEAR else np.zeros(0, int)
    tree = cKDTree(views_m)
    step = max(1, _BATCH_RAYS // (N_NEAR + _N_SPREAD))
    for first in range(0, samples.patch.size, step):
        rows = np.arange(first, min(first + step, samples.patch.size))
        _, near = tree.query(samples.centroid_m[rows], k=range(1, min(N_NEAR, n_views) + 1))
        far = np.broadcast_to(spread, (rows.size, spread.size))
        yield rows, np.concatenate([near.reshape(rows.size, -1), far], axis=1).astype(np.int64)


def _plain_view(
    survey: Survey, engine: ScanEngine, samples: Surfaces, sample: Int64Array, at_m: FloatArray
) -> tuple[BoolArray, BoolArray]:
    """(M,) bool: the line from `at_m` to each sample ends on its own triangle, or on another in its place."""
    to = samples.centroid_m[sample] - at_m
    to[(to == 0).all(axis=1)] = (0.0, 0.0, 1e-6)  # a viewpoint on the surface itself is blocked all round
    range_m = lengths(to)
    hit_m, triangle = _first_surfaces(survey, engine, at_m, to / range_m[:, None])
    there = np.abs(hit_m - range_m) <= _ON_SURFACE_M + _ON_SURFACE_SHARE * range_m
    own = triangle == samples.triangle[sample]
    return there & own, there & ~own


def _failures(
    survey: Survey, required: PointLimits, samples: Surfaces, at_m: FloatArray
) -> tuple[BoolArray, FloatArray]:
    """(M, 5) bool: limits, as `_LIMITS`, that lines of sight fail; and their ranges (M,)."""
    to_m = samples.centroid_m - at_m
    range_m = lengths(to_m)
    cosine = np.clip(np.abs((to_m * samples.normal).sum(axis=1)) / range_m, 0.0, 1.0)
    look = _SightLines(to_m, range_m, cosine)
    incidence = np.arccos(cosine)
    template = survey.template
    limit_m = template.range_max_m if required.range_m is None else min(template.range_max_m, required.range_m)
    far = (range_m > limit_m) | (range_m < template.range_min_m)
    outside, sparse = _by_template(template, required, samples, look)
    steep = incidence > GRAZING_RAD
    oblique = sparse & steep
    if required.incidence_rad is not None:
        oblique |= incidence > required.incidence_rad
    noisy = np.zeros(range_m.size, dtype=np.bool_)
    if required.noise_m is not None:
        observations = Observations(np.array([0]), np.zeros(0, np.int32), 0, range_m, range_m, incidence)
        noise_m = with_noise(observations, survey.scanner, reflectivity=survey.reflectivity).noise_m
        noisy = np.ones_like(noisy) if noise_m is None else ~(noise_m <= required.noise_m)
    return np.column_stack([far, outside, oblique, sparse & ~steep, noisy]), range_m


def _by_template(
    template: BeamTemplate, required: PointLimits, samples: Surfaces, look: _SightLines
) -> tuple[BoolArray, BoolArray]:
    """(M,) bool each: outside the field of view; fewer points than required, or none to be expected."""
    none = np.zeros(look.range_m.size, dtype=np.bool_)
    if min(template.shape) < 2:  # one row or column has no field of view, and nobody knows its steps
        return none, none
    view = view_of(template)
    anywhere = View(**{**vars(view), "range_min_m": 0.0, "range_max_m": np.inf})
    outside = ~in_view(anywhere, look.to_m[:, None], samples.normal)[:, 0]
    relative_m = samples.corners_m - (samples.centroid_m - look.to_m)[:, None]
    sparse = expected_returns(view, relative_m, samples.normal, samples.area_m2) < LEAST_RETURNS
    if required.spacing_m is not None:
        sparse |= _spacing_m(view, samples.normal, look) > required.spacing_m
    return outside, sparse & ~outside


def _spacing_m(view: View, normal: FloatArray, look: _SightLines) -> FloatArray:
    """(M,) the larger of the distances between points of neighbouring columns and rows, docs/method/levels.md."""
    along = look.to_m / look.range_m[:, None]
    level = np.hypot(along[:, 0], along[:, 1])
    across = np.where(level > 0, level, 1.0)
    sideways = np.stack([-along[:, 1] / across, along[:, 0] / across, np.zeros_like(level)], axis=1)
    sideways[level == 0] = (0.0, 1.0, 0.0)
    upwards = np.cross(along, sideways)
    with np.errstate(divide="ignore", invalid="ignore"):
        columns, rows = (np.hypot(1.0, dots(normal, t) / look.cosine) for t in (sideways, upwards))
    return np.asarray(look.range_m * np.fmax(view.azimuth_step_rad * level * columns, view.elevation_step_rad * rows))

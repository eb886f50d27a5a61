"""Scope: which patches a survey of the inside, or of the outside, is about. docs/method/scope.md.

Input a `Survey` (local frame, metres) with an open engine, output the same with its `SurveyScope`. Nothing but surfaces
is used, no classes and no rooms, so that meshes do as well as IFC. Rays meet glass and shut doors.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from planner_core.coverage.patch_reasons import Surfaces, samples_of, viewpoints
from planner_core.engine.open3d import Open3DEngine
from planner_core.engine.open_engine import engine_facts
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import RequirementError
from planner_core.kept import hash_of_survey, kept
from planner_core.model import (
    BoolArray,
    Doors,
    FloatArray,
    Int32Array,
    Int64Array,
    Requirements,
    Scope,
    Survey,
    SurveyScope,
)
from planner_core.model.arrays import area_normals, dots, lengths
from planner_core.positions.free_space import FreeSpace, free_space
from planner_core.positions.reach import MIN_REGION_M2, reachability
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.requirements.goals import wanted_of
from planner_core.scene.outdoor_ground import OUTDOORS_M, with_exterior_doors_shut
from planner_core.scene.patches import make_patches, patch_triangles

#: The ground is observed from one place of each square of this side: less than a wall and a person on both
#: sides of it take.
_PLACE_M = 0.4
#: Eyes of a surveyor, above the ground.
_EYE_M = 1.6
#: Directions of a look, over the whole sphere.
_N_DIRECTIONS = 128
#: A place is indoors where less of what an eye sees above `_LOWEST` is open, by solid angle: a loggia's middle has
#: 0.15, the strip below low eaves 0.25, a porch before a wall 0.3, the pavement along a wall 0.5.
_INDOORS = 0.2
#: Least z of a look from an eye: 30 degrees down.
_LOWEST = -0.5
#: A surface in plain view of the rooms is indoors unless more of its half of the sphere is open: a threshold has 0.2,
#: the garden before an open door 0.9.
_SURFACE_INDOORS = 0.35
#: A surface is outdoors where as much of its half of the sphere is open: below deep eaves there is no more.
_SURFACE_OUTDOORS = 0.2
#: Off a surface, and back from one that was hit.
_OFF_M = 0.02
#: Ground with walls to all sides within this, and no roof, has lost its roof.
_WALLS_M, _N_LEVEL, _WALLED_SHARE = 12.0, 24, 0.85
#: Less ground than this indoors, or walled without a roof, decides nothing.
_LEAST_M2 = 4.0
#: The strip along an open side that counts as outdoors is no wider. A doorway without a door shows less of a porch than
#: this share of the rooms.
_SIDE_M, _SIDES_SHARE = 4.0, 0.05
_BATCH_RAYS = 500_000
#: Side of the cubes of which one eye each looks across halls.
_APART_M = 3.0
#: Side of the cubes of which one patch stands for those that no eye near by sees, see `_seen_from_rooms`.
_BLOCK_M = 1.0
#: Least cosine of incidence of a look, and where it begins off its surface.
_GRAZING, _OFF_SURFACE_M = 0.02, 1e-3


@dataclass(frozen=True)
class Places:
    """Walkable places. ground_m : (K, 3). area_m2 : (K,) of ground that each stands for. floor : (K,) int32.

    indoors : (K,) bool. walled : (K,) bool, not indoors, but with walls to all sides.
    """

    ground_m: FloatArray
    area_m2: FloatArray
    floor: Int32Array
    indoors: BoolArray
    walled: BoolArray

    @property
    def indoors_m2(self) -> float:
        """Ground indoors."""
        return float(self.area_m2[self.indoors].sum())


def with_scope(
    survey: Survey,
    requirements: Requirements,
    engine: ScanEngine,
    *,
    space: FreeSpace | None = None,
    progress: Progress = silent,
) -> Survey:
    """Find what of the survey is in scope; its warnings get a line where `auto` found no rooms.

    `space` is a person's free space without zones, where somebody has it.

    Raises
    ------
    RequirementError
        Interior or exterior is required, and there is none.
    """
    required, wanted = requirements.scope, wanted_of(survey, requirements)
    joins_outside = survey.scene.source.doors == Doors.OUTSIDE
    if joins_outside and required not in (Scope.AUTO, Scope.INTERIOR):
        raise _nothing_to_join(required)
    if required == Scope.ALL:
        return replace(survey, scope=_scope_of(survey, required, wanted, wanted, None))
    without = ("template", "scanner", "scan_mode", "reflectivity", "scope")
    scope, lines = kept(
        "scope",
        [hash_of_survey(survey, without=without), required, wanted, engine_facts(engine)],
        lambda: _found(survey, required, wanted, engine, space, progress),
        classes=(SurveyScope,),
        progress=progress,
        done=ProgressEvent("scope", 2, 2),
    )
    scope = replace(scope, kind=Scope(scope.kind))  # what is kept has the word
    return replace(survey, scope=scope, warnings=(*survey.warnings, *lines))


def _found(
    survey: Survey,
    required: Scope,
    wanted: BoolArray,
    engine: ScanEngine,
    space: FreeSpace | None,
    progress: Progress,
) -> tuple[SurveyScope, tuple[str, ...]]:
    """Find the scope, and lines for the user, see `with_scope`. wanted : (P,) bool, more than obstacles."""
    joins_outside = survey.scene.source.doors == Doors.OUTSIDE
    progress(ProgressEvent("scope", 0, 2, "indoors and outdoors"))
    shut = with_exterior_doors_shut(survey.scene)
    if shut is not survey.scene:  # rooms behind open doors are indoors all the same
        engine = Open3DEngine(shut, make_patches(shut, max_area_m2=survey.patches.max_area_m2))
    places = find_places(survey, engine, free_space(survey) if space is None else space)
    lost = _not_a_building(survey, places)
    kind = (Scope.ALL if lost else Scope.INTERIOR) if required == Scope.AUTO else required
    if required == Scope.INTERIOR and places.indoors_m2 < _LEAST_M2:
        raise RequirementError(f"scope interior: got a building without any, {lost}; use scope all")
    progress(ProgressEvent("scope", 1, 2, "surfaces"))
    if joins_outside and kind != Scope.INTERIOR:
        raise _nothing_to_join(kind, lost)
    in_scope = observed = wanted
    if kind != Scope.ALL:
        outside = joins_outside or kind == Scope.EXTERIOR
        inner, outer = patches_by_side(survey, engine, places, np.flatnonzero(wanted), outside=outside)
        in_scope = inner if kind == Scope.INTERIOR else outer
        observed = inner | outer if joins_outside else in_scope
        if not in_scope.any():
            raise RequirementError(
                f"scope {kind}: got no surface of it, expected some; use scope all, or check what was loaded"
            )
    progress(ProgressEvent("scope", 2, 2))
    found = _scope_of(survey, kind, in_scope, observed, places if kind != Scope.ALL else None)
    lines = (*_yards(survey, places), *_open_sides(survey, engine, places)) if kind == Scope.INTERIOR else ()
    if lost and required == Scope.AUTO:
        lines = (f"scope: all surfaces are planned, as {lost}; --scope interior or exterior chooses",)
    return found, lines


def _nothing_to_join(kind: Scope, why: str = "") -> RequirementError:
    return RequirementError(
        f"join outside: got scope {kind}{f', as {why}' if why else ''}, expected interior, which stations outdoors "
        "join; leave the option out"
    )


def _scope_of(
    survey: Survey, kind: Scope, in_scope: BoolArray, observed: BoolArray, places: Places | None
) -> SurveyScope:
    return SurveyScope(
        kind=kind,
        in_scope=in_scope,
        observed=observed,
        ground_m=np.empty((0, 3)) if places is None else places.ground_m,
        indoors=np.empty(0, dtype=np.bool_) if places is None else places.indoors,
        outdoors_m=OUTDOORS_M if survey.scene.source.doors == Doors.OUTSIDE else 0.0,
    )


def _not_a_building(survey: Survey, places: Places) -> str:
    """Why the model has no inside to be surveyed alone; empty where it has one."""
    if places.indoors_m2 < _LEAST_M2:
        return "no room is enclosed by walls, roof and shut doors and windows"
    for index, floor in enumerate(survey.floors):
        here = places.floor == index
        roofless_m2 = float(places.area_m2[here & places.walled].sum())
        indoors_m2 = float(places.area_m2[here & places.indoors].sum())
        if roofless_m2 > max(_LEAST_M2, indoors_m2):
            return f"floor {floor.name!r} has walls around {roofless_m2:.0f} m2 of ground and no roof"
    return ""


def _yards(survey: Survey, places: Places) -> tuple[str, ...]:
    """A line on each floor with ground that has walls and no roof: it may be a room whose ceiling is not modelled."""
    lines = []
    for index, floor in enumerate(survey.floors):
        yard_m2 = float(places.area_m2[(places.floor == index) & places.walled].sum())
        if yard_m2 > _LEAST_M2:
            lines.append(
                f"scope: floor {floor.name!r} has walls around {yard_m2:.0f} m2 of ground and no roof, a yard and out "
                "of scope; if it is a room, use --scope all"
            )
    return tuple(lines)


def _open_sides(survey: Survey, engine: ScanEngine, places: Places) -> tuple[str, ...]:
    """A line on each floor with ground under cover that nothing parts from its rooms, but for which it is too open.

    That is the strip along the edge of a slab without facade. A porch is behind a wall or a shut door.
    """
    eye_m, indoors = eyes_over(places.ground_m), places.indoors
    row = np.flatnonzero(~indoors & ~places.walled)
    if not row.size or not indoors.any():
        return ()
    up = np.broadcast_to([0.0, 0.0, 1.0], (row.size, 3))
    row = row[engine.cast_rays(eye_m[row], up, range_max_m=np.inf).triangle >= 0]
    room_m = eye_m[indoors]
    away_m, nearest = cKDTree(room_m).query(eye_m[row], distance_upper_bound=_SIDE_M)
    row, nearest = row[np.isfinite(away_m)], nearest[np.isfinite(away_m)]
    way_m = room_m[nearest] - eye_m[row]
    length_m = np.linalg.norm(way_m, axis=1)
    hits = engine.cast_rays(eye_m[row], way_m, range_max_m=np.inf)
    row = row[~(hits.range_m < length_m)]
    lines = []
    for index, floor in enumerate(survey.floors):
        open_m2 = float(places.area_m2[row[places.floor[row] == index]].sum())
        indoors_m2 = float(places.area_m2[indoors & (places.floor == index)].sum())
        if open_m2 > max(_LEAST_M2, _SIDES_SHARE * indoors_m2):
            lines.append(
                f"scope: floor {floor.name!r} has open sides: {open_m2:.0f} m2 of ground under cover along them are "
                "out of scope; to plan it up to the slab's edge, use --scope all"
            )
    return tuple(lines)


# ---------------------------------------------------------------------------------------------- places
def find_places(survey: Survey, engine: ScanEngine, space: FreeSpace) -> Places:
    """Tell indoors from outdoors wherever a person can stand, unreachable rooms among it."""
    reach = reachability(survey, space)
    rooms = [not each.in_solid and (each.reached or each.area_m2 >= MIN_REGION_M2) for each in reach.regions]
    room = np.array([*rooms, False])
    node = np.flatnonzero(room[reach.region])
    side = max(1, int(_PLACE_M / space.grid.cell_m))
    square = np.column_stack([space.cells()[node] // side, np.floor(space.ground_m[node] / 0.5), reach.region[node]])
    # The roomiest of each square, the first of equals.
    order = np.lexsort((node, -space.clearance_m[node]))
    _, first, count = np.unique(square[order], axis=0, return_index=True, return_counts=True)
    chosen = node[order[first]]
    ground_m = space.position_m(chosen)
    eye_m = eyes_over(ground_m)
    indoors = open_around(engine, eye_m) < _INDOORS
    walled = np.zeros(indoors.size, dtype=np.bool_)
    walled[~indoors] = _walled(engine, eye_m[~indoors])
    return Places(ground_m, (count * space.cell_m2).astype(np.float64), space.floor[chosen], indoors, walled)


def eyes_over(ground_m: FloatArray) -> FloatArray:
    """(K, 3) eyes of a surveyor over ground (K, 3)."""
    eye_m: FloatArray = ground_m + np.array([0.0, 0.0, _EYE_M])
    return eye_m


def open_around(engine: ScanEngine, points_m: FloatArray) -> FloatArray:
    """(N,) share of what eyes at points (N, 3) see that is open, see `_open_share`; straight down is the ground."""
    directions = _directions()
    return _open_share(engine, points_m, np.zeros((0, 3)), directions[directions[:, 2] > _LOWEST])


def _directions() -> FloatArray:
    """(K, 3) unit directions, evenly over the sphere: a spiral of the golden angle."""
    number = np.arange(_N_DIRECTIONS) + 0.5
    z = 1.0 - 2.0 * number / _N_DIRECTIONS
    angle = np.pi * (3.0 - np.sqrt(5.0)) * number
    across = np.sqrt(1.0 - z * z)
    return np.column_stack([across * np.cos(angle), across * np.sin(angle), z])


def _open_share(engine: ScanEngine, points_m: FloatArray, normals: FloatArray, directions: FloatArray) -> FloatArray:
    """(N,) share of directions (K, 3) in which it is open air: beams that meet nothing, or what lies under open sky.

    normals : (N, 3) of surfaces, only directions to their side count, and none that meets nothing on its way down:
    models end below, and the underside of a slab is not outdoors. Empty: all do.
    """
    out = np.zeros(points_m.shape[0])
    step = max(1, _BATCH_RAYS // directions.shape[0])
    for start in range(0, points_m.shape[0], step):
        rows = slice(start, start + step)
        n_points = points_m[rows].shape[0]
        point = np.repeat(np.arange(n_points), directions.shape[0])
        ray = np.tile(directions, (n_points, 1))
        if normals.size:
            front = (ray * normals[rows][point]).sum(axis=1) > 0.05
            point, ray = point[front], ray[front]
        counts = np.bincount(
            point[_is_open(engine, points_m[rows][point], ray, down=not normals.size)], minlength=n_points
        )
        out[rows] = counts / np.maximum(np.bincount(point, minlength=n_points), 1)
    return out


def _is_open(engine: ScanEngine, from_m: FloatArray, ray: FloatArray, *, down: bool) -> BoolArray:
    hits = engine.cast_rays(from_m, ray, range_max_m=np.inf)
    missed = hits.triangle < 0
    out: BoolArray = missed & (down | (ray[:, 2] >= 0))
    met = np.flatnonzero(~missed)
    range_m = np.maximum(hits.range_m[met].astype(np.float64) - _OFF_M, 0.0)
    at_m = from_m[met] + range_m[:, None] * ray[met]
    up = engine.cast_rays(at_m, np.tile([0.0, 0.0, 1.0], (met.size, 1)), range_max_m=np.inf)
    out[met[up.triangle < 0]] = True
    return out


def _walled(engine: ScanEngine, points_m: FloatArray) -> BoolArray:
    """(N,) bool: walls to nearly all sides."""
    angle = 2.0 * np.pi * (np.arange(_N_LEVEL) + 0.5) / _N_LEVEL
    level = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(_N_LEVEL)])
    hits = engine.cast_rays(
        np.repeat(points_m, _N_LEVEL, axis=0), np.tile(level, (points_m.shape[0], 1)), range_max_m=_WALLS_M
    )
    share: FloatArray = (hits.triangle >= 0).reshape(-1, _N_LEVEL).mean(axis=1)
    return np.asarray(share >= _WALLED_SHARE)


# --------------------------------------------------------------------------------------------- surfaces
def patches_by_side(
    survey: Survey, engine: ScanEngine, places: Places, patch: Int64Array, *, outside: bool
) -> tuple[BoolArray, BoolArray]:
    """Of patches (K,), those that are indoors, (P,) bool, and those outdoors (none searched for without `outside`).

    A sheet with a room on one side and the garden on the other is both.
    """
    surfaces = _surfaces(survey, patch)
    seen = _seen_from_rooms(engine, surfaces, eyes_over(places.ground_m[places.indoors]))
    inner, outer = (np.zeros(survey.patches.n_patches, dtype=np.bool_) for _ in range(2))
    for side, seen_here in zip((1.0, -1.0), seen, strict=True):
        rows = np.arange(seen_here.size) if outside else np.flatnonzero(seen_here)
        is_open = _openness(engine, surfaces, rows, side)
        is_inner = seen_here[rows] & (is_open < _SURFACE_INDOORS)
        inner[patch[rows]] |= is_inner
        if outside:
            outer[patch[rows]] |= ~is_inner & (is_open >= _SURFACE_OUTDOORS)
    return inner, outer


def _surfaces(survey: Survey, patch: Int64Array) -> Surfaces:
    """Patches (K,); rooms of the source play no part."""
    corners_m = patch_triangles(survey.scene, survey.patches)[patch]
    normal = area_normals(corners_m)
    length = lengths(normal)
    normal = np.where(length[:, None] > 0, normal / np.maximum(length, 1e-300)[:, None], [0.0, 0.0, 1.0])
    triangle = survey.patches.triangle_of_patch[patch].astype(np.int64)
    return Surfaces(
        patch=patch.astype(np.int32),
        triangle=triangle,
        element=survey.scene.element_of_triangle[triangle].astype(np.int64),
        room=np.full(triangle.size, -1, dtype=np.int64),
        floor=survey.floor_of_triangle[triangle].astype(np.int64),
        corners_m=corners_m,
        centroid_m=corners_m.mean(axis=1),
        normal=normal,
        area_m2=survey.patches.area_m2[patch],
    )


def _seen_from_rooms(engine: ScanEngine, surfaces: Surfaces, eyes_m: FloatArray) -> list[BoolArray]:
    """Two (K,) bool: surfaces in plain view of eyes (N, 3), on the side of their normal and the other.

    The nearest eyes look at their middles first; more of them where these see nothing, then some far apart, across
    halls; in the end the nearest look at the corners of the rest, which may be hidden in part.
    """
    out = [np.zeros(surfaces.patch.size, dtype=np.bool_) for _ in range(2)]
    near_m, apart_m = viewpoints(eyes_m), _apart(eyes_m)
    middle_m = surfaces.centroid_m
    corner_m = [0.8 * surfaces.corners_m[:, k] + 0.2 * middle_m for k in range(3)]
    rounds = [(near_m, 0, 8, middle_m), (near_m, 8, 48, middle_m), (apart_m, 0, 16, middle_m)]
    rounds += [(near_m, 0, 12, at_m) for at_m in corner_m]
    block = _blocks(surfaces)
    for number, (some_m, first, end, at_m) in enumerate(rounds):
        look = _SightTest(engine, surfaces, at_m, some_m, list(range(first + 1, min(end, some_m.shape[0]) + 1)))
        if number == 0:
            look(np.arange(block.size), out)
            continue
        # Most of what is hidden is so by blocks, inside walls and above ceilings: one patch of each is tested first.
        hidden, in_view = _hidden_and_in_view(out, block)
        look(_middle_of_each(np.flatnonzero(hidden & ~in_view), block), out)
        hidden, in_view = _hidden_and_in_view(out, block)
        look(np.flatnonzero(hidden & in_view), out)
    return out


def _hidden_and_in_view(seen: list[BoolArray], block: Int64Array) -> tuple[BoolArray, BoolArray]:
    """(K,) whether a patch is hidden until now; (K,) whether something of its block is seen."""
    hidden = ~(seen[0] | seen[1])
    n_seen = np.bincount(block[~hidden], minlength=int(block.max(initial=-1)) + 1)
    return hidden, n_seen[block] > 0


@dataclass(frozen=True)
class _SightTest:
    """Looks from eyes (N, 3) at points `at_m` (K, 3) of surfaces, each from its nearest eyes, by their `ranks`."""

    engine: ScanEngine
    surfaces: Surfaces
    at_m: FloatArray
    eyes_m: FloatArray
    ranks: list[int]

    def __call__(self, rows: Int64Array, seen: list[BoolArray]) -> None:
        """Mark those of rows (R,) that are seen, on the side of their normal and on the other."""
        if not self.ranks:
            return
        tree, step = cKDTree(self.eyes_m), _BATCH_RAYS // len(self.ranks)
        for start in range(0, rows.size, step):
            some = rows[start : start + step]
            _, eye = tree.query(self.at_m[some], k=self.ranks)
            row, eye_m = np.repeat(some, len(self.ranks)), self.eyes_m[eye.ravel()]
            for side, seen_here in zip((1.0, -1.0), seen, strict=True):
                seen_here[_in_view(self.engine, row, self.at_m, self.surfaces.normal, eye_m, side)] = True


def _blocks(surfaces: Surfaces) -> Int64Array:
    """(K,) number of the block that each patch is in: faces of an element that look the same way, in a cube."""
    facing = np.abs(surfaces.normal).argmax(axis=1)
    facing = 2 * facing + (surfaces.normal[np.arange(facing.size), facing] > 0)
    cube = np.floor(surfaces.centroid_m / _BLOCK_M).astype(np.int64)
    _, block = np.unique(np.column_stack([surfaces.element, facing, cube]), axis=0, return_inverse=True)
    numbered: Int64Array = block.ravel()
    return numbered


def _middle_of_each(rows: Int64Array, block: Int64Array) -> Int64Array:
    """Of rows, one of each block: the middle one in their order, which is along triangles."""
    order = rows[np.argsort(block[rows], kind="stable")]
    _, first, count = np.unique(block[order], return_index=True, return_counts=True)
    middle: Int64Array = order[first + count // 2]
    return middle


def _apart(eyes_m: FloatArray) -> FloatArray:
    """The first of eyes (N, 3) in each cube of some metres."""
    _, first = np.unique(np.floor(eyes_m / _APART_M), axis=0, return_index=True)
    return eyes_m[np.sort(first)]


def _in_view(
    engine: ScanEngine, row: Int64Array, at_m: FloatArray, normals: FloatArray, eye_m: FloatArray, side: float
) -> Int64Array:
    """Those of patches (M,) of whose point, in `at_m` (P, 3), an eye (M, 3) has plain view on a side; glass hides."""
    away_m = eye_m - at_m[row]
    distance_m = lengths(away_m)
    front = side * dots(away_m, normals[row]) > _GRAZING * distance_m
    row, away_m, distance_m = row[front], away_m[front], distance_m[front]
    begin_m = at_m[row] + side * _OFF_SURFACE_M * normals[row]
    hits = engine.cast_rays(begin_m, away_m, range_max_m=np.inf)
    seen: Int64Array = row[~(hits.range_m < distance_m - _OFF_M)]
    return seen


def _openness(engine: ScanEngine, surfaces: Surfaces, rows: Int64Array, side: float) -> FloatArray:
    """(R,) open share of the half sphere before some patches, on the side of their normal or on the other."""
    if not rows.size:
        return np.empty(0)
    sample, of_sample = samples_of(surfaces, rows)
    normal = side * surfaces.normal[sample]
    share = _open_share(engine, surfaces.centroid_m[sample] + _OFF_M * normal, normal, _directions())
    return share[of_sample]

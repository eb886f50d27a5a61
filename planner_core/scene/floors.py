"""Floors: the ground of each level that a tripod can stand on, and the level that every triangle counts for.

Input a `Scene` (local frame, metres), output a `FloorReport`. Where the source names storeys (IFC), their slabs and
coverings are searched for; otherwise, large horizontal surfaces. Windings are not trusted: what is a top side follows
from plumb lines (`planner_core.scene.columns`), by the clear height above.

    ======== roof top: open sky, no walls above   -> no floor
      ___    ceiling: little clear height above
             table: there is ground below, and it is smaller  -> no floor
    ======== top of the slab: head-high clear space, something overhead or walls around  -> floor
    -------- its underside: the slab's thickness above  -> no floor
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from planner_core.model import BoolArray, FloatArray, Floor, Int32Array, Scene
from planner_core.model.arrays import area_normals, bounds_of
from planner_core.scene.array_rows import chunks
from planner_core.scene.extent import check_extent
from planner_core.scene.floors_by_storey import WALL_KINDS, grounds_of_storeys
from planner_core.scene.floors_by_surface import grounds_of_surfaces
from planner_core.scene.ground_planes import SITE_KINDS
from planner_core.scene.level_surfaces import MIN_CLEAR_M, Ground, LevelSurvey, strays_named

#: Grounds of all floors of a model, as a share of the rectangle around it, from which it is a building: with walls (a
#: campus fills a tenth of its rectangle, and has storeys), and without.
_LEAST_SHARE, _LEAST_SHARE_BARE = 0.1, 0.3
#: Levels of one floor: nothing slopes over so much of height between them, and each has a tenth of the ground.
_LEVELS_APART_M, _LEAST_LEVEL = 0.5, 0.1
#: A floor that slopes is drawn in bands: a cut 1.2 m above the middle of one is still above its ground, and below the
#: heads of doors. Each costs a look at the whole floor.
_BAND_M, _MAX_BANDS = 0.8, 12


@dataclass(frozen=True)
class FloorReport:
    """What was found.

    floors : lowest first. floor_of_triangle : (T,) int32 into floors, -1 for none: a floor's ground triangles count
    for it, every other triangle for the highest floor whose ground its centroid reaches (5 cm of slack), so that a
    ceiling counts for the level below it. What lies under the lowest ground counts for none.
    warnings : one line each, for the user.
    open_below : (T,) bool, level triangles with a room's height of space below and something under it: of a slab that
    is a single sheet they are the ceiling of the level below as well.
    """

    floors: tuple[Floor, ...]
    floor_of_triangle: Int32Array
    warnings: tuple[str, ...]
    open_below: BoolArray


def find_floors(scene: Scene) -> FloorReport:
    """Find the floors of `scene`.

    Storeys of the source become floors where they have ground with head-high clear space that is covered from above
    or stands between walls. A storey with walls and space but without slab gets the plane at its elevation as ground,
    with a warning. Storeys that offer nothing to stand on (foundations, roof tops) are left out, with a warning.

    Notes
    -----
    `ground_area_m2` is the whole ground, what lies under furniture and walls as well. It counts what lies over each
    other once: the area of the triangles, times the share of them that no other ground covers, times distinct plumb
    lines over crossings. Without storeys, undersides of walls that are flush with the ground count as ground, so that
    a building whose slabs end at its walls has more of it than by its storeys.
    """
    check_extent(scene)
    columns = LevelSurvey(scene)
    warnings: list[str] = strays_named(columns)
    grounds = grounds_of_storeys(columns, warnings) if scene.storeys else []
    if not grounds:
        if scene.storeys:
            warnings.append("none of the storeys is a floor to stand on; floors are taken from large level surfaces")
        grounds = grounds_of_surfaces(columns, warnings)
    if not grounds:
        warnings.append("no floor found: no level surface with 1.5 m of clear space above it")
    grounds = _worth_planning(columns, grounds, warnings)
    in_order = sorted(grounds, key=lambda ground: ground.elevation_m)
    floors = tuple(_floor(index, ground) for index, ground in enumerate(in_order))
    return FloorReport(floors, floor_of_triangles(scene, floors), tuple(warnings), _open_below(columns))


def _open_below(survey: LevelSurvey) -> BoolArray:
    """(T,) bool, see `FloorReport`: a twentieth of a triangle's plumb lines is enough, the rest may be on walls."""
    columns, n_triangles = survey.columns, survey.scene.n_triangles
    depth_m = columns.depth_to_m(np.ones(columns.z_m.size, dtype=bool))
    is_open = np.isfinite(depth_m) & (depth_m >= MIN_CLEAR_M)
    n_all = np.bincount(columns.triangle, minlength=n_triangles)
    n_open = np.bincount(columns.triangle[is_open], minlength=n_triangles)
    found: BoolArray = survey.level & (n_open > 0) & (n_open >= 0.05 * n_all)
    return found


def _worth_planning(survey: LevelSurvey, grounds: list[Ground], warnings: list[str]) -> list[Ground]:
    """Grounds of a building; none where a file holds a single trade with hardly anything to stand on.

    Frames, pipes, lamps and stairs have level tops, too: a building is planned on more than its steps.
    """
    scene = survey.scene
    building = np.flatnonzero(~np.array([e.kind in SITE_KINDS for e in scene.elements])[scene.element_of_triangle])
    building = building[~survey.stray[building]]
    shown = np.unique(scene.element_of_triangle[building])
    kinds = Counter(scene.elements[i].kind for i in shown if scene.elements[i].kind.startswith("Ifc"))
    if not grounds or not kinds:
        return grounds
    has_walls = not WALL_KINDS.isdisjoint(kinds)
    # Of nearly all faces: one that reaches far out is no measure of the building.
    middle_m = survey.middles_of(building.astype(np.int32))[:, :2]
    width_m, depth_m = np.ptp(np.quantile(middle_m, [0.01, 0.99], axis=0), axis=0)
    total_m2 = sum(ground.area_m2 for ground in grounds)
    made_of = f"{'hardly any' if has_walls else 'no'} walls ({', '.join(kind for kind, _ in kinds.most_common(3))} ...)"
    if total_m2 < (_LEAST_SHARE if has_walls else _LEAST_SHARE_BARE) * width_m * depth_m:
        warnings.append(
            f"no floor found: {total_m2:.1f} m2 of ground in a model of {width_m:.0f} x {depth_m:.0f} m with "
            f"{made_of}: it looks like one trade of a building; load the file that has its walls and slabs"
        )
        return []
    if not has_walls:
        warnings.append(
            f"the model has {made_of}, so it looks like one trade of a building: stations may stand where its walls "
            "are; load the file that has them"
        )
    return grounds


def _floor(index: int, ground: Ground) -> Floor:
    return Floor(
        id=f"F{index}",
        name=ground.name,
        elevation_m=ground.elevation_m,
        ground_area_m2=ground.area_m2,
        ground_triangles=ground.triangles,
        bounds_m=ground.bounds_m,
        origin=ground.origin,
        plane_m=ground.plane_m,
    )


def floor_of_triangles(scene: Scene, floors: tuple[Floor, ...]) -> Int32Array:
    """(T,) int32 into floors, lowest first, -1 for none: see `FloorReport`."""
    if not floors:
        return np.full(scene.n_triangles, -1, dtype=np.int32)
    starts = np.array([floor.elevation_m for floor in floors]) - 0.05
    if floors[0].origin == "surface":
        # Where it slopes the elevation is in the middle: what stands at its foot is of it, too.
        ground_m = scene.vertices_m[:, 2][scene.triangles[floors[0].ground_triangles]]
        starts[0] = min(starts[0], float(ground_m.min(initial=np.inf)) - 0.05)
    out = np.empty(scene.n_triangles, dtype=np.int32)
    for some in chunks(scene.n_triangles):
        height_m = scene.vertices_m[:, 2][scene.triangles[some]].mean(axis=1)
        out[some] = np.searchsorted(starts, height_m, side="right") - 1
    for index, floor in enumerate(floors):
        out[floor.ground_triangles] = index
    return out


def ground_levels(scene: Scene, floor: Floor) -> list[tuple[float, FloatArray]]:
    """Heights of a floor's ground, and the triangles (K, 3, 3), local, of each, the floor's own elevation first.

    Most floors have one. Wings half a storey apart have two: what no slope joins, and is a tenth of the ground or more.
    Ground that slopes is cut into bands, each with the height of its middle.
    """
    return [band for each in levels_of(scene, floor) for band in _bands(*each)]


def other_levels(scene: Scene, floor: Floor) -> list[tuple[float, float]]:
    """Height and area in plan of each level of a floor's ground beside its own, such as a mezzanine, lowest first."""
    _, *others = levels_of(scene, floor)
    return sorted((height_m, float(_plan_area_m2(corners_m).sum())) for height_m, corners_m in others)


def levels_of(scene: Scene, floor: Floor) -> list[tuple[float, FloatArray]]:
    """The levels of a floor, the one with its elevation first: height and triangles (K, 3, 3) of each."""
    corners = scene.vertices_m[scene.triangles[floor.ground_triangles]]
    if not len(corners):
        return [(floor.elevation_m, corners)]
    low, high = bounds_of(corners[:, :, 2])
    area_m2 = 0.5 * np.linalg.norm(area_normals(corners), axis=1)
    order = np.argsort(low, kind="stable")
    reached = np.maximum.accumulate(high[order])
    begins = np.concatenate([[True], low[order][1:] > reached[:-1] + _LEVELS_APART_M])
    level = np.empty(len(corners), dtype=np.int64)
    level[order] = np.cumsum(begins) - 1
    share = np.bincount(level, weights=area_m2) / max(float(area_m2.sum()), 1e-12)
    height = np.bincount(level, weights=area_m2 * low) / np.maximum(np.bincount(level, weights=area_m2), 1e-12)
    own = int(np.argmin(np.abs(height - floor.elevation_m)))
    others = [number for number in np.flatnonzero(share >= _LEAST_LEVEL).tolist() if number != own]
    levels = [(float(height[number]), corners[level == number]) for number in others]
    return [(floor.elevation_m, corners[~np.isin(level, others)]), *levels]


def ground_span_m(scene: Scene, floor: Floor) -> tuple[float, float]:
    """Lowest and highest of a floor's ground that is drawn in one piece: its elevation, or both ends of a slope."""
    heights_m = [height_m for height_m, _ in ground_levels(scene, floor)]
    return (min(heights_m), max(heights_m)) if len(heights_m) > 2 else (floor.elevation_m, floor.elevation_m)


def _bands(height_m: float, corners_m: FloatArray) -> list[tuple[float, FloatArray]]:
    """A level of triangles (K, 3, 3) as it is, or, where it slopes, cut into bands of about `_BAND_M` each."""
    area_m2 = _plan_area_m2(corners_m)
    lowest_m, highest_m = bounds_of(corners_m[:, :, 2])
    off = np.maximum(height_m - lowest_m, highest_m - height_m) > _BAND_M
    if area_m2[off].sum() <= _LEAST_LEVEL * area_m2.sum():
        return [(height_m, corners_m)]
    low_m, high_m = float(lowest_m.min()), float(highest_m.max())
    limits_m = np.linspace(low_m, high_m, min(_MAX_BANDS, int(np.ceil((high_m - low_m) / _BAND_M))) + 1)
    bands = []
    for bottom_m, top_m in zip(limits_m[:-1].tolist(), limits_m[1:].tolist(), strict=True):
        last = top_m == limits_m[-1]
        near = (highest_m >= bottom_m) & ((lowest_m < top_m) | last)
        part = _between(corners_m[near], bottom_m, top_m)
        if len(part):
            bands.append((0.5 * (bottom_m + top_m), part))
    return sorted(bands, key=lambda band: abs(band[0] - height_m))


def _between(corners_m: FloatArray, bottom_m: float, top_m: float) -> FloatArray:
    """(L, 3, 3) what of triangles (K, 3, 3) lies between two heights."""
    inside = (corners_m[:, :, 2] >= bottom_m).all(axis=1) & (corners_m[:, :, 2] <= top_m).all(axis=1)
    pieces = [corners_m[inside]]
    for triangle in corners_m[~inside]:
        ring = list(triangle)
        for limit_m, sign in ((bottom_m, 1.0), (top_m, -1.0)):
            ring = _above(ring, limit_m, sign)
        pieces += [np.array([[ring[0], ring[k], ring[k + 1]]]) for k in range(1, len(ring) - 1)]
    cut: FloatArray = np.concatenate(pieces)
    return cut[_plan_area_m2(cut) > 1e-9]


def _above(ring: list[FloatArray], limit_m: float, sign: float) -> list[FloatArray]:
    """The part of a ring of corners above a height; with sign -1 below it."""
    kept = []
    for a, b in zip(ring, ring[1:] + ring[:1], strict=True):
        from_m, to_m = sign * (a[2] - limit_m), sign * (b[2] - limit_m)
        if from_m >= 0:
            kept.append(a)
        if from_m * to_m < 0:
            kept.append(a + from_m / (from_m - to_m) * (b - a))
    return kept


def _plan_area_m2(corners_m: FloatArray) -> FloatArray:
    """(K,) area in plan of triangles (K, 3, 3)."""
    a, b = corners_m[:, 1, :2] - corners_m[:, 0, :2], corners_m[:, 2, :2] - corners_m[:, 0, :2]
    area_m2: FloatArray = 0.5 * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    return area_m2

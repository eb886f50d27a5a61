"""Floors: the ground of each level that a tripod can stand on, and the level that every triangle counts for.

Input a `Scene` (local frame, metres), output a `FloorReport`. Where the source names storeys (IFC), their slabs and
coverings are looked for; otherwise, large horizontal surfaces. Windings are not trusted: what is a top side follows
from plumb lines (`planner_core.scene.columns`), by the clear height above.

    ======== roof top: open sky, no walls above   -> no floor
      ___    ceiling: little clear height above
             table: there is ground below, and it is smaller  -> no floor
    ======== top of the slab: head-high clear space, something overhead or walls around  -> floor
    -------- its underside: the slab's thickness above  -> no floor
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.model import BoolArray, FloatArray, Floor, Int32Array, Int64Array, Scene
from planner_core.scene.bulk import fence_m, is_outside, named_few
from planner_core.scene.columns import Columns, sample_columns

#: IFC classes whose top sides are ground. IfcRoof is not: its slabs are classed IfcSlab only where flat roofs carry a
#: storey, and those are told apart by what is above them.
FLOOR_KINDS = frozenset({"IfcSlab", "IfcSlabStandardCase", "IfcSlabElementedCase", "IfcCovering"})
#: Ramps up to 10 degrees are ground; the steepest that building codes let people walk on is about 7.
MAX_SLOPE_RAD = np.deg2rad(10.0)
#: Clear height from which a surface may be the ground of a level. Crawl spaces and plenums are lower, lofts are not.
MIN_CLEAR_M = 1.5
#: Two levels are at least this far apart; nearer heights are parts of one level (split level), or furniture.
MIN_LEVEL_DISTANCE_M = 1.8
#: Walls are looked for at this height above the ground: over parapets and railings, below door heads.
WALL_CUT_M = 1.5
#: Plumb lines are this far apart; further on large sites, so that their number stays below `_MAX_COLUMNS`.
_STEP_M = 0.1
_MAX_COLUMNS = 400_000
#: Scenes higher than this have strays above or below: no building is.
_HIGHEST_M = 1000.0
#: Heights within this of each other are one surface of a level (uneven scans, thresholds, screeds).
_SAME_HEIGHT_M = 0.15
#: A surface of a scene without storeys is a level's ground if it has this share of the largest one. Desks in an office
#: take about a tenth of the floor.
_MIN_AREA_SHARE = 0.15
_MIN_AREA_M2 = 1.0
#: A storey's ground is the lowest of its surfaces that has this share of the largest: a suspended ceiling may be larger
#: than the ground under it, where that is on two heights.
_LOWEST_SHARE = 0.4
#: Both sides of a plate thinner than this may seem to have clear space above.
_THIN_M = 0.05


@dataclass(frozen=True)
class FloorReport:
    """What was found.

    floors : lowest first. floor_of_triangle : (T,) int32 into floors, -1 for none: a floor's ground triangles count
    for it, every other triangle for the highest floor whose ground its centroid reaches (5 cm of slack), so that a
    ceiling counts for the level below it. What lies under the lowest ground counts for none.
    warnings : one line each, for the user.
    """

    floors: tuple[Floor, ...]
    floor_of_triangle: Int32Array
    warnings: tuple[str, ...]


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
    columns = _Survey(scene)
    warnings: list[str] = _strays_named(columns)
    grounds = _grounds_of_storeys(columns, warnings) if scene.storeys else []
    if not grounds:
        if scene.storeys:
            warnings.append("none of the storeys is a floor to stand on; floors are taken from large level surfaces")
        grounds = _grounds_of_surfaces(columns, warnings)
    if not grounds:
        warnings.append("no floor found: no level surface with 1.5 m of clear space above it")
    floors = tuple(_floor(index, ground) for index, ground in enumerate(sorted(grounds, key=_height)))
    return FloorReport(floors, floor_of_triangles(scene, floors), tuple(warnings))


@dataclass(frozen=True)
class _Ground:
    """A level before it has a number. `triangles` empty: the plane at `elevation_m` inside `bounds_m`."""

    name: str
    origin: str
    elevation_m: float
    triangles: Int32Array
    area_m2: float
    bounds_m: FloatArray


def _height(ground: _Ground) -> float:
    return ground.elevation_m


class _Survey:
    """The scene with its plumb lines and what follows from them."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.corners_m = scene.vertices_m[scene.triangles]
        cross = np.cross(self.corners_m[:, 1] - self.corners_m[:, 0], self.corners_m[:, 2] - self.corners_m[:, 0])
        length = np.sqrt((cross * cross).sum(axis=1))
        self.area_m2: FloatArray = 0.5 * length
        self.level: BoolArray = np.abs(cross[:, 2]) >= np.cos(MAX_SLOPE_RAD) * length
        fence = _fence(self.corners_m)
        self.stray: BoolArray = is_outside(self.corners_m, fence)
        """(T,) Far outside the bulk: no floor is looked for there."""
        self.columns, self.step_m = _plumb_lines(self.corners_m, np.flatnonzero(~self.stray).astype(np.int32), fence)
        self.clear_m = self.columns.clear_height_m()
        self.kind_is_floor = np.array([e.kind in FLOOR_KINDS for e in scene.elements], dtype=bool)
        self.storey_of_element = np.array([e.storey for e in scene.elements], dtype=np.int64)

    @property
    def cell_m2(self) -> float:
        """Area that one plumb line stands for."""
        return self.step_m * self.step_m

    def walls_around(self, bounds_m: FloatArray, ground_m: float) -> bool:
        """Tell whether walls stand on ground: at `WALL_CUT_M` they are half as long as its bounds' perimeter."""
        length, _ = cut_length(self.corners_m[~self.level & ~self.stray], ground_m + WALL_CUT_M, bounds_m)
        return length >= float((bounds_m[1] - bounds_m[0]).sum())

    def bounds_of(self, triangles: Int32Array) -> FloatArray:
        """(2, 2) bounds in plan."""
        plan = self.corners_m[triangles][:, :, :2].reshape(-1, 2)
        return np.stack([plan.min(axis=0), plan.max(axis=0)])


def _fence(corners_m: FloatArray) -> FloatArray:
    """(2, 3) where floors are looked for: everywhere, unless that would pull the plumb lines apart or is very high."""
    points = corners_m.reshape(-1, 3)
    everywhere = np.stack([points.min(axis=0), points.max(axis=0)])
    size = everywhere[1] - everywhere[0]
    if size[0] * size[1] <= _MAX_COLUMNS * _STEP_M * _STEP_M and size[2] <= _HIGHEST_M:
        return everywhere
    fence = fence_m(corners_m)
    return np.stack([np.maximum(fence[0], everywhere[0]), np.minimum(fence[1], everywhere[1])])


def _strays_named(survey: _Survey) -> list[str]:
    if not survey.stray.any():
        return []
    names = [survey.scene.elements[i].name for i in survey.scene.element_of_triangle[survey.stray].tolist()]
    return [
        f"faces that lie far from the rest are not searched for floors: {int(survey.stray.sum())} of {named_few(names)}"
    ]


def _plumb_lines(corners_m: FloatArray, ids: Int32Array, fence: FloatArray) -> tuple[Columns, float]:
    corners_m = corners_m[ids]
    within = ((corners_m >= fence[0]) & (corners_m <= fence[1])).all(axis=(1, 2))  # none reaches far out
    plan = corners_m[within if within.any() else slice(None)][:, :, :2].reshape(-1, 2)
    low, high = np.maximum(plan.min(axis=0), fence[0, :2]), np.minimum(plan.max(axis=0), fence[1, :2])
    step = max(_STEP_M, float(np.sqrt(np.prod(high - low) / _MAX_COLUMNS)))
    # Off the round figures that designers align walls to: a line along a wall's face tells nothing.
    start = low + step * np.array([0.37, 0.43])
    shape = np.maximum(np.floor((high - start) / step) + 1, 1).astype(int)
    return sample_columns(corners_m, ids, low_m=start, step_m=step, shape=(int(shape[0]), int(shape[1]))), step


def cut_length(corners_m: FloatArray, z_m: float, bounds_m: FloatArray | None = None) -> tuple[float, FloatArray]:
    """Length of the cut of triangles (K, 3, 3) with the plane z = z_m, and the segments' ends (M, 2, 2).

    bounds_m : only segments whose middle lies inside, with half a metre of margin.
    """
    height = corners_m[:, :, 2] - z_m
    crossing = (height.min(axis=1, initial=np.inf) < 0) & (height.max(axis=1, initial=-np.inf) >= 0)
    corners, height = corners_m[crossing], height[crossing]
    # Turn each triangle so that its first corner is alone on its side of the plane; edges 0-1 and 0-2 are cut.
    below = height < 0
    alone = np.where(below.sum(axis=1) == 1, np.argmax(below, axis=1), np.argmax(~below, axis=1))
    rows = np.arange(alone.size)
    ends = []
    for other in (1, 2):
        b = (alone + other) % 3
        h0, h1 = height[rows, alone], height[rows, b]
        t = (h0 / (h0 - h1))[:, None]
        ends.append(corners[rows, alone, :2] * (1 - t) + corners[rows, b, :2] * t)
    segments = np.stack(ends, axis=1) if rows.size else np.empty((0, 2, 2))
    if bounds_m is not None:
        middle = segments.mean(axis=1)
        segments = segments[((middle >= bounds_m[0] - 0.5) & (middle <= bounds_m[1] + 0.5)).all(axis=1)]
    return float(np.sqrt(((segments[:, 1] - segments[:, 0]) ** 2).sum(axis=1)).sum()), segments


# ------------------------------------------------------------------------------------- from storeys
def _grounds_of_storeys(survey: _Survey, warnings: list[str]) -> list[_Ground]:
    scene, columns = survey.scene, survey.columns
    element = scene.element_of_triangle[columns.triangle]
    is_floor = survey.level[columns.triangle] & survey.kind_is_floor[element]
    # The top of a slab: no other slab or covering within a raised floor's height above it.
    top = is_floor & (columns.clear_height_m(is_floor) > 0.6)
    clear = top & (survey.clear_m >= MIN_CLEAR_M)
    storey = _storey_of_samples(survey, survey.storey_of_element[element])
    grounds = []
    for index, named in enumerate(scene.storeys):
        ground, reason = _storey_ground(survey, named.name, top & (storey == index), clear & (storey == index))
        if ground is None and not reason:
            ground, reason = _plane_of_storey(survey, index)
            if ground is not None:
                elevation_m = named.elevation_m + float(scene.offset_m[2])
                warnings.append(
                    f"storey {named.name!r} has no floor slab; its elevation {elevation_m:.3f} m is taken as the "
                    "ground: the slabs may be in another discipline's file"
                )
        if ground is not None:
            grounds.append(ground)
        else:
            warnings.append(f"storey {named.name!r} is left out: {reason}")
    return grounds


def _storey_of_samples(survey: _Survey, source_storey: Int64Array) -> Int64Array:
    """Storey of each crossing: the source's where its elevation is within 1.5 m, else the highest one below."""
    elevation = np.array([s.elevation_m for s in survey.scene.storeys])
    z_m = survey.columns.z_m
    by_height = np.maximum(np.searchsorted(elevation, z_m + 0.5, side="right") - 1, 0)
    named = source_storey >= 0
    near = named & (np.abs(z_m - elevation[np.where(named, source_storey, 0)]) <= 1.5)
    return np.where(near, source_storey, by_height)


def _storey_ground(survey: _Survey, name: str, top: BoolArray, clear: BoolArray) -> tuple[_Ground | None, str]:
    """Ground of one storey from its slabs; or None and why not; or None and nothing where there are no slabs."""
    columns = survey.columns
    if clear.sum() * survey.cell_m2 < _MIN_AREA_M2:
        return None, ""
    covered = clear & np.isfinite(survey.clear_m)
    judged = covered if covered.sum() * survey.cell_m2 >= _MIN_AREA_M2 else clear
    main_m = _main_height_m(_once_a_surface(columns, judged), lowest_share=_LOWEST_SHARE)
    main = clear & (np.abs(columns.z_m - main_m) <= _SAME_HEIGHT_M)
    under_cover = float(np.isfinite(survey.clear_m[main]).mean())
    bounds = survey.bounds_of(np.unique(columns.triangle[main]))
    if under_cover < 0.5 and not survey.walls_around(bounds, main_m):
        return None, f"its slabs are in the open ({100 * under_cover:.0f} % covered) and no walls stand on them"
    clear = clear & ~_decks_above(survey, clear, main, main_m)
    # Open-air parts stay where they continue the floor (balcony, terrace), not where they are another roof.
    far = np.abs(columns.z_m - main_m) > 0.6
    clear = clear & ~(far & ~np.isfinite(survey.clear_m))
    slabs = survey.kind_is_floor[survey.scene.element_of_triangle]
    triangles = _mostly(survey, clear, slabs)
    return _ground(survey, name, "slab", triangles, top & np.isin(columns.triangle, triangles), clear), ""


def _decks_above(survey: _Survey, clear: BoolArray, main: BoolArray, main_m: float) -> BoolArray:
    """Crossings of the storey that are its ceiling's top side: a level higher, over ground of the same storey.

    A gallery is smaller than the ground below it; what covers more than 60 % of it is a ceiling. Coverings are
    never galleries.
    """
    columns = survey.columns
    above = clear & (columns.z_m > main_m + MIN_LEVEL_DISTANCE_M)
    has_ground = np.zeros(columns.x_m.size * columns.y_m.size, dtype=bool)
    has_ground[columns.column[main]] = True
    over = above & has_ground[columns.column]
    if over.sum() > 0.6 * main.sum():
        return above
    kinds: BoolArray = np.array([e.kind == "IfcCovering" for e in survey.scene.elements], dtype=bool)
    covering: BoolArray = kinds[survey.scene.element_of_triangle[columns.triangle]]
    return above & covering


def _plane_of_storey(survey: _Survey, index: int) -> tuple[_Ground | None, str]:
    """Ground of a storey without slabs: the plane at its elevation, between its walls."""
    scene, columns = survey.scene, survey.columns
    storey = scene.storeys[index]
    own = (survey.storey_of_element[scene.element_of_triangle] == index) & ~survey.level & ~survey.stray
    _, segments = cut_length(survey.corners_m[own], storey.elevation_m + WALL_CUT_M)
    if segments.shape[0] == 0:
        return None, f"no floor slab, and none of its elements reaches {WALL_CUT_M} m above its elevation"
    plan = segments.reshape(-1, 2)
    bounds = np.stack([plan.min(axis=0), plan.max(axis=0)])
    if not survey.walls_around(bounds, storey.elevation_m):
        return None, "no floor slab and too few walls to be a storey to stand in"
    n_x = columns.x_m.size
    x, y = columns.x_m[columns.column % n_x], columns.y_m[columns.column // n_x]
    inside = (x >= bounds[0, 0]) & (x <= bounds[1, 0]) & (y >= bounds[0, 1]) & (y <= bounds[1, 1])
    above = inside & (columns.z_m > storey.elevation_m + 0.05)
    column, first = np.unique(columns.column[above], return_index=True)
    if column.size:
        # Three quarters, not the median: cupboards and tables stand in the way, low ceilings reach everywhere.
        clear_m = float(np.quantile(columns.z_m[above][first] - storey.elevation_m, 0.75))
        if clear_m < MIN_CLEAR_M:
            return None, f"no floor slab, and only {clear_m:.2f} m of clear height above its elevation"
    # Columns with nothing overhead lie outside an L-shaped house; a house without any roof is taken whole.
    area_m2 = column.size * survey.cell_m2 or float(np.prod(bounds[1] - bounds[0]))
    none = np.empty(0, dtype=np.int32)
    return _Ground(storey.name, "storey-elevation", storey.elevation_m, none, area_m2, bounds), ""


# ------------------------------------------------------------------------------------- from surfaces
def _grounds_of_surfaces(survey: _Survey, warnings: list[str]) -> list[_Ground]:
    """Levels of a scene that names no storeys: heights with much level, head-high area, largest first."""
    columns = survey.columns
    clear = survey.level[columns.triangle] & (survey.clear_m >= MIN_LEVEL_DISTANCE_M)
    levels = _levels(survey, clear & np.isfinite(survey.clear_m))
    # Storeys without a roof in the model: open ground between walls, further than a storey from what was found.
    for main_m, samples in _levels(survey, clear & ~np.isfinite(survey.clear_m)):
        bounds = survey.bounds_of(np.unique(columns.triangle[samples]))
        apart = all(abs(main_m - other) >= MIN_LEVEL_DISTANCE_M for other, _ in levels)
        if apart and survey.walls_around(bounds, main_m):
            levels.append((main_m, samples))
    if not levels:
        levels = _levels(survey, clear)[:1]
        if levels:
            warnings.append("nothing is covered and no walls stand on the ground; the largest level surface is planned")
    grounds = []
    for number, (main_m, samples) in enumerate(sorted(levels, key=lambda level: level[0])):
        near = clear & (np.abs(columns.z_m - main_m) <= _SAME_HEIGHT_M)
        triangles = _mostly(survey, samples | near, survey.level)
        shown = np.isin(columns.triangle, triangles)  # what is under furniture and walls is ground as well
        used = (samples | near) & shown
        grounds.append(_ground(survey, f"Level {number + 1}", "surface", triangles, shown, used))
    return grounds


def _levels(survey: _Survey, clear: BoolArray) -> list[tuple[float, BoolArray]]:
    """(height, crossings) of levels among `clear` ones, largest first; split-level parts are joined to theirs."""
    columns, left = survey.columns, clear.copy()
    levels: list[tuple[float, BoolArray]] = []
    smallest = _MIN_AREA_M2 / survey.cell_m2
    while left.sum() >= smallest:
        main_m = _main_height_m(columns.z_m[left])
        part = left & (np.abs(columns.z_m - main_m) <= _SAME_HEIGHT_M)
        left &= ~part
        if levels:
            smallest = max(smallest, _MIN_AREA_SHARE * levels[0][1].sum())
        if part.sum() < smallest:
            break
        near = [i for i, (height, _) in enumerate(levels) if abs(height - main_m) < MIN_LEVEL_DISTANCE_M]
        if not near:
            levels.append((main_m, part))
        elif not _stands_on(columns, part, levels[near[0]][1]):
            levels[near[0]] = (levels[near[0]][0], levels[near[0]][1] | part)
    return levels


def _stands_on(columns: Columns, part: BoolArray, ground: BoolArray) -> bool:
    """Tell whether most of `part` has the ground's triangles in the same columns: furniture, not a split level."""
    same = np.isin(columns.triangle, np.unique(columns.triangle[ground]))
    has = np.zeros(columns.x_m.size * columns.y_m.size, dtype=bool)
    has[columns.column[same]] = True
    return bool(has[columns.column[part]].mean() > 0.5)


# --------------------------------------------------------------------------------------------- shared
def _once_a_surface(columns: Columns, samples: BoolArray) -> FloatArray:
    """Heights of `samples`, of both sides of a thin plate (coverings) only the upper one."""
    column, z_m = columns.column[samples], columns.z_m[samples]
    lower_side = (column[1:] == column[:-1]) & (z_m[1:] - z_m[:-1] <= _THIN_M)
    shown: FloatArray = z_m[np.append(~lower_side, True)]
    return shown


def _main_height_m(z_m: FloatArray, *, lowest_share: float = 1.0) -> float:
    """Height around which most of the crossings lie; the lowest one that has this share of the most."""
    bin_m = _SAME_HEIGHT_M / 3
    index = np.floor((z_m - z_m.min()) / bin_m).astype(np.int64)
    # Only bins that hold something, and those around them: heights may lie anywhere.
    filled, count = np.unique(index, return_counts=True)
    before = np.concatenate([[0], np.cumsum(count)])
    middle = np.unique(filled[:, None] + np.arange(-2, 3))
    middle = middle[(middle >= 0) & (middle <= filled[-1])]
    first, end = np.searchsorted(filled, middle - 2), np.searchsorted(filled, middle + 2, side="right")
    window = before[end] - before[first]
    start = int(np.argmax(window >= lowest_share * window.max()))
    stop = int(np.searchsorted(middle, middle[start] + 4, side="right"))  # the best of the same surface
    best = middle[start + int(np.argmax(window[start:stop]))]
    return float(np.median(z_m[np.abs(index - best) <= 2]))


def _mostly(survey: _Survey, samples: BoolArray, eligible: BoolArray) -> Int32Array:
    """Level, eligible triangles with a twentieth of their crossings in `samples`, and small ones in their plane.

    A twentieth, since most of a floor may be under furniture; triangles too small for a plumb line of their own go
    with a crossing of the nearest line at the same height.
    """
    columns, n_triangles = survey.columns, survey.scene.n_triangles
    n_all = np.bincount(columns.triangle, minlength=n_triangles)
    n_in = np.bincount(columns.triangle[samples], minlength=n_triangles)
    chosen = survey.level & eligible & (n_in > 0) & (n_in >= 0.05 * n_all)
    small = np.flatnonzero(survey.level & eligible & (n_all == 0) & ~survey.stray)
    if small.size:
        centre = survey.corners_m[small].mean(axis=1)
        grid = np.array([columns.x_m[0], columns.y_m[0]])
        index = np.rint((centre[:, :2] - grid) / survey.step_m).astype(np.int64)
        index = np.clip(index, 0, [columns.x_m.size - 1, columns.y_m.size - 1])
        # Compared in steps of 5 cm and the two beside them.
        wanted = (index[:, 1] * columns.x_m.size + index[:, 0], np.floor(centre[:, 2] / 0.05))
        have = _keys(columns.column[samples], np.floor(columns.z_m[samples] / 0.05))
        chosen[small] = np.logical_or.reduce([np.isin(_keys(wanted[0], wanted[1] + d), have) for d in (-1, 0, 1)])
    return np.flatnonzero(chosen).astype(np.int32)


def _keys(column: Int64Array, height: FloatArray) -> Int64Array:
    return column * (1 << 22) + height.astype(np.int64)


def _ground(
    survey: _Survey, name: str, origin: str, triangles: Int32Array, shown: BoolArray, clear: BoolArray
) -> _Ground:
    """Ground of `triangles`. `shown`: crossings that no other ground covers; `clear`: those with space above."""
    columns = survey.columns
    n_all = np.bincount(columns.triangle, minlength=survey.scene.n_triangles)[triangles]
    n_shown = np.bincount(columns.triangle[shown], minlength=survey.scene.n_triangles)[triangles]
    share = np.where(n_all > 0, n_shown / np.maximum(n_all, 1), 1.0)
    overlap = np.unique(columns.column[shown]).size / max(int(shown.sum()), 1)
    return _Ground(
        name=name,
        origin=origin,
        elevation_m=float(np.median(columns.z_m[clear])),
        triangles=triangles,
        area_m2=float((survey.area_m2[triangles] * share).sum() * overlap),
        bounds_m=survey.bounds_of(triangles),
    )


def _floor(index: int, ground: _Ground) -> Floor:
    return Floor(
        id=f"F{index}",
        name=ground.name,
        elevation_m=ground.elevation_m,
        ground_area_m2=ground.area_m2,
        ground_triangles=ground.triangles,
        bounds_m=ground.bounds_m,
        origin=ground.origin,
    )


def floor_of_triangles(scene: Scene, floors: tuple[Floor, ...]) -> Int32Array:
    """(T,) int32 into floors, lowest first, -1 for none: see `FloorReport`."""
    if not floors:
        return np.full(scene.n_triangles, -1, dtype=np.int32)
    height_m = scene.vertices_m[:, 2][scene.triangles].mean(axis=1)
    starts = np.array([floor.elevation_m for floor in floors]) - 0.05
    out: Int32Array = (np.searchsorted(starts, height_m, side="right") - 1).astype(np.int32)
    for index, floor in enumerate(floors):
        out[floor.ground_triangles] = index
    return out

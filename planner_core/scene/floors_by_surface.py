"""Floors of a scene that names no storeys: heights with much level, head-high area.

Local frame, metres, on the grid of plumb lines.

Rooms may have no ceiling in the model, as where a scan did not reach it. They are open ground beside a level:

    ceiling ________                          |       |      walls, cut 1.5 m above each piece's ground
            |      |    no ceiling    |       |       |
            |      |__________________|       |_______|____  garden: walls along a part of its outline alone
    ========|======| 0.17 m higher            terrace

A courtyard has walls and no ceiling, too: whether it is indoors is the scope's to decide, which has a line about it
(docs/method/scope.md).
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.model.arrays import bounds_of
from planner_core.scene.array_rows import chunks
from planner_core.scene.between_walls import MARGIN, between_walls, cut_around_lines, lines_of
from planner_core.scene.columns import SAME_SURFACE_M, Columns
from planner_core.scene.ground_planes import plane_pieces
from planner_core.scene.inside import ROOM_WIDTH_M
from planner_core.scene.level_surfaces import (
    MAX_SLOPE_RAD,
    MIN_AREA_M2,
    MIN_LEVEL_DISTANCE_M,
    SAME_HEIGHT_M,
    WALL_CUT_M,
    Ground,
    LevelSurvey,
    ground_of,
    main_height_m,
    mostly,
)

#: A surface of a scene without storeys is a level's ground if it has this share of the largest one. Desks in an office
#: take about a tenth of the floor.
_MIN_AREA_SHARE = 0.15
#: A surface that rises by more is no level one: thresholds, falls to drains and uneven scans are less.
_SLOPES_OVER_M = 0.6
#: Of a surface, this share at most lies over itself.
_OVER_ITSELF = 0.05
#: Ground is missing where more of the roofed area between the walls has nothing to stand on: halls are drawn as walls
#: and roof, with the slab in another model. Less is a pit, a shaft or a room that lacks its floor.
_BARE = 0.5
#: Without a roof, as in maps of robots and drawings whose walls were raised, ground is missing where the walls enclose
#: more without any: courtyards take less of a house, and so do undersides of walls.
_BARE_UNROOFED = 2 / 3
#: Surfaces within this of the foot of the walls are its ground, however uneven: earth, ramps, docks.
_NEAR_FOOT_M = 1.0
#: The foot of the walls is the lowest height from which this share of the most walls rises: as for slabs of storeys.
_LOWEST_SHARE = 0.4
#: A floor is as wide as a room over this share of it: corridors and galleries are, walls are not.
_WIDE_SHARE = 0.5
#: Places in a line about ground that may be a room's.
_MOST_PLACES = 3
#: Less roofed area than this is no hall or house.
_LEAST_ROOFED_M2 = 4.0
#: Walls stand along an outline that is within this of them.
_ALONG_M = 0.3
#: A piece is a room where walls, or what is higher than it, stand along so much of its outline: doors and a
#: window without glass take less than a fifth. Along two sides of four, as in a house's corner, it lies outdoors.
_CLOSED, _OUTDOORS = 0.8, 0.6
#: Furniture, and the ground around a pit, close a piece as walls do; parapets, which do not, are narrower than this.
_STEP_UP_M = 0.5
#: Furniture in a scan has no floor below it. No bed and no table has so much area, or so much of a storey.
_FURNITURE_M2, _FURNITURE_SHARE = 4.0, 0.15
#: A floor below furniture is this far below its top at least; the underside of a slab is nearer.
_UNDER_TABLE_M = 0.3


def grounds_of_surfaces(survey: LevelSurvey, warnings: list[str]) -> list[Ground]:
    """Levels of a scene that names no storeys: heights with much level, head-high area, largest first."""
    columns = survey.columns
    clear = survey.level[columns.triangle] & (survey.clear_m >= MIN_LEVEL_DISTANCE_M)
    plane = _plane_at_foot(survey, clear)
    if plane is not None:
        return _with_plane(survey, *plane, clear, warnings)
    levels = _levels(survey, clear & np.isfinite(survey.clear_m))
    # Storeys without a roof in the model: open ground between walls, further than a storey from what was found.
    for main_m, samples in _levels(survey, clear & ~np.isfinite(survey.clear_m)):
        apart = all(abs(main_m - other) >= MIN_LEVEL_DISTANCE_M for other, _ in levels)
        if apart and _walled(survey, main_m, samples):
            levels.append((main_m, samples))
    levels = _with_roofless_rooms(survey, levels, clear & ~np.isfinite(survey.clear_m), warnings)
    levels = _without_walls(survey, levels, warnings)
    if not levels:
        levels = _without_walls(survey, _levels(survey, clear)[:1], warnings)
        if levels:
            warnings.append("nothing is covered and no walls stand on the ground; the largest level surface is planned")
    return _grounds(survey, levels, clear, first=1)


def _roofless_rooms(
    survey: LevelSurvey, surface: Int64Array, main_m: float, ground: BoolArray
) -> tuple[BoolArray, list[str]]:
    """Find the open ground that is of a level's storey.

    Parameters
    ----------
    surface
        (N,) int64 number of the walkable surface that each crossing of open, level ground is on; -1: none that counts.
    main_m
        Height of the level.
    ground
        (N,) bool, the level's crossings.

    Returns
    -------
    (N,) bool crossings that belong to the level, and where ground is that may: `12 m2 about (3.0, 4.5), 0.30 m above`.
    """
    columns, cell_m2 = survey.columns, survey.cell_m2
    near = (surface >= 0) & (np.abs(columns.z_m - main_m) < MIN_LEVEL_DISTANCE_M)
    number, count = np.unique(surface[near], return_counts=True)
    order = np.argsort(-count, kind="stable")
    large_m2 = max(_FURNITURE_M2, _FURNITURE_SHARE * float(ground.sum()) * cell_m2)
    walls_at: dict[int, BoolArray] = {}
    found, unsure, heights_m = np.zeros_like(near), list[str](), [main_m]
    for each in number[order[count[order] * cell_m2 >= MIN_AREA_M2]].tolist():
        whole = near & (surface == each)
        height_m = float(np.median(columns.z_m[whole]))
        if _is_table_over(survey, whole, heights_m):
            continue
        step = round(height_m / SAME_HEIGHT_M)
        if step not in walls_at:
            _, segments = survey.cut_of(~survey.level & ~survey.stray, step * SAME_HEIGHT_M + WALL_CUT_M)
            walls_at[step] = cut_around_lines(survey, segments)
        walls = walls_at[step]
        # A room and the garden that its open door leads to are one surface.
        inside = lines_of(between_walls(walls, survey.step_m)).ravel()[columns.column]
        for part, enclosed in ((whole & inside, True), (whole & ~inside, False)):
            area_m2 = float(part.sum()) * cell_m2
            if area_m2 < MIN_AREA_M2 or not _is_wide(survey, part):
                continue
            closed = _closed_share(survey, part, walls, height_m)
            if closed >= _CLOSED or (enclosed and area_m2 >= large_m2):
                found |= part
                heights_m.append(height_m)
            elif area_m2 >= _FURNITURE_M2 and (enclosed or closed >= _OUTDOORS):
                unsure.append(_place(survey, part, height_m - main_m))
    return found, unsure


def _with_roofless_rooms(
    survey: LevelSurvey, levels: list[tuple[float, BoolArray]], is_open: BoolArray, warnings: list[str]
) -> list[tuple[float, BoolArray]]:
    """Add to each of the levels the rooms without a ceiling beside it; `warnings` takes a line for what may be one."""
    z_m, more = survey.columns.z_m, []
    for main_m, samples in levels:
        is_open &= ~samples & (np.abs(z_m - main_m) > SAME_HEIGHT_M)
    for number, (main_m, samples) in enumerate(sorted(levels, key=lambda level: level[0]), start=1):
        rooms, unsure = _roofless_rooms(survey, _surfaces(survey, is_open), main_m, samples)
        is_open = is_open & ~rooms
        more.append((main_m, samples | rooms))
        if unsure:
            warnings.append(
                f"ground in the open is left out beside 'Level {number}', with walls along a part of its outline: "
                f"{'; '.join(unsure[:_MOST_PLACES])}{' ...' if len(unsure) > _MOST_PLACES else ''}; if these are rooms "
                "whose ceiling is not in the model, mark them as ground (docs/howto/pick-ground.md)"
            )
    return more


def _without_walls(
    survey: LevelSurvey, levels: list[tuple[float, BoolArray]], warnings: list[str]
) -> list[tuple[float, BoolArray]]:
    """Leave out levels that are undersides or tops of walls: hardly any of them is as wide as a room.

    A file with storeys, none of which is a floor, is judged as one trade of a building, see `find_floors`.
    """
    if survey.scene.storeys:
        return levels
    columns, kept = survey.columns, []
    width = max(1, round(ROOM_WIDTH_M / survey.step_m))
    for main_m, samples in levels:
        # What furniture stands on is as wide as the floor.
        flat = survey.level[columns.triangle] & (np.abs(columns.z_m - main_m) <= SAME_HEIGHT_M)
        plan = np.zeros((columns.y_m.size, columns.x_m.size), dtype=np.bool_)
        plan.ravel()[columns.column[samples | flat]] = True
        wide = ndimage.binary_opening(plan, np.ones((width, width)))
        if wide.sum() >= _WIDE_SHARE * plan.sum():
            kept.append((main_m, samples))
        else:
            z_m, area_m2 = main_m + float(survey.scene.offset_m[2]), float(plan.sum()) * survey.cell_m2
            warnings.append(
                f"{area_m2:.0f} m2 of level surface at {z_m:.3f} m are no floor: most of them are narrower than "
                f"{ROOM_WIDTH_M:g} m, as undersides and tops of walls are; load the file with the slabs"
            )
    return kept


def _walled(survey: LevelSurvey, main_m: float, samples: BoolArray) -> bool:
    """Tell whether walls stand on most of a level, crossings (N,); where it slopes, at the height of each part."""
    columns = survey.columns
    low_m, high_m = np.quantile(columns.z_m[samples], [0.02, 0.98])
    if high_m - low_m <= _SLOPES_OVER_M:
        return survey.walls_around(survey.bounds_of(np.unique(columns.triangle[samples])), main_m)
    n_parts = int(np.ceil((high_m - low_m) / _SLOPES_OVER_M))
    height_m = low_m + (np.arange(n_parts) + 0.5) * (high_m - low_m) / n_parts
    part = np.abs(columns.z_m[samples][:, None] - height_m).argmin(axis=1)
    column, n_x = columns.column[samples], columns.x_m.size
    plan_m = np.column_stack([columns.x_m[column % n_x], columns.y_m[column // n_x]])
    walled = np.zeros(n_parts, dtype=np.bool_)
    for number in np.unique(part).tolist():
        here_m = plan_m[part == number]
        walled[number] = survey.walls_around(np.stack([here_m.min(axis=0), here_m.max(axis=0)]), height_m[number])
    return bool(walled[part].mean() > 0.5)


def _grounds(
    survey: LevelSurvey, levels: list[tuple[float, BoolArray]], clear: BoolArray, *, first: int
) -> list[Ground]:
    """Grounds of levels, the lowest of which has the number `first`."""
    columns, grounds = survey.columns, []
    for number, (main_m, samples) in enumerate(sorted(levels, key=lambda level: level[0]), start=first):
        near = clear & (np.abs(columns.z_m - main_m) <= SAME_HEIGHT_M)
        triangles = mostly(survey, samples | near, survey.level)
        shown = np.isin(columns.triangle, triangles)  # what is under furniture and walls is ground as well
        used = (samples | near) & shown
        grounds.append(ground_of(survey, f"Level {number}", "surface", triangles, shown, used))
    return grounds


def _with_plane(survey: LevelSurvey, plane: Ground, what: str, clear: BoolArray, warnings: list[str]) -> list[Ground]:
    """The plane, and the levels a storey above it that are no ledges; `what` the plane stands in for."""
    covered = clear & np.isfinite(survey.clear_m)
    covered &= survey.columns.z_m > plane.elevation_m + MIN_LEVEL_DISTANCE_M
    least = max(MIN_AREA_M2, _MIN_AREA_SHARE * plane.area_m2) / survey.cell_m2
    above = [(main_m, samples) for main_m, samples in _levels(survey, covered) if samples.sum() >= least]
    elevation_m = plane.elevation_m + float(survey.scene.offset_m[2])
    warnings.append(
        f"{plane.name!r}: {what}; the foot of the walls, {elevation_m:.3f} m, is "
        "taken as the ground: the floor slab may be in another file"
    )
    return [plane, *_grounds(survey, above, clear, first=2)]


def _plane_at_foot(survey: LevelSurvey, clear: BoolArray) -> tuple[Ground, str] | None:
    """The plane at the foot of the walls of a building without ground, and what it stands in for.

    None where some of the crossings `clear` are ground.

    ______________________  roof
    |                    |
    |  plumb lines meet  |  walls
    |  nothing down here |____
    |....................|____|  dock
    """
    foot_m = _foot_of_walls_m(survey)
    if foot_m is None:
        return None
    columns = survey.columns
    _, segments = survey.cut_of(~survey.level & ~survey.stray, foot_m + WALL_CUT_M)
    if not len(segments):
        return None
    plan = segments.reshape(-1, 2)
    bounds = np.stack([plan.min(axis=0), plan.max(axis=0)])
    if not survey.walls_around(bounds, foot_m):
        return None
    n_x = columns.x_m.size
    x, y = columns.x_m[columns.column % n_x], columns.y_m[columns.column // n_x]
    inside = (x > bounds[0, 0]) & (x < bounds[1, 0]) & (y > bounds[0, 1]) & (y < bounds[1, 1])
    roofed = np.unique(columns.column[inside & (columns.z_m > foot_m + WALL_CUT_M)])
    lower = columns.column[inside & (columns.z_m <= foot_m + _NEAR_FOOT_M)]
    # A storey half a flight above the lowest foot has its own ground.
    split = columns.column[clear & (columns.z_m > foot_m) & (columns.z_m < foot_m + MIN_LEVEL_DISTANCE_M)]
    covers = [("most of what is under the roof has no ground", _BARE, roofed)]
    if not survey.scene.storeys:
        enclosed = np.flatnonzero(lines_of(between_walls(cut_around_lines(survey, segments), survey.step_m)))
        covers.append(("the walls have neither ground nor roof", _BARE_UNROOFED, enclosed))
    for what, share, cover in covers:
        bare = np.setdiff1d(cover, lower)
        area_m2 = np.setdiff1d(bare, split).size * survey.cell_m2
        if area_m2 >= max(_LEAST_ROOFED_M2, share * cover.size * survey.cell_m2):
            pieces = plane_pieces(survey, bounds, foot_m, bare)
            area_m2 = float(np.prod(pieces[:, 1] - pieces[:, 0], axis=1).sum())
            none = np.empty(0, dtype=np.int32)
            return Ground("Level 1", "wall-foot", foot_m, none, area_m2, bounds, pieces), what
    return None


def _foot_of_walls_m(survey: LevelSurvey) -> float | None:
    """Height at which most walls stand, the lowest of several; None without walls.

    Walls are upright faces that reach past `WALL_CUT_M`; each counts by its length in plan.
    """
    found, weight = [np.empty(0)], [np.empty(0)]
    steep = np.flatnonzero(~survey.level & ~survey.stray).astype(np.int32)
    for some in chunks(steep.size):
        corners_m = survey.corners_of(steep[some])
        lowest_m, highest_m = bounds_of(corners_m)
        low_m, high_m = lowest_m[:, 2], highest_m[:, 2]
        length_m = np.linalg.norm((highest_m - lowest_m)[:, :2], axis=1)
        tall = high_m - low_m >= WALL_CUT_M
        found.append(low_m[tall])
        weight.append(length_m[tall])
    foot_m, length_m = np.concatenate(found), np.concatenate(weight)
    if not foot_m.size:
        return None
    step = np.floor(foot_m / SAME_HEIGHT_M).astype(np.int64)
    number, of = np.unique(step, return_inverse=True)
    total_m = np.bincount(of, weights=length_m)
    lowest = int(np.argmax(total_m >= _LOWEST_SHARE * total_m.max()))
    return float(foot_m[step == number[lowest]].min())


def _levels(survey: LevelSurvey, clear: BoolArray) -> list[tuple[float, BoolArray]]:
    """(height, crossings) of levels among `clear` ones, largest first; split-level parts are joined to theirs.

    A surface that slopes over more than a level's height, and is walked from end to end, is one level.
    """
    columns, left = survey.columns, clear.copy()
    levels = _slopes(survey, clear)
    for _, part in levels:
        left &= ~part
    smallest = MIN_AREA_M2 / survey.cell_m2
    if levels:
        smallest = max(smallest, _MIN_AREA_SHARE * levels[0][1].sum())
    while left.sum() >= smallest:
        main_m = main_height_m(columns.z_m[left])
        part = left & (np.abs(columns.z_m - main_m) <= SAME_HEIGHT_M)
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


def _slopes(survey: LevelSurvey, clear: BoolArray) -> list[tuple[float, BoolArray]]:
    """(height, crossings) of surfaces among `clear` ones that slope from one level to another, largest first.

    Neighbouring plumb lines meet one surface where their heights differ by no more than the steepest ground; a step of
    stairs is higher. Surfaces that lie over themselves, such as the ramps and decks of a car park, are several levels.
    """
    columns = survey.columns
    surface = _surfaces(survey, clear)
    number, count = np.unique(surface[surface >= 0], return_counts=True)
    least = max(MIN_AREA_M2 / survey.cell_m2, _MIN_AREA_SHARE * count.max(initial=0))
    found = []
    for each in number[count >= least].tolist():
        part = surface == each
        low_m, high_m = np.quantile(columns.z_m[part], [0.02, 0.98])
        over = part.sum() / np.unique(columns.column[part]).size - 1.0
        if high_m - low_m > _SLOPES_OVER_M and over < _OVER_ITSELF:
            found.append((main_height_m(columns.z_m[part]), part))
    return sorted(found, key=lambda level: -int(level[1].sum()))


def _surfaces(survey: LevelSurvey, clear: BoolArray) -> Int64Array:
    """(N,) number of the surface that each of the `clear` crossings is on; -1 for the others."""
    columns, step_m = survey.columns, survey.step_m
    rows = np.flatnonzero(clear)
    column, z_m = columns.column[rows], columns.z_m[rows]
    rise_m = step_m * float(np.tan(MAX_SLOPE_RAD)) + SAME_SURFACE_M
    # One sortable number a crossing, as in `Columns.clear_height_m`.
    low_m = float(z_m.min(initial=0.0))
    stride_m = float(z_m.max(initial=0.0)) - low_m + 2.0 * rise_m + 1.0
    key = column * stride_m + (z_m - low_m)
    n_x = columns.x_m.size
    ends = []
    for beside, inside in ((1, column % n_x < n_x - 1), (n_x, np.ones(rows.size, dtype=bool))):
        wanted = key + beside * stride_m
        at = np.searchsorted(key, wanted - rise_m)
        joined = inside & (at < rows.size)
        joined[joined] = key[at[joined]] <= wanted[joined] + rise_m
        ends.append(np.stack([np.flatnonzero(joined), at[joined]]))
    pairs = np.concatenate(ends, axis=1)
    graph = csr_array((np.ones(pairs.shape[1]), (pairs[0], pairs[1])), shape=(rows.size,) * 2)
    out = np.full(clear.size, -1, dtype=np.int64)
    out[rows] = connected_components(graph, directed=False)[1]
    return out


def _stands_on(columns: Columns, part: BoolArray, ground: BoolArray) -> bool:
    """Tell whether most of `part` has the ground's triangles in the same columns: furniture, not a split level."""
    same = np.isin(columns.triangle, np.unique(columns.triangle[ground]))
    has = np.zeros(columns.x_m.size * columns.y_m.size, dtype=bool)
    has[columns.column[same]] = True
    return bool(has[columns.column[part]].mean() > 0.5)


def _plan(survey: LevelSurvey, crossings: BoolArray) -> BoolArray:
    """(ny, nx) bool: plumb lines with one of these crossings."""
    columns = survey.columns
    seen = np.zeros((columns.y_m.size, columns.x_m.size), dtype=np.bool_)
    seen.ravel()[columns.column[crossings]] = True
    return seen


def _is_table_over(survey: LevelSurvey, part: BoolArray, heights_m: list[float]) -> bool:
    """Tell whether ground at one of some heights goes on below most of `part`: a table, not a split level."""
    columns = survey.columns
    floor = survey.level[columns.triangle] & (survey.clear_m >= _UNDER_TABLE_M)
    lowest_m = float(columns.z_m[part].min())
    floor &= np.any([np.abs(columns.z_m - height_m) <= SAME_HEIGHT_M for height_m in heights_m], axis=0)
    below = _plan(survey, floor & (columns.z_m < lowest_m))
    return bool(below.ravel()[columns.column[part]].mean() > 0.5)


def _is_wide(survey: LevelSurvey, part: BoolArray) -> bool:
    """Tell whether `part` is as wide as a room somewhere: tops of walls, worktops and shelves are not."""
    width = max(1, round(ROOM_WIDTH_M / survey.step_m))
    return bool(ndimage.binary_opening(_plan(survey, part), np.ones((width, width))).any())


def _closed_share(survey: LevelSurvey, part: BoolArray, walls: BoolArray, height_m: float) -> float:
    """Share of the outline of `part` along which `walls`, with the margin, or anything higher than it, stand."""
    plan = ndimage.binary_fill_holes(np.pad(_plan(survey, part), MARGIN))  # what stands around it, not in it
    outline = ndimage.binary_dilation(plan) & ~plan
    reach = max(1, round(_ALONG_M / survey.step_m))
    width = max(1, round(_STEP_UP_M / survey.step_m))
    higher = _plan(survey, survey.columns.z_m > height_m + SAME_HEIGHT_M)
    higher = ndimage.binary_opening(higher, np.ones((width, width)))
    closed = ndimage.binary_dilation(walls, iterations=reach) | np.pad(higher, MARGIN, mode="edge")
    return float(closed[outline].mean()) if outline.any() else 1.0


def _place(survey: LevelSurvey, part: BoolArray, above_m: float) -> str:
    """Area, place in scene coordinates, and height above the level, in words."""
    columns = survey.columns
    cell = np.unique(columns.column[part])
    plan_m = np.column_stack([columns.x_m[cell % columns.x_m.size], columns.y_m[cell // columns.x_m.size]])
    middle_m: FloatArray = plan_m[((plan_m - plan_m.mean(axis=0)) ** 2).sum(axis=1).argmin()]
    x, y = middle_m + survey.scene.offset_m[:2]
    side = "above" if above_m >= 0 else "below"
    return f"{cell.size * survey.cell_m2:.0f} m2 about ({x:.1f}, {y:.1f}), {abs(above_m):.2f} m {side} it"

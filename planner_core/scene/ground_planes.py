"""Surfaces for ground that the file has no slab for: the plane at a storey's elevation, as triangles of the scene.

Local frame, metres. Where a building's slabs are in another file, people still stand on them: the plane ends beams as
a slab does, so that a storey is neither seen nor scanned from the next one, and it is the floor of maps. It lies where
the storey is covered, without what is outdoors beside an L-shaped house or in a courtyard, and is open above stairs.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import ndimage

from planner_core.model import BoolArray, Element, FloatArray, Floor, Int32Array, Int64Array, Scene, Storey, UInt8Array
from planner_core.scene.array_rows import first_of_equal_rows
from planner_core.scene.between_walls import closed_walls, cut_cells
from planner_core.scene.inside import ROOM_WIDTH_M
from planner_core.scene.level_surfaces import (
    MIN_AREA_M2,
    MIN_CLEAR_M,
    MIN_LEVEL_DISTANCE_M,
    WALL_CUT_M,
    Ground,
    LevelSurvey,
)

#: IFC classes that people climb from one storey to the next on; moving stairs are transport elements.
STAIR_KINDS = frozenset({"IfcStair", "IfcStairFlight", "IfcRamp", "IfcRampFlight", "IfcTransportElement"})
#: IFC classes of doors, and of all that stands on a floor.
_DOOR_KINDS = frozenset({"IfcDoor", "IfcDoorStandardCase"})
USED_KINDS = _DOOR_KINDS | {"IfcFurnishingElement", "IfcFurniture", "IfcSanitaryTerminal"}
#: IFC classes of what lies around and under a building.
SITE_KINDS = frozenset({"IfcSite", "IfcGeographicElement", "IfcCivilElement"})
#: A covering is a floor's finish this far above its slab or its storey's elevation at most: a raised floor's height.
RAISED_M = 0.6
#: Rooms without a slab are this large, among others that have one: bare spots that are smaller are shafts and niches.
_LEAST_ROOM_M2 = 4.0
#: A room has no ground where slabs beside it reach into less of it. Holes in slabs, docks and ledges leave more.
_JOINT_SHARE = 0.1
#: A door leads to what begins this near beside its leaf: a thick wall's depth.
_BESIDE_DOOR_M = 0.5
#: Doorways are searched for at this height, below window sills, with this much room on both sides of a person's middle.
_KNEE_M, _HALF_PERSON_M = 0.5, 0.3
#: Slabs are open wherever a person on a flight below has less than this over the head: headroom of building codes.
_STAIR_HEADROOM_M = 2.1
#: What has nothing overhead is outdoors if it is wider than a person; joints between ceiling panels are narrower.
_COURTYARD_M = 0.5
#: The two sides of a sheet, well apart for float32 coordinates of a kilometre, and thinner than any slab.
_SHEET_M = 0.002
#: A tread or landing nearer to the plane than this is level with it.
_LEVEL_M = 0.05


def plane_pieces(survey: LevelSurvey, bounds_m: FloatArray, elevation_m: float, covered: Int64Array) -> FloatArray:
    """(R, 2, 2) rectangles in plan, `[[x_min, y_min], [x_max, y_max]]`, that a storey's ground is made of.

    Parameters
    ----------
    bounds_m : (2, 2) of the storey's walls.
    covered : plumb lines with something overhead, as `Columns.column`; none: the whole of the bounds.
    """
    columns = survey.columns
    shape = (columns.y_m.size, columns.x_m.size)
    x_in = (columns.x_m >= bounds_m[0, 0]) & (columns.x_m <= bounds_m[1, 0])
    y_in = (columns.y_m >= bounds_m[0, 1]) & (columns.y_m <= bounds_m[1, 1])
    cells = np.zeros(shape, dtype=bool)
    cells.ravel()[covered] = True
    if not covered.size:
        cells[:] = True
    cells = cells[np.ix_(y_in, x_in)]
    width = max(1, round(_COURTYARD_M / survey.step_m))
    cells = ~ndimage.binary_opening(~cells, np.ones((width, width)))
    cells &= ~_over_stairs(survey, elevation_m).reshape(shape)[np.ix_(y_in, x_in)]
    cells = _without_small(cells, MIN_AREA_M2 / survey.cell_m2)  # gaps between treads are no ground
    x_m, y_m = (
        np.concatenate([[low], 0.5 * (lines[1:] + lines[:-1]), [high]])
        for lines, low, high in zip((columns.x_m[x_in], columns.y_m[y_in]), *bounds_m, strict=True)
    )
    corner = np.array(rectangles(cells), dtype=np.int64).reshape(-1, 2, 2)
    return np.stack([x_m[corner[:, :, 0]], y_m[corner[:, :, 1]]], axis=2)


def with_missing_slabs(
    survey: LevelSurvey, index: int, ground: Ground, slabs: BoolArray, warnings: list[str]
) -> Ground:
    """The ground of a storey, with the plane at its height in rooms whose slab the file lacks: others have theirs.

    Such a room has nothing of the ground between its walls, nothing else at that height, and no slab less than a storey
    above or below; and people use it: a doorway or a door leads to it, or it has furniture or an IfcSpace. With
    something further below it may be the upper part of a hall, or a shaft whose doors open on a lift: there furniture
    alone makes it a room. Terrain is no floor. What nothing leads to may be earth between foundations: it only gets a
    warning.

    Parameters
    ----------
    index : of the storey. slabs : (N,) bool, the plumb lines' crossings with slabs and coverings to stand on.
    """
    step_m, elevation_m = survey.step_m, ground.elevation_m
    label, is_room, is_shut = _rooms_without_slab(survey, index, ground, slabs)
    if is_shut.any():
        shut_m2 = np.count_nonzero(is_shut[label]) * survey.cell_m2
        warnings.append(
            f"storey {ground.name!r}: {shut_m2:.0f} m2 between its walls have no floor slab and no door, and are not "
            "planned; if people walk there, load the file that has the slabs"
        )
    missing = is_room[label]
    if not missing.any():
        return ground
    low_m = np.array([survey.columns.x_m[0], survey.columns.y_m[0]]) - 0.5 * step_m
    cell = np.argwhere(missing)[:, ::-1]
    bounds_m = low_m + step_m * np.stack([cell.min(axis=0), cell.max(axis=0) + 1])
    pieces = plane_pieces(survey, bounds_m, elevation_m, np.flatnonzero(missing))
    if not pieces.size:  # above stairs
        return ground
    area_m2 = float(np.prod(pieces[:, 1] - pieces[:, 0], axis=1).sum())
    warnings.append(
        f"storey {ground.name!r}: {area_m2:.0f} m2 between its walls have no floor slab; the height of its other "
        f"slabs, {elevation_m + float(survey.scene.offset_m[2]):.3f} m, is taken as the ground there: the slabs may be "
        "in another discipline's file"
    )
    corners_m = np.concatenate([pieces.reshape(-1, 2), ground.bounds_m])
    bounds_m = np.stack([corners_m.min(axis=0), corners_m.max(axis=0)])
    return replace(ground, area_m2=ground.area_m2 + area_m2, bounds_m=bounds_m, plane_m=pieces)


def with_ground_planes(scene: Scene, floors: tuple[Floor, ...]) -> tuple[Scene, tuple[Floor, ...]]:
    """Add the planes of `floors` to the scene as slabs, behind all that it has; they join their floors' ground."""
    corners, owners, elements, grounds = [np.empty((0, 3, 3))], [np.empty(0, np.int32)], list(scene.elements), []
    n_triangles = scene.n_triangles
    for floor in floors:
        if not floor.plane_m.size:
            grounds.append(floor)
            continue
        (x0, y0), (x1, y1) = floor.plane_m[:, 0].T, floor.plane_m[:, 1].T
        z = np.full(x0.size, floor.elevation_m)
        ring = np.stack([np.stack(xyz, axis=1) for xyz in ((x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z))], axis=1)
        triangles = ring[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3)
        corners.append(triangles)
        owners.append(np.full(len(triangles), len(elements), dtype=np.int32))
        storey = _storey_of(floor, scene.storeys)
        elements.append(Element(f"{floor.name}: ground at its elevation", "IfcSlab", "", storey, None, "FLOOR"))
        plane = np.arange(n_triangles, n_triangles + len(triangles), dtype=np.int32)
        grounds.append(replace(floor, ground_triangles=np.concatenate([floor.ground_triangles, plane])))
        n_triangles += len(triangles)
    named = replace(scene, elements=tuple(elements))
    return with_more_triangles(named, np.concatenate(corners), np.concatenate(owners)), tuple(grounds)


def with_ceilings(scene: Scene, floors: tuple[Floor, ...], open_below: BoolArray) -> tuple[Scene, Int32Array]:
    """Add the undersides of grounds that are single sheets, and return the floors that they are ceilings of: (K,).

    The room below sees such a slab's other side, as its ceiling, and that is surface to be scanned of its own. It lies
    `_SHEET_M` below the sheet and belongs to the same element.

    Parameters
    ----------
    open_below : (T,) bool of the first triangles of the scene, see `FloorReport`; of those behind, which are planes of
        storeys, all that lie above another floor are.
    """
    above = np.zeros(scene.n_triangles, dtype=bool)
    above[: open_below.size] = open_below
    lowest_m = min((floor.elevation_m for floor in floors), default=0.0)
    planes = np.arange(open_below.size, scene.n_triangles)
    above[planes] = scene.vertices_m[scene.triangles[planes, 0], 2] > lowest_m
    grounds = [floor.ground_triangles for floor in floors]
    sheets = np.unique(np.concatenate([np.empty(0, np.int32), *grounds]))
    sheets = sheets[above[sheets]]
    under = scene.vertices_m[scene.triangles[sheets]][:, ::-1] - np.array([0.0, 0.0, _SHEET_M])
    optics = None if scene.optics_of_triangle is None else scene.optics_of_triangle[sheets]
    starts = np.array([floor.elevation_m for floor in floors])
    floor_below = np.searchsorted(starts, under[:, :, 2].mean(axis=1) - _LEVEL_M, side="right") - 1
    more = with_more_triangles(scene, under, scene.element_of_triangle[sheets], optics)
    return more, floor_below.astype(np.int32)


def with_more_triangles(
    scene: Scene, corners_m: FloatArray, element: Int32Array, optics: UInt8Array | None = None
) -> Scene:
    """The scene with triangles (K, 3, 3) of elements (K,) behind its own; optics (K,), None: all return."""
    if not len(corners_m):
        return scene
    points = np.ascontiguousarray(corners_m.reshape(-1, 3))
    used, number = np.unique(first_of_equal_rows(points), return_inverse=True)
    added = (number + len(scene.vertices_m)).reshape(-1, 3).astype(np.int32)
    of_all = scene.optics_of_triangle
    if of_all is not None:
        of_all = np.append(of_all, np.zeros(len(added), dtype=np.uint8) if optics is None else optics)
    return replace(
        scene,
        vertices_m=np.concatenate([scene.vertices_m, points[used]]),
        triangles=np.concatenate([scene.triangles, added]),
        element_of_triangle=np.concatenate([scene.element_of_triangle, element]),
        optics_of_triangle=of_all,
    )


def _rooms_without_slab(
    survey: LevelSurvey, index: int, ground: Ground, slabs: BoolArray
) -> tuple[Int64Array, BoolArray, BoolArray]:
    """(ny, nx) label of bare places; (L,) bool each, by label: rooms that people use; what nothing leads to."""
    columns, elevation_m, step_m = survey.columns, ground.elevation_m, survey.step_m
    shape = (columns.y_m.size, columns.x_m.size)
    site = np.array([e.kind in SITE_KINDS for e in survey.scene.elements], dtype=bool)
    built = ~site[survey.scene.element_of_triangle]
    above_m = np.where(built[columns.triangle], columns.z_m - elevation_m, np.nan)
    walls = ~survey.level & ~survey.stray & built
    (_, walls_m), (_, knees_m) = (survey.cut_of(walls, elevation_m + height_m) for height_m in (WALL_CUT_M, _KNEE_M))
    first_m = np.array([columns.x_m[0], columns.y_m[0]])
    closed = closed_walls(cut_cells(walls_m, first_m, step_m, shape), step_m)
    inside = ndimage.binary_fill_holes(closed)
    on_level = (np.abs(above_m) <= RAISED_M) | (slabs & (np.abs(above_m) < MIN_LEVEL_DISTANCE_M))
    bare = inside & _met(survey, above_m > MIN_CLEAR_M) & ~_met(survey, on_level)
    width = max(1, round(ROOM_WIDTH_M / step_m))
    label, count = ndimage.label(ndimage.binary_opening(bare, np.ones((width, width))))

    away_m = step_m * ndimage.distance_transform_edt(~cut_cells(knees_m, first_m, step_m, shape))
    way = inside & (away_m > _HALF_PERSON_M)
    part, _ = ndimage.label(way)
    on_ground = _met(survey, np.isin(columns.triangle, ground.triangles))
    led_to = np.isin(part, np.setdiff1d(part[on_ground], 0))
    is_room, is_furnished = _used(survey, index, elevation_m, label, first_m - 0.5 * step_m)
    is_room[label[led_to]] = True
    n_cells = np.bincount(label.ravel(), minlength=count + 1)
    n_over = np.bincount(label[_met(survey, above_m < -RAISED_M)], minlength=count + 1)
    is_room &= n_over <= 0.5 * n_cells
    room, _ = ndimage.label(inside & ~closed)
    lacks_ground = np.bincount(room.ravel(), weights=on_ground.ravel()) < _JOINT_SHARE * np.bincount(room.ravel())
    lacks_ground[0] = False
    n_lacking = np.bincount(label[lacks_ground[room]], minlength=count + 1)
    is_whole = (n_cells * survey.cell_m2 >= _LEAST_ROOM_M2) & (n_lacking > 0.5 * n_cells)
    is_whole[0] = False
    used = is_room | is_furnished
    return label, is_whole & used, is_whole & ~used & (n_over == 0)


def _met(survey: LevelSurvey, crossings: BoolArray) -> BoolArray:
    """(ny, nx) bool: plumb lines with one of some crossings (N,)."""
    columns = survey.columns
    met = np.zeros((columns.y_m.size, columns.x_m.size), dtype=np.bool_)
    met.ravel()[columns.column[crossings]] = True
    return met


def _used(
    survey: LevelSurvey, index: int, elevation_m: float, label: Int64Array, low_m: FloatArray
) -> tuple[BoolArray, BoolArray]:
    """(L,) bool each, by label (ny, nx) of cells: a door or a room of the storey is there; furniture stands there."""
    is_room, is_furnished = (np.zeros(int(label.max()) + 1, dtype=np.bool_) for _ in range(2))

    def mark(used: BoolArray, box_m: FloatArray, beside_m: float) -> None:
        (x0, y0), end = np.maximum(np.floor((box_m - low_m + np.array([[-beside_m], [beside_m]])) / survey.step_m), 0)
        used[label[int(y0) : int(end[1]) + 1, int(x0) : int(end[0]) + 1]] = True

    scene = survey.scene
    for number in np.flatnonzero(np.abs(survey.spans_m[0] - elevation_m) <= RAISED_M).tolist():
        if scene.elements[number].kind in USED_KINDS:
            box_m = survey.bounds_of(np.flatnonzero(scene.element_of_triangle == number).astype(np.int32))
            if scene.elements[number].kind in _DOOR_KINDS:
                mark(is_room, box_m, _BESIDE_DOOR_M)
            else:
                mark(is_furnished, box_m, 0.0)
    for room in scene.rooms:
        if room.storey == index and abs(room.box_m[0, 2] - elevation_m) <= RAISED_M:
            mark(is_room, np.stack([room.box_m[:, :2].mean(axis=0)] * 2), 0.0)
    return is_room, is_furnished


def _storey_of(floor: Floor, storeys: tuple[Storey, ...]) -> int:
    """Index of the storey that a floor is of: of those with its name the nearest in height; -1: none."""
    named = [index for index, storey in enumerate(storeys) if storey.name == floor.name]
    return min(named, key=lambda index: abs(storeys[index].elevation_m - floor.elevation_m), default=-1)


def _over_stairs(survey: LevelSurvey, elevation_m: float) -> BoolArray:
    """(C,) bool a plumb line: a person on a flight there would bump into the plane."""
    scene, columns = survey.scene, survey.columns
    kinds = np.array([not STAIR_KINDS.isdisjoint((e.kind, *e.parents)) for e in scene.elements], dtype=bool)
    stairs = kinds[scene.element_of_triangle[columns.triangle]]
    below_m = elevation_m - columns.z_m
    steps = stairs & (below_m > _LEVEL_M) & (below_m < _STAIR_HEADROOM_M)
    steps &= columns.clear_height_m(stairs) >= MIN_CLEAR_M  # not the underside of a flight that begins here
    over = np.zeros(columns.x_m.size * columns.y_m.size, dtype=bool)
    over[columns.column[steps]] = True
    return over


def _without_small(cells: BoolArray, least: float) -> BoolArray:
    """`cells` (ny, nx) without connected pieces of fewer than `least`."""
    label, _ = ndimage.label(cells)
    large = np.bincount(label.ravel()) >= least
    large[0] = False
    kept: BoolArray = large[label]
    return kept


def rectangles(cells: BoolArray) -> list[tuple[int, int, int, int]]:
    """Cover `cells` (ny, nx) by rectangles (x0, y0, x1, y1), ends exclusive: equal runs of rows above one another."""
    found = []
    begun: dict[tuple[int, int], int] = {}
    for y in range(cells.shape[0] + 1):
        row = np.zeros(cells.shape[1] + 2, dtype=np.int8)
        if y < cells.shape[0]:
            row[1:-1] = cells[y]
        ends = np.flatnonzero(np.diff(row)).reshape(-1, 2)
        runs = {(x0, x1): begun.get((x0, x1), y) for x0, x1 in ends.tolist()}
        found += [(x0, y0, x1, y) for (x0, x1), y0 in begun.items() if (x0, x1) not in runs]
        begun = runs
    return found

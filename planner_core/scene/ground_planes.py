"""Surfaces for the ground of storeys without slabs: the plane at a storey's elevation, as triangles of the scene.

Local frame, metres. Where a building's slabs are in another file, people still stand on them: the plane ends beams as
a slab does, so that a storey is neither seen nor scanned from the next one, and it is the floor of maps. It lies where
the storey is covered, without what is outdoors beside an L-shaped house or in a courtyard, and is open above stairs.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import ndimage

from planner_core.model import BoolArray, Element, FloatArray, Floor, Int32Array, Int64Array, Scene, Storey, UInt8Array
from planner_core.scene.equal_rows import first_of_equal_rows
from planner_core.scene.level_surfaces import MIN_AREA_M2, MIN_CLEAR_M, LevelSurvey

#: IFC classes that people climb from one storey to the next on; moving stairs are transport elements.
STAIR_KINDS = frozenset({"IfcStair", "IfcStairFlight", "IfcRamp", "IfcRampFlight", "IfcTransportElement"})
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
    corner = np.array(_rectangles(cells), dtype=np.int64).reshape(-1, 2, 2)
    return np.stack([x_m[corner[:, :, 0]], y_m[corner[:, :, 1]]], axis=2)


def with_ground_planes(scene: Scene, floors: tuple[Floor, ...]) -> tuple[Scene, tuple[Floor, ...]]:
    """Add the planes of `floors` to the scene as slabs, behind all that it has; they become their floors' ground."""
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
        storey = next((i for i, s in enumerate(scene.storeys) if _is_of(floor, s)), -1)
        elements.append(Element(f"{floor.name}: ground at its elevation", "IfcSlab", "", storey, None, "FLOOR"))
        ground = np.arange(n_triangles, n_triangles + len(triangles), dtype=np.int32)
        grounds.append(replace(floor, ground_triangles=ground))
        n_triangles += len(triangles)
    more = _with_triangles(replace(scene, elements=tuple(elements)), np.concatenate(corners), np.concatenate(owners))
    return more, tuple(grounds)


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
    more = _with_triangles(scene, under, scene.element_of_triangle[sheets], optics)
    return more, floor_below.astype(np.int32)


def _with_triangles(
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


def _is_of(floor: Floor, storey: Storey) -> bool:
    return (floor.name, floor.elevation_m) == (storey.name, storey.elevation_m)


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


def _rectangles(cells: BoolArray) -> list[tuple[int, int, int, int]]:
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

"""Ground outdoors: where stations stand that join through exterior doors what no interior door joins.

Local frame, metres. A strip around the lowest floor with exterior doors is ground of that floor, too: terrain, paving
and terraces as the model has them, and level ground at the floor's height where it has none.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import ndimage

from planner_core.errors import RequirementError
from planner_core.model import BoolArray, FloatArray, Floor, PlacedDoor, Scene
from planner_core.model.arrays import area_normals
from planner_core.scene.between_walls import closed_walls, cut_cells
from planner_core.scene.columns import sample_scene
from planner_core.scene.doors import exterior_doors
from planner_core.scene.ground_planes import SITE_KINDS, rectangles, with_more_triangles
from planner_core.scene.level_surfaces import MAX_SLOPE_RAD, WALL_CUT_M, cut_of_scene

#: Width of the strip, and how far from rooms stations may stand in it: walls and a porch lie between. From there two
#: facades are in view round a corner; a plain facade alone lets scans slide along it.
STRIP_M, OUTDOORS_M = 6.0, 7.0
_STEP_M = 0.1
#: On sites of more cells in plan, these grow.
_MAX_CELLS = 4_000_000
#: Doors of a floor end this near to its height. Outdoors ground lies so far below it, or above: some steps.
_FOOT_M, _BELOW_M, _ABOVE_M = 0.6, 1.5, 0.5
#: Between walls there is as much of a floor's ground, or its walls are not closed.
_BETWEEN_SHARE = 0.25
#: Walls of a house enclose as much of its ground.
_LEAST_M2 = 4.0


def with_outdoor_ground(scene: Scene, floors: tuple[Floor, ...]) -> tuple[tuple[Floor, ...], tuple[str, ...]]:
    """Add the strip outdoors to the ground of the lowest floor with exterior doors; and a line where it is assumed.

    Raises
    ------
    RequirementError
        No floor has an exterior door.
    """
    index, doors_m = _entrance_floor(scene, floors)
    floor = floors[index]
    size_m = floor.bounds_m[1] - floor.bounds_m[0] + 2.0 * STRIP_M
    step_m = max(_STEP_M, float(np.sqrt(np.prod(size_m) / _MAX_CELLS)))
    low_m = np.floor((floor.bounds_m[0] - STRIP_M) / step_m - 2.0) * step_m
    nx, ny = (np.ceil((floor.bounds_m[1] + STRIP_M - low_m) / step_m) + 2).astype(int).tolist()
    is_site = np.array([element.kind in SITE_KINDS for element in scene.elements], dtype=bool)
    is_site = is_site[scene.element_of_triangle]
    house = _house(scene, floor, ~is_site, doors_m, low_m, step_m, (ny, nx))
    strip = ~house & (step_m * ndimage.distance_transform_edt(~house) <= STRIP_M)

    level = np.flatnonzero(_is_level(scene)).astype(np.int32)
    columns = sample_scene(scene, level, low_m=low_m, step_m=step_m, shape=(nx, ny))
    away_m, of_site = columns.z_m - floor.elevation_m, is_site[columns.triangle]
    near = (away_m >= -np.where(of_site, _BELOW_M, _ABOVE_M)) & (away_m <= _ABOVE_M)
    near[np.flatnonzero(near)[:-1]] = np.diff(columns.column[near]) > 0  # the highest of each line
    in_strip = strip.ravel()[columns.column]
    has_ground = np.zeros(nx * ny, dtype=bool)
    has_ground[columns.column[near | of_site]] = True
    assumed = ndimage.binary_opening(strip & ~has_ground.reshape(ny, nx), np.ones((3, 3)))
    assumed = ndimage.binary_dilation(assumed)  # up to the ground beside it, without a joint

    corners = np.array(rectangles(assumed), dtype=np.float64).reshape(-1, 2, 2)
    pieces_m = low_m + step_m * (corners - 0.5)
    cells = np.argwhere(strip)[:, ::-1]
    bounds_m = low_m + step_m * np.stack([cells.min(axis=0), cells.max(axis=0)])
    new = near & in_strip & ~np.isin(columns.triangle, floor.ground_triangles)
    n_new = np.unique(columns.column[new]).size + int(assumed.sum())
    wider = replace(
        floor,
        ground_area_m2=floor.ground_area_m2 + n_new * step_m**2,
        ground_triangles=np.union1d(floor.ground_triangles, columns.triangle[new]).astype(np.int32),
        bounds_m=np.stack([np.minimum(floor.bounds_m[0], bounds_m[0]), np.maximum(floor.bounds_m[1], bounds_m[1])]),
        plane_m=np.concatenate([floor.plane_m, pieces_m]),
    )
    lines = []
    if assumed.any():
        height_m = floor.elevation_m + float(scene.offset_m[2])
        lines.append(
            f"floor {floor.name!r}: the model has no ground outdoors on {assumed.sum() * step_m**2:.0f} m2 around it; "
            f"level ground at {height_m:.2f} m is assumed there for stations outdoors, so check the way round the "
            "building"
        )
    return (*floors[:index], wider, *floors[index + 1 :]), tuple(lines)


def with_exterior_doors_shut(scene: Scene) -> Scene:
    """Shut each open exterior door by a panel, behind the scene's triangles: what is indoors stays so when doors open.

    The same scene where none is open.
    """
    is_open = {door.element for door in scene.open_doors}
    doors = [door for door in exterior_doors(scene) if door.element in is_open] if is_open else []
    if not doors:
        return scene
    element = np.repeat(np.array([door.element for door in doors], dtype=np.int32), 2)
    return with_more_triangles(scene, np.concatenate([_panel_m(door) for door in doors]), element)


def _panel_m(door: PlacedDoor) -> FloatArray:
    """(2, 3, 3) triangles across a door's opening."""
    corners_m = [[*end_m, z] for end_m in door.line_m.tolist() for z in door.box_m[:, 2].tolist()]
    panel_m: FloatArray = np.array(corners_m)[[[0, 1, 2], [1, 3, 2]]]
    return panel_m


def _entrance_floor(scene: Scene, floors: tuple[Floor, ...]) -> tuple[int, FloatArray]:
    """Index of the lowest floor with exterior doors, and their boxes in plan, (D, 2, 2)."""
    doors = exterior_doors(scene)
    for index, floor in enumerate(floors):
        boxes_m = [door.box_m[:, :2] for door in doors if abs(door.box_m[0, 2] - floor.elevation_m) <= _FOOT_M]
        if boxes_m:
            return index, np.stack(boxes_m)
    raise RequirementError(
        f"join outside: got no exterior door (IfcDoor) on a floor of {scene.title or 'the scene'}, expected some to "
        "walk out by; leave the option out, or mark the doors in the model (IsExternal)"
    )


def _house(
    scene: Scene,
    floor: Floor,
    built: BoolArray,
    doors_m: FloatArray,
    low_m: FloatArray,
    step_m: float,
    shape: tuple[int, int],
) -> BoolArray:
    """(ny, nx) bool: what the walls around a floor enclose, doors included; its ground where they are not closed."""
    _, walls_m = cut_of_scene(scene, built, floor.elevation_m + WALL_CUT_M)
    cut = cut_cells(walls_m, low_m, step_m, shape)
    for first, end in np.rint((doors_m - low_m) / step_m).astype(int):
        cut[first[1] : end[1] + 1, first[0] : end[0] + 1] = True
    label, n_labels = ndimage.label(ndimage.binary_fill_holes(closed_walls(cut, step_m)))
    ground = sample_scene(scene, floor.ground_triangles, low_m=low_m, step_m=step_m, shape=(shape[1], shape[0]))
    on_ground = np.zeros(shape, dtype=bool)
    on_ground.ravel()[ground.column] = True
    # What encloses as good as no ground stands in the garden.
    enclosed_m2 = step_m**2 * np.bincount(label[on_ground], minlength=n_labels + 1)
    house: BoolArray = (enclosed_m2[label] >= _LEAST_M2) & (label > 0)
    return house if step_m**2 * house.sum() >= _BETWEEN_SHARE * floor.ground_area_m2 else on_ground


def _is_level(scene: Scene) -> BoolArray:
    """(T,) bool: triangles that people walk on."""
    corners_m = scene.vertices_m[scene.triangles]
    cross = area_normals(corners_m)
    found: BoolArray = np.abs(cross[:, 2]) >= np.cos(MAX_SLOPE_RAD) * np.linalg.norm(cross, axis=1)
    return found

"""Doors: which triangles of a scene are leaves of doors, separated from their frames by geometry alone.

Input a `Scene` (local frame, metres), output the same without leaves. Models show doors shut; a crew opens them. A leaf
fills the opening and a frame runs round it, so parts of a door are distinguished by where they lie in its plane:

    +--------+   frame: reaches both sides of the door's box, or one side from bottom to top,
    |+------+|   and leaves the middle free; it stays
    ||      ||
    || leaf ||   all else: leaf, panes, handles
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from planner_core.errors import SceneError
from planner_core.model import BoolArray, Doors, FloatArray, Int32Array, Int64Array, PlacedDoor, Scene
from planner_core.model.arrays import area_normals, bounds_of
from planner_core.scene.array_rows import chunks
from planner_core.scene.element_patterns import with_triangles
from planner_core.scene.rooms import room_of_points

#: What elements that are doors are called.
DOOR_KIND = "IfcDoor"
#: The middle of a door's box: shares of its width and height between which no frame reaches.
_MIDDLE = np.array([[0.3, 0.1], [0.7, 0.8]])
#: A frame reaches this near to the box's side; leaves are set into it by more.
_AT_SIDE_M = 0.015
#: What is the same door in another file lies within it by this.
_AGAIN_M = 0.06
#: A single jamb or post reaches over this share of the height.
_TALL_SHARE = 0.8
#: Rooms beside a door are searched for this far from its middle, behind walls of any thickness, and this high above
#: its foot.
_BESIDE_M = (0.3, 0.6)
_KNEE_M = 0.5
#: Cells in which walls are searched for spaces; on sites of more of them they grow. Roofs are searched for above each
#: fifth in both directions, and a space is indoors where as many of these have one: an atrium with a skylight left out.
_STEP_M, _MAX_CELLS = 0.1, 4_000_000
_ROOF_EVERY, _ROOFED_SHARE = 5, 0.8
#: What is left of a door without its leaf is a frame from this height on.
_LEAST_FRAME_M = 1.5
#: Leaves of doors, in width of one or two leaves, height, and thickness with handles; and how far above the ground they
#: end, or reach into a floor's finish.
_LEAF_WIDE_M, _LEAF_HIGH_M, _LEAF_THICK_M, _UNDERCUT_M = (0.6, 2.6), (1.8, 2.5), 0.25, 0.1


def without_door_leaves(
    scene: Scene, doors: Doors = Doors.OPEN, *, opened: tuple[str, ...] = (), shut: tuple[str, ...] = ()
) -> Scene:
    """Leave the leaves of `IfcDoor` elements out; frames stay. `Scene.open_doors` are those opened.

    Elements keep their numbers, those without triangles too. A scene of nothing but doors is left as it is.

    Parameters
    ----------
    doors
        Which: `open` leaves those shut that lead outdoors, see `exterior_doors`.
    opened, shut
        GlobalIds of doors that are open, or shut, whatever `doors` is.

    Raises
    ------
    SceneError
        One of them is of no door.
    """
    leaf = door_leaves(scene, doors, opened=opened, shut=shut)
    if not leaf.any() or leaf.all():
        return scene
    before = {door.element for door in scene.open_doors}
    elements = before.union(scene.element_of_triangle[leaf].tolist())
    # A leaf may be modelled ajar: where a door's frame is left, that is where it shuts.
    left = with_triangles(scene, ~leaf)
    framed = {door.element: door for door in placed_doors(left) if door.height_m >= _LEAST_FRAME_M}
    is_open = tuple(framed.get(door.element, door) for door in placed_doors(scene) if door.element in elements)
    return replace(left, report=replace(scene.report, n_doors_open=len(is_open)), open_doors=is_open)


def door_leaves(
    scene: Scene, doors: Doors = Doors.OPEN, *, opened: tuple[str, ...] = (), shut: tuple[str, ...] = ()
) -> BoolArray:
    """(T,) bool: triangles of the leaves that `without_door_leaves` leaves out."""
    _check_are_doors(scene, (*opened, *shut))
    is_door = np.array([element.kind == DOOR_KIND for element in scene.elements], dtype=bool)
    of_door = np.flatnonzero(is_door[scene.element_of_triangle])
    leaf = np.zeros(scene.n_triangles, dtype=bool)
    owner = scene.element_of_triangle[of_door]
    stay_shut = _shut_doors(scene, doors, owner)
    opened_doors = []
    for door in np.unique(owner).tolist():
        mine = of_door[owner == door]
        name = scene.elements[door].source_id
        if name in shut or (name not in opened and door in stay_shut):
            continue
        leaf[mine] = _is_leaf(scene.vertices_m, scene.triangles[mine])
        opened_doors.append(mine)
    return leaf | _held_again(scene, is_door, opened_doors)


def _held_again(scene: Scene, is_door: BoolArray, doors: list[Int64Array]) -> BoolArray:
    """(T,) bool: elements that are no door, but lie within one of doors, each its triangles (K,), and in its middle.

    Beside an architect's file with doors, a fabricator's has their leaves as plates, and boards that close them.
    """
    again = np.zeros(scene.n_triangles, dtype=bool)
    if not doors:
        return again
    low_m, high_m = np.full((is_door.size, 3), np.inf), np.full((is_door.size, 3), -np.inf)
    for some in chunks(scene.n_triangles):
        corners_m, owner = scene.vertices_m[scene.triangles[some]], scene.element_of_triangle[some]
        lowest_m, highest_m = bounds_of(corners_m)
        np.minimum.at(low_m, owner, lowest_m)
        np.maximum.at(high_m, owner, highest_m)
    for triangles in doors:
        of_door_m = scene.vertices_m[scene.triangles[triangles]]
        least_m, most_m = of_door_m.min(axis=(0, 1)) - _AGAIN_M, of_door_m.max(axis=(0, 1)) + _AGAIN_M
        angle = _angle(of_door_m)
        low, high = _extent(of_door_m, angle)
        middle = low[:2] + _MIDDLE * (high - low)[:2]
        within = ((low_m >= least_m) & (high_m <= most_m) & (low_m <= high_m)).all(axis=1)
        for element in np.flatnonzero(within & ~is_door).tolist():
            mine = np.flatnonzero(scene.element_of_triangle == element)
            corners_m = scene.vertices_m[scene.triangles[mine]]
            its_low, its_high = _extent(corners_m, angle)
            in_way = (its_low[:2] < middle[1]).all() and (its_high[:2] > middle[0]).all()
            again[mine] = in_way and (its_low >= low - _AGAIN_M).all() and (its_high <= high + _AGAIN_M).all()
    return again


def _extent(corners_m: FloatArray, angle: float) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest (3,) of corners (K, 3, 3) along a door's width, its height, and across it."""
    plane, across = _in_plane(corners_m, angle), corners_m[..., :2] @ np.array([np.cos(angle), np.sin(angle)])
    at = np.concatenate([plane, across[..., None]], axis=-1).reshape(-1, 3)
    return at.min(axis=0), at.max(axis=0)


def _check_are_doors(scene: Scene, names: tuple[str, ...]) -> None:
    known = {element.source_id for element in scene.elements if element.kind == DOOR_KIND}
    for name in names:
        if name not in known:
            raise SceneError(
                f"door: got {name[:40]!r}, expected the GlobalId of one of the {len(known)} doors (IfcDoor) of "
                f"{scene.source.path.name or 'the scene'}; correct it"
            )


def _shut_doors(scene: Scene, doors: Doors, all_doors: Int32Array) -> set[int]:
    """Elements of the doors that `doors` leaves shut."""
    if doors == Doors.OPEN:
        return {door.element for door in exterior_doors(scene)}
    return set(all_doors.tolist()) if doors == Doors.SHUT else set()


def exterior_doors(scene: Scene) -> list[PlacedDoor]:
    """Find the doors that lead outdoors, open or shut.

    The file may say so (IFC: IsExternal). Where it does not but has rooms, a door with a room on one side alone does,
    unless its other side lies between walls and below a roof: stairwells and garages are no rooms in some files.
    """
    doors = placed_doors(scene)
    flags = [scene.elements[door.element].is_external for door in doors]
    if not scene.rooms:
        return [door for door, flag in zip(doors, flags, strict=True) if flag]
    beside_m = np.array([_beside_m(door) for door in doors]).reshape(-1, 2, len(_BESIDE_M), 3)
    in_room = room_of_points(scene, beside_m.reshape(-1, 3)) >= 0
    has_room: BoolArray = np.asarray(in_room.reshape(beside_m.shape[:3]).any(axis=2))
    is_outer = np.array([flag is True for flag in flags], dtype=bool)
    is_unknown = np.array([flag is None for flag in flags], dtype=bool)
    one_sided = np.flatnonzero(is_unknown & (has_room[:, 0] != has_room[:, 1]))
    if one_sided.size:
        bare_m = beside_m[one_sided, has_room[one_sided, 0].astype(int)]
        is_outer[one_sided] = ~_roofed_between_walls(scene, doors, bare_m)
    return [door for door, outer in zip(doors, is_outer.tolist(), strict=True) if outer]


def placed_doors(scene: Scene) -> list[PlacedDoor]:
    """All doors, by element; open ones as they are when shut."""
    is_door = np.array([element.kind == DOOR_KIND for element in scene.elements], dtype=bool)
    of_door = np.flatnonzero(is_door[scene.element_of_triangle])
    owner = scene.element_of_triangle[of_door]
    found = {door.element: door for door in scene.open_doors}
    for element in np.unique(owner).tolist():
        if element not in found:
            corners_m = scene.vertices_m[scene.triangles[of_door[owner == element]]]
            box_m = np.stack([corners_m.min(axis=(0, 1)), corners_m.max(axis=(0, 1))])
            found[element] = PlacedDoor(element, box_m, _across(corners_m))
    return [found[element] for element in sorted(found)]


def fronts_m(door: PlacedDoor) -> FloatArray:
    """(2, 3) where somebody stands before a door, at the height of its foot: against its `across`, and along it."""
    front_m: FloatArray = _beside_m(door)[:, -1] - np.array([0.0, 0.0, _KNEE_M])
    return front_m


def _beside_m(door: PlacedDoor) -> FloatArray:
    """(2, B, 3) places to both sides of a door."""
    middle_m = np.array([*door.box_m[:, :2].mean(axis=0), door.box_m[0, 2] + _KNEE_M])
    away_m = np.array(_BESIDE_M)[:, None] * np.append(door.across, 0.0)
    return np.stack([middle_m - away_m, middle_m + away_m])


def _roofed_between_walls(scene: Scene, doors: list[PlacedDoor], beside_m: FloatArray) -> BoolArray:
    """(K,) bool: whether walls and shut doors enclose one of places (K, B, 3), most of what they enclose roofed.

    Walls are cut as high above a door's foot as people's shoulders; windows are there as panes.
    """
    # These take a while to import, for scenes without such a door.
    from scipy import ndimage

    from planner_core.scene.between_walls import cut_cells
    from planner_core.scene.columns import sample_scene
    from planner_core.scene.ground_planes import SITE_KINDS
    from planner_core.scene.level_surfaces import WALL_CUT_M, cut_of_scene

    is_site = np.array([element.kind in SITE_KINDS for element in scene.elements], dtype=bool)
    built = ~is_site[scene.element_of_triangle]
    ids = np.flatnonzero(built).astype(np.int32)
    low_m, high_m = (np.full(2, sign * np.inf) for sign in (1.0, -1.0))
    for some in chunks(ids.size):
        corners_m = scene.vertices_m[scene.triangles[ids[some]], :2]
        low_m, high_m = np.minimum(low_m, corners_m.min(axis=(0, 1))), np.maximum(high_m, corners_m.max(axis=(0, 1)))
    step_m = max(_STEP_M, float(np.sqrt(np.prod(high_m - low_m) / _MAX_CELLS)))
    low_m = low_m - 2.0 * step_m  # a free cell around all
    nx, ny = (np.ceil((high_m - low_m) / step_m) + 3).astype(int).tolist()
    few = (-(-nx // _ROOF_EVERY), -(-ny // _ROOF_EVERY))
    columns = sample_scene(scene, ids, low_m=low_m, step_m=_ROOF_EVERY * step_m, shape=few)
    found = np.zeros(beside_m.shape[0], dtype=bool)
    cut_m = np.round(beside_m[:, 0, 2] - _KNEE_M + WALL_CUT_M, 2)
    for z_m in np.unique(cut_m).tolist():
        _, walls_m = cut_of_scene(scene, built, z_m)
        shut = [door.line_m for door in doors if door.box_m[0, 2] < z_m <= door.box_m[1, 2]]
        free = ~cut_cells(np.concatenate([walls_m, np.reshape(shut, (-1, 2, 2))]), low_m, step_m, (ny, nx))
        label = ndimage.label(free)[0]
        roofed = np.zeros(few[0] * few[1], dtype=bool)
        roofed[columns.column[columns.z_m > z_m]] = True
        space = label[::_ROOF_EVERY, ::_ROOF_EVERY].ravel()
        n_roofed = np.bincount(space, weights=roofed, minlength=label.max() + 1)
        n_cells = np.bincount(space, minlength=n_roofed.size)
        indoors = n_roofed >= _ROOFED_SHARE * np.maximum(n_cells, 1)
        indoors[[0, label[0, 0]]] = False  # walls themselves, and what is around the building
        rows = np.flatnonzero(cut_m == z_m)
        cell = np.rint((beside_m[rows, :, :2] - low_m) / step_m).astype(int)
        cell = np.clip(cell, 0, [nx - 1, ny - 1])
        found[rows] = indoors[label[cell[..., 1], cell[..., 0]]].any(axis=1)
    return found


def _across(corners_m: FloatArray) -> FloatArray:
    """(2,) unit direction in plan through a door, of whole ones and of frames alone: that in which it is thinnest."""
    plan_m = corners_m[..., :2].reshape(-1, 2)
    _, directions = np.linalg.eigh(np.cov(plan_m, rowvar=False))
    across: FloatArray = directions[:, 0]
    return across


@dataclass(frozen=True)
class Leaf:
    """A body of a mesh that has the shape of a door leaf. middle_m, across : (3,) float64, local; across is level.

    is_whole : the element is this leaf and nothing else.
    """

    element: int
    middle_m: FloatArray
    across: FloatArray
    width_m: float
    height_m: float
    is_whole: bool


def leaves_around(scene: Scene, *, low_m: FloatArray, high_m: FloatArray, ground_m: float) -> list[Leaf]:
    """Find upright plates of a door leaf's size that stand on ground at a height, inside plan bounds (2,) each.

    For meshes, whose doors have no class: bodies by themselves, so none that shares its edges with the wall.
    """
    corners_m = scene.vertices_m[scene.triangles]
    lowest_m, highest_m = bounds_of(corners_m)
    within = ((lowest_m[:, :2] >= low_m) & (highest_m[:, :2] <= high_m)).all(axis=1)
    within &= (highest_m[:, 2] > ground_m) & (lowest_m[:, 2] < ground_m + _LEAF_HIGH_M[1])
    number = np.flatnonzero(within)
    if not number.size:
        return []
    part, n_parts = _parts(scene.triangles[number])
    order = np.argsort(part, kind="stable")
    found = []
    for rows in np.split(number[order], np.cumsum(np.bincount(part, minlength=n_parts))[:-1]):
        leaf = _leaf_of(scene, rows, ground_m)
        found += [] if leaf is None else [leaf]
    return found


def _leaf_of(scene: Scene, triangles: Int64Array, ground_m: float) -> Leaf | None:
    """The body of some triangles (K,) as a leaf; None where it has another shape."""
    corners_m = scene.vertices_m[scene.triangles[triangles]]
    low_m, high_m = corners_m.min(axis=(0, 1)), corners_m.max(axis=(0, 1))
    height_m = float(high_m[2] - low_m[2])
    if not _LEAF_HIGH_M[0] <= height_m <= _LEAF_HIGH_M[1] or abs(low_m[2] - ground_m) > _UNDERCUT_M:
        return None
    angle = _angle(corners_m)
    across = np.array([np.cos(angle), np.sin(angle), 0.0])
    along = np.array([-np.sin(angle), np.cos(angle), 0.0])
    width_m, thick_m = (float(np.ptp(corners_m @ axis)) for axis in (along, across))
    if not _LEAF_WIDE_M[0] <= width_m <= _LEAF_WIDE_M[1] or thick_m > _LEAF_THICK_M:
        return None
    element = int(scene.element_of_triangle[triangles[0]])
    is_whole = int((scene.element_of_triangle == element).sum()) == triangles.size
    return Leaf(element, 0.5 * (low_m + high_m), across, width_m, height_m, is_whole)


def _is_leaf(vertices_m: FloatArray, triangles: Int32Array) -> BoolArray:
    """(K,) bool: which of one door's triangles (K, 3) are of its leaves."""
    corners_m = vertices_m[triangles]
    plane = _in_plane(corners_m, _angle(corners_m))
    low, high = plane.min(axis=(0, 1)), plane.max(axis=(0, 1))
    middle = low + _MIDDLE * (high - low)
    part, n_parts = _parts(triangles)
    fills = np.zeros(n_parts, dtype=bool)
    fills[part[_overlaps(plane, middle)]] = True
    part_low, part_high = np.full((n_parts, 2), np.inf), np.full((n_parts, 2), -np.inf)
    lowest, highest = bounds_of(plane)
    np.minimum.at(part_low, part, lowest)
    np.maximum.at(part_high, part, highest)
    at_left, at_right = part_low[:, 0] <= low[0] + _AT_SIDE_M, part_high[:, 0] >= high[0] - _AT_SIDE_M
    tall = part_high[:, 1] - part_low[:, 1] >= _TALL_SHARE * (high[1] - low[1])
    frame = ~fills & ((at_left & at_right) | ((at_left | at_right) & tall))
    return np.asarray(~frame[part])


def _in_plane(corners_m: FloatArray, angle: float) -> FloatArray:
    """(K, 3, 2) corners along a door's width and height; `angle` is its direction across."""
    along = np.array([-np.sin(angle), np.cos(angle)])
    return np.stack([corners_m[..., :2] @ along, corners_m[..., 2]], axis=-1)


def _angle(corners_m: FloatArray) -> float:
    """Direction across a door, from x to y: its plane is that of most of its upright area."""
    normal = area_normals(corners_m)
    # Normals of both signs count alike: angles are doubled before they are averaged.
    area_m2 = np.hypot(normal[:, 0], normal[:, 1])
    doubled = 2.0 * np.arctan2(normal[:, 1], normal[:, 0])
    return float(0.5 * np.arctan2((area_m2 * np.sin(doubled)).sum(), (area_m2 * np.cos(doubled)).sum()))


def _parts(triangles: Int32Array) -> tuple[Int64Array, int]:
    """Part of each triangle (K,), and how many there are: bodies that are connected by edges of just two triangles.

    Where leaf and frame touch, an edge has three or four: it joins nothing.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(triangles.shape[0]), 3)
    _, number, count = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    first = (np.cumsum(count) - count)[count == 2]
    order = np.argsort(number.reshape(-1), kind="stable")
    a, b = owner[order[first]], owner[order[first + 1]]
    graph = coo_array((np.ones(a.size, dtype=np.int8), (a, b)), shape=(triangles.shape[0],) * 2)
    n_parts, part = connected_components(graph, directed=False)
    return part.astype(np.int64), int(n_parts)


def _overlaps(plane: FloatArray, box: FloatArray) -> BoolArray:
    """(K,) bool: triangles (K, 3, 2) that reach into an upright box (2, 2), by separating lines."""
    lowest, highest = bounds_of(plane)
    apart = ((highest <= box[0]) | (lowest >= box[1])).any(axis=1)
    corners = np.array([[box[i, 0], box[j, 1]] for i in (0, 1) for j in (0, 1)])
    for k in range(3):
        a, b, c = plane[:, k], plane[:, (k + 1) % 3], plane[:, (k + 2) % 3]
        across = np.stack([a[:, 1] - b[:, 1], b[:, 0] - a[:, 0]], axis=-1)
        side = ((c - a) * across).sum(axis=1)
        of_box = (corners[None] - a[:, None]) @ across[:, :, None]
        apart |= (of_box[..., 0] * np.sign(side)[:, None] <= 0).all(axis=1)
    return np.asarray(~apart)

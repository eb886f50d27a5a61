"""Rooms: which one a point, or the front of a surface, lies in. Rooms are the source's (IfcSpace), local frame, metres.

A scene whose source names no rooms has none, and everything lies in room -1. Where rooms overlap, as a flat and its
bathroom do in some files, the smaller one counts.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner_core.errors import readable
from planner_core.model import FloatArray, Int32Array, Room, Scene, Storey
from planner_core.scene.build import to_scene_frame
from planner_core.scene.inside import enclosures

#: How far in front of a surface its room is searched for: spaces end at the bare wall, a little behind its lining.
IN_FRONT_M = 0.05
#: Rooms stand on their storey, on a raised floor or a half storey; further off, something is wrong.
_STOREY_OFF_M = 1.5
#: Screeds of a storey's rooms differ by less.
_SAME_OFF_M = 0.3
#: Shafts and stairs begin on other storeys.
_MOST_ROOMS = 0.8
#: Rooms end at walls: none reaches further beyond all surfaces than a facade that is missing is thick.
_BEYOND_M = 1.0
#: Rooms are searched for in and behind a wall beside a door, above its threshold.
_BESIDE_M, _KNEE_M = 0.6, 0.5


def room_of_points(scene: Scene, points_m: FloatArray) -> Int32Array:
    """(N,) int32 into `scene.rooms` of points (N, 3), local frame; -1: in none."""
    out = np.full(points_m.shape[0], -1, dtype=np.int32)
    if not scene.rooms:
        return out
    corners_m = np.concatenate([room.vertices_m[room.triangles] for room in scene.rooms])
    owner = np.repeat(np.arange(len(scene.rooms)), [room.triangles.shape[0] for room in scene.rooms])
    inside = enclosures(points_m, corners_m, owner)
    # The largest box is written first, so that the smallest stays.
    size_m3 = np.array([np.prod(np.ptp(room.box_m, axis=0)) for room in scene.rooms])
    order = np.argsort(-size_m3[inside.shape], kind="stable")
    out[inside.point[order]] = inside.shape[order]
    return out


def room_of_surfaces(scene: Scene, points_m: FloatArray, normals: FloatArray) -> Int32Array:
    """(N,) int32 into `scene.rooms`: the room in front of surfaces at points (N, 3) with unit normals (N, 3).

    In front is where the normal points; where no room is there, behind: sheets have two sides. -1: in none.
    """
    if not scene.rooms:
        return np.full(points_m.shape[0], -1, dtype=np.int32)
    front = room_of_points(scene, points_m + IN_FRONT_M * normals)
    back = np.flatnonzero(front < 0)
    front[back] = room_of_points(scene, points_m[back] - IN_FRONT_M * normals[back])
    return front


def with_rooms(
    scene: Scene, rooms: tuple[Room, ...], storeys: tuple[Storey, ...], *, metres_per_unit: float, up_axis: str
) -> Scene:
    """The scene with rooms as its source has them.

    Parameters
    ----------
    rooms, storeys
        Of the reader: source frame, and in its order, which the scene's need not be.
    metres_per_unit, up_axis
        Of the rooms' vertices.
    """
    if not rooms:
        return scene
    place = {storey.source_id: index for index, storey in enumerate(scene.storeys)}
    of_storey = [place.get(readable(storey.source_id), -1) for storey in storeys]
    placed = (
        replace(
            room,
            name=readable(room.name),
            long_name=readable(room.long_name),
            storey=of_storey[room.storey] if room.storey >= 0 else -1,
            vertices_m=to_scene_frame(room.vertices_m, metres_per_unit, up_axis) - scene.offset_m,
        )
        for room in rooms
    )
    return _beside_the_building(_on_their_storeys(replace(scene, rooms=tuple(placed))))


def _beside_the_building(scene: Scene) -> Scene:
    """The scene, with a warning where rooms reach beyond all surfaces in plan, as where they are shifted aside.

    What people do outdoors is a room in some files (gardens, terraces), so nothing is moved.
    """
    boxes_m = np.stack([room.box_m[:, :2] for room in scene.rooms])
    low_m, high_m = scene.vertices_m[:, :2].min(axis=0), scene.vertices_m[:, :2].max(axis=0)
    beyond_m = np.maximum(low_m - boxes_m[:, 0], boxes_m[:, 1] - high_m).max(axis=1)
    count = int((beyond_m > _BEYOND_M).sum())
    if not count:
        return scene
    furthest = scene.rooms[int(beyond_m.argmax())]
    reach = "reaches" if count == 1 else "reach"
    line = (
        f"{scene.source.path.name}: {count} of its {len(scene.rooms)} rooms (IfcSpace) {reach} beyond all surfaces, "
        f"{furthest.title} by {beyond_m.max():.1f} m: where that is no outdoor area, rooms are shifted aside and names "
        "of rooms in results are wrong; check their placement."
    )
    return replace(scene, report=replace(scene.report, warnings=(*scene.report.warnings, line)))


def _on_their_storeys(scene: Scene) -> Scene:
    """The scene with rooms brought back to their storeys where all lie off them by one height, with a warning.

    Programs that add a storey's height twice write rooms a storey off: names, and which doors lead outdoors, would be
    those of the storey below. Where rooms are right and their storeys wrong, most doors have rooms beside them as they
    are, and no room is out of the building.
    """
    placed = [room for room in scene.rooms if room.storey >= 0]
    if not placed:
        return scene
    off_m = np.array([room.box_m[0, 2] - scene.storeys[room.storey].elevation_m for room in placed])
    shift_m = float(np.median(off_m))
    is_one = np.mean(np.abs(off_m - shift_m) <= _SAME_OFF_M) >= _MOST_ROOMS
    if abs(shift_m) < _STOREY_OFF_M or not is_one:
        return scene
    boxes_m = np.stack([room.box_m for room in placed])
    back_m = boxes_m - np.array([0.0, 0.0, shift_m])
    low_m, high_m = scene.vertices_m[:, 2].min(), scene.vertices_m[:, 2].max()
    middle_m = boxes_m[:, :, 2].mean(axis=1)
    is_out = ((middle_m < low_m) | (middle_m > high_m)).any()
    if not is_out and _doors_beside(scene, back_m) <= _doors_beside(scene, boxes_m):
        return scene
    lower = np.array([0.0, 0.0, shift_m])
    moved = tuple(replace(r, vertices_m=r.vertices_m - lower) if r.storey >= 0 else r for r in scene.rooms)
    side = "above" if shift_m > 0 else "below"
    line = (
        f"{scene.source.path.name}: its rooms (IfcSpace) lie {abs(shift_m):.2f} m {side} "
        "the storeys that they belong to: they are taken back to them; check the names of rooms in results."
    )
    return replace(scene, rooms=moved, report=replace(scene.report, warnings=(*scene.report.warnings, line)))


def _doors_beside(scene: Scene, boxes_m: FloatArray) -> int:
    """Number of doors whose middle, at knee height, is inside or beside one of boxes (R, 2, 3)."""
    is_door = np.array([element.kind == "IfcDoor" for element in scene.elements], dtype=bool)
    of_door = np.flatnonzero(is_door[scene.element_of_triangle])
    count = 0
    for door in np.unique(scene.element_of_triangle[of_door]).tolist():
        corners_m = scene.vertices_m[scene.triangles[of_door[scene.element_of_triangle[of_door] == door]]]
        low, high = corners_m.min(axis=(0, 1)), corners_m.max(axis=(0, 1))
        at_m = np.array([*(0.5 * (low + high))[:2], low[2] + _KNEE_M])
        margin_m = np.array([_BESIDE_M, _BESIDE_M, 0.0])
        count += bool(((at_m >= boxes_m[:, 0] - margin_m) & (at_m <= boxes_m[:, 1] + margin_m)).all(axis=1).any())
    return count

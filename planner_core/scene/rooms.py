"""Rooms: which one a point, or the front of a surface, lies in. Rooms are the source's (IfcSpace), local frame, metres.

A scene whose source names no rooms has none, and everything lies in room -1. Where rooms overlap, as a flat and its
bathroom do in some files, the smaller one counts.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner_core.model import FloatArray, Int32Array, Room, Scene, Storey
from planner_core.scene.build import to_scene_frame
from planner_core.scene.inside import enclosures
from planner_core.scene.wording import readable

#: How far in front of a surface its room is looked for: spaces end at the bare wall, a little behind its lining.
IN_FRONT_M = 0.05


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
    return replace(scene, rooms=tuple(placed))

"""Which room each required patch belongs to: the source's rooms (IfcSpace), or regions of free floor where it has none.

Input a `Survey` and its `FreeSpace`, output `PlanRooms`; local frame, metres. Regions are those between doorways
(`positions/rooms.py`). A patch belongs to the region whose ground is nearest in plan to a place in front of it or, as
sheets wind either way, behind it; the ground has to be of the floor that the patch counts for.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from planner_core.coverage.patch_reasons import Surfaces, surfaces_of
from planner_core.coverage.plausibility_figures import at_knee
from planner_core.model import BoolArray, FloatArray, Int64Array, PlanRoom, PlanRooms, Survey
from planner_core.positions.free_space import FreeSpace
from planner_core.positions.reach import MIN_REGION_M2
from planner_core.positions.rooms import find_rooms
from planner_core.scene.rooms import room_of_points

#: In front of a wall this far off, its room's ground begins: cells beside walls are no ground.
_IN_FRONT_M = 0.1
#: Ground is at most this far in plan: cupboards and other furniture are as deep.
_FAR_M = 1.0
#: Patches described at once; bounds memory to a hundred megabytes.
_CHUNK = 200_000


def rooms_of_patches(survey: Survey, space: FreeSpace, required: BoolArray) -> PlanRooms:
    """Assign the patches that are `required` (P,) to rooms, -1 where they are in none.

    Rooms without a required patch are left out; so are regions of less than `MIN_REGION_M2`, whose surfaces go to the
    nearest of the others.
    """
    of_source = bool(survey.scene.rooms)
    node, room_of_node = _nodes_in_rooms(survey, space) if of_source else _nodes_in_regions(survey, space)
    n_rooms = len(survey.scene.rooms) if of_source else int(room_of_node.max(initial=-1)) + 1
    room, floor = (np.full(required.size, -1, dtype=np.int64) for _ in range(2))
    boxes_m = np.repeat([[[np.inf] * 3, [-np.inf] * 3]], n_rooms, axis=0)
    patches = np.flatnonzero(required).astype(np.int32)
    for first in range(0, patches.size, _CHUNK):
        surfaces = surfaces_of(survey, patches[first : first + _CHUNK])
        found = surfaces.room if of_source else _nearest_region(space, node, room_of_node, surfaces)
        room[surfaces.patch], floor[surfaces.patch] = found, surfaces.floor
        inside = found >= 0
        np.minimum.at(boxes_m[:, 0], found[inside], surfaces.centroid_m[inside])
        np.maximum.at(boxes_m[:, 1], found[inside], surfaces.centroid_m[inside])
    used, number = np.unique(room[room >= 0], return_inverse=True)
    rooms = []
    for index in used.tolist():
        source = survey.scene.rooms[index] if of_source else None
        floors = floor[(room == index) & (floor >= 0)]
        rooms.append(
            PlanRoom(
                name=source.title if source else "",
                source_id=source.source_id if source else "",
                floor=survey.floors[int(np.bincount(floors).argmax())].id if floors.size else "",
                label_m=_roomiest(space, node[room_of_node == index], boxes_m[index]),
                box_m=boxes_m[index],
            )
        )
    out = np.full(required.size, -1, dtype=np.int32)
    out[room >= 0] = number.reshape(-1)
    return PlanRooms(tuple(rooms), out)


def _nodes_in_rooms(survey: Survey, space: FreeSpace) -> tuple[Int64Array, Int64Array]:
    """Nodes (C,) of the floors' ground, and the source's room that each is in, -1 none."""
    node = np.flatnonzero(space.on_ground)
    return node, room_of_points(survey.scene, at_knee(space.position_m(node))).astype(np.int64)


def _nodes_in_regions(survey: Survey, space: FreeSpace) -> tuple[Int64Array, Int64Array]:
    """Nodes (C,) of the planned floors, and the region between doorways that each is in, numbered over all floors."""
    nodes, regions, n_regions = [np.empty(0, dtype=np.int64)], [np.empty(0, dtype=np.int64)], 0
    for index in survey.planned:
        found = find_rooms(space, index)
        large = np.bincount(found.room) * space.cell_m2 >= MIN_REGION_M2
        kept = large[found.room]
        nodes.append(found.node[kept])
        regions.append((np.cumsum(large) - 1)[found.room[kept]] + n_regions)
        n_regions += int(large.sum())
    return np.concatenate(nodes), np.concatenate(regions)


def _nearest_region(space: FreeSpace, node: Int64Array, region: Int64Array, surfaces: Surfaces) -> Int64Array:
    """(N,) region of each surface, -1 where no ground of its floor is near."""
    out = np.full(surfaces.patch.size, -1, dtype=np.int64)
    ground_m, aside_m = space.position_m(node)[:, :2], _IN_FRONT_M * surfaces.normal[:, :2]
    for floor in np.unique(surfaces.floor[surfaces.floor >= 0]).tolist():
        of_floor, here = np.flatnonzero(space.floor[node] == floor), np.flatnonzero(surfaces.floor == floor)
        if not of_floor.size:
            continue
        tree, places_m = cKDTree(ground_m[of_floor]), surfaces.centroid_m[here, :2]
        front_m, front = tree.query(places_m + aside_m[here], distance_upper_bound=_FAR_M)
        back_m, back = tree.query(places_m - aside_m[here], distance_upper_bound=_FAR_M)
        # By half a cell: of ground on both sides that in front counts.
        nearest = np.where(front_m <= back_m + 0.5 * space.grid.cell_m, front, back)
        near = nearest < of_floor.size
        out[here[near]] = region[of_floor[nearest[near]]]
    return out


def _roomiest(space: FreeSpace, nodes: Int64Array, box_m: FloatArray) -> FloatArray:
    """(3,) the place on a room's ground (nodes (K,)) that is farthest from obstacles; without any, below its middle."""
    if not nodes.size:
        return np.array([*box_m[:, :2].mean(axis=0), box_m[0, 2]])
    # Where several are as far, the one amidst all.
    free = nodes[space.clearance_m[nodes] >= space.clearance_m[nodes].max() - 0.5 * space.grid.cell_m]
    places_m = space.position_m(free)
    away_m = np.linalg.norm(places_m[:, :2] - space.position_m(nodes)[:, :2].mean(axis=0), axis=1)
    return np.asarray(places_m[away_m.argmin()], dtype=np.float64)

"""What plausibility measures of a plan: its ground, its rooms and the stations in them. docs/method/plausibility.md.

Input a finished `Plan` and the `Reach` that its stations were chosen in (local frame, metres).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner_core.coverage.floor_figures import SQUARE_M, FloorFigures
from planner_core.model import BoolArray, FloatArray, Int32Array, Int64Array, Plan, Station, Survey
from planner_core.positions.reach import Reach
from planner_core.positions.rooms import find_rooms
from planner_core.scene.rooms import room_of_points

#: Rooms of a file that are smaller are shafts and cupboards, which nobody enters with a tripod.
LEAST_ROOM_M2 = 2.0
#: The room of a place is searched for at this height above the ground: over thresholds, below most furniture.
_KNEE_M = 0.5
#: A sensor on its tripod is no higher above the ground of its room.
_OVER_GROUND_M = 3.0


@dataclass(frozen=True)
class FloorPlaces:
    """Walkable places of the floors, one of each square and region, the insides of solids left out.

    node : (K,) int64 of the free space. ground_m : (K, 3). area_m2 : (K,) of the ground that each stands for.
    floor : (K,) int32. reached, planned : (K,) bool, whether a crew comes there; and whether it is in scope, on a
    planned floor, too.
    """

    node: Int64Array
    ground_m: FloatArray
    area_m2: FloatArray
    floor: Int32Array
    reached: BoolArray
    planned: BoolArray


@dataclass(frozen=True)
class RoomFigures:
    """A room with planned ground. area_m2 : of that ground, where one can walk. stations : that stand in it.

    away_m : from its ground to the nearest station, in plan.
    """

    name: str
    area_m2: float
    stations: tuple[Station, ...]
    away_m: float


class PlanFigures(FloorFigures):
    """What the checks measure of a plan, each worked out once."""

    def __init__(self, plan: Plan, reach: Reach) -> None:
        self.plan, self.reach, self.survey = plan, reach, plan.survey
        self.places = _places_of(plan.survey, reach)
        super().__init__(plan.survey.scene, plan.survey.floors, plan.survey.planned)
        of = {self.floors[index].id for index in self.planned}
        self.stations: tuple[Station, ...] = tuple(each for each in plan.stations if each.floor in of)

    @cached_property
    def planned_m2(self) -> float:
        """Ground of the planned floors that is in scope and reached, with what is under furniture and walls there."""
        at, total_m2 = self.places, 0.0
        for index in self.planned:
            here = at.floor == index
            share = at.area_m2[here & at.planned].sum() / max(float(at.area_m2[here].sum()), 1e-9)
            total_m2 += float(share) * self.floors[index].ground_area_m2
        return total_m2

    @cached_property
    def rooms(self) -> tuple[RoomFigures, ...]:
        """Rooms with planned ground: those that the file names, else what lies between doorways."""
        at, scene = self.places, self.scene
        heads_m = np.array([each.position_m for each in self.stations]).reshape(-1, 3)
        if scene.rooms:
            place = room_of_points(scene, at_knee(at.ground_m))
            of_station = room_of_points(scene, heads_m)
            names = [repr(room.title) for room in scene.rooms]
        else:
            of_node, names = self._rooms_between_doorways()
            below = np.array([self.reach.space.node_below(head_m) for head_m in heads_m], dtype=np.int64)
            place, of_station = of_node[at.node], np.where(below < 0, -1, of_node[below])
        by_room = np.flatnonzero(at.planned)
        by_room = by_room[np.argsort(place[by_room], kind="stable")]
        ends = np.searchsorted(place[by_room], np.arange(len(names) + 1))
        found = []
        for room, name in enumerate(names):
            here = by_room[ends[room] : ends[room + 1]]
            area_m2 = float(at.area_m2[here].sum())
            if area_m2 >= LEAST_ROOM_M2:
                inside = [self.stations[k] for k in np.flatnonzero(of_station == room).tolist()]
                away_m = _nearest_m(at.ground_m[here], heads_m)
                found.append(RoomFigures(name, area_m2, tuple(inside), away_m))
        return tuple(found)

    def _rooms_between_doorways(self) -> tuple[Int32Array, list[str]]:
        """(N,) int32 room of each node, -1 for none; and where each room is."""
        space = self.reach.space
        out, names = np.full(space.n_nodes, -1, dtype=np.int32), list[str]()
        for index, floor in enumerate(self.floors):
            found = find_rooms(space, index)
            out[found.node] = len(names) + found.room
            for room in range(int(found.room.max(initial=-1)) + 1):
                inside = found.node[found.room == room]
                x, y, _ = space.position_m(inside[inside.size // 2 :][:1])[0] + self.scene.offset_m
                names.append(f"about ({x:.1f}, {y:.1f}) on floor {floor.name!r}")
        return out, names


def _places_of(survey: Survey, reach: Reach) -> FloorPlaces:
    space = reach.space
    solid = np.array([*(region.in_solid for region in reach.regions), True])
    node = np.flatnonzero(space.on_ground & ~solid[reach.near_region])
    side = max(1, round(SQUARE_M / space.grid.cell_m))
    ix, iy = space.column[node] % space.grid.nx // side, space.column[node] // space.grid.nx // side
    square = iy * (space.grid.nx // side + 1) + ix
    key = (square * len(survey.floors) + space.floor[node]) * len(reach.regions) + reach.near_region[node]
    _, first, count = np.unique(key, return_index=True, return_counts=True)
    chosen = node[first]
    ground_m, floor = space.position_m(chosen), space.floor[chosen]
    of_region = np.array([*(region.reached for region in reach.regions), False])
    reached = of_region[reach.near_region[chosen]]
    planned = reached & np.isin(floor, survey.planned)
    if survey.scope is not None:
        planned[planned] = survey.scope.admits(ground_m[planned])
    return FloorPlaces(chosen, ground_m, count * space.cell_m2, floor, reached, planned)


def at_knee(ground_m: FloatArray) -> FloatArray:
    """(K, 3) places at the height at which rooms are searched for, over ground (K, 3)."""
    knee_m: FloatArray = ground_m + np.array([0.0, 0.0, _KNEE_M])
    return knee_m


def _nearest_m(ground_m: FloatArray, heads_m: FloatArray) -> float:
    """Distance in plan from places (K, 3) to the nearest of sensors (S, 3) over the same floor; inf: to none."""
    least_m = math.inf
    for head_m in heads_m:
        level = np.abs(head_m[2] - ground_m[:, 2]) <= _OVER_GROUND_M
        away_m = np.linalg.norm(ground_m[level, :2] - head_m[:2], axis=1)
        least_m = min(least_m, float(away_m.min(initial=math.inf)))
    return least_m

"""What plausibility measures of floors and of a plan. docs/method/plausibility.md. Local frame, metres.

Of floors, each with ground triangles: headroom, which lie over each other, what walls enclose around their ground,
measured on plumb lines every 0.4 m. Of a finished `Plan` and the `Reach` that its stations were chosen in: its ground,
its rooms and the stations in them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import ndimage

from planner_core.model import BoolArray, FloatArray, Floor, Int32Array, Int64Array, Plan, Scene, Station, Survey
from planner_core.positions.reach import Reach
from planner_core.positions.rooms import find_rooms
from planner_core.scene.between_walls import GAP_M, between_walls, cut_cells
from planner_core.scene.columns import sample_scene
from planner_core.scene.ground_planes import SITE_KINDS
from planner_core.scene.level_surfaces import MIN_CLEAR_M, WALL_CUT_M, cut_of_scene
from planner_core.scene.rooms import room_of_points

#: Ground, rooms and stations are distinguished at one place of each square of this side: the narrowest rooms have
#: several.
_SQUARE_M = 0.4
#: Floors lie over each other where they share this part of the smaller one's ground.
_OVER_SHARE = 0.1
#: Ground of other floors accounts for what is enclosed at a floor's height if it lies below this, above the floor.
_BESIDE_M = 2.0
#: Cells that the walls' cut is drawn in; larger where there would be more.
_CELL_M, _MAX_CELLS = 0.2, 1_000_000
#: Walls around a ledge or dock are nearer; what is further off is another building, or a stray face.
_AROUND_M = 100.0
#: A storey that was not found lies over such a part of a floor's ground; chimneys and turrets do not.
_PART = 1 / 3
#: Rooms of a file that are smaller are shafts and cupboards, which nobody enters with a tripod.
LEAST_ROOM_M2 = 2.0
#: The room of a place is searched for at this height above the ground: over thresholds, below most furniture.
_KNEE_M = 0.5
#: A sensor on its tripod is no higher above the ground of its room.
_OVER_GROUND_M = 3.0


@dataclass(frozen=True)
class GroundPlaces:
    """Places on the ground of floors with room to stand, one a floor of each square.

    ground_m, headroom_m, top_m : (K,) height, free height above, inf under open sky, and height of the highest surface
    above. floor : (K,) int32. square : (K,) int64, equal for places over each other. plan_m : (K, 2).
    """

    plan_m: FloatArray
    ground_m: FloatArray
    headroom_m: FloatArray
    top_m: FloatArray
    floor: Int32Array
    square: Int64Array
    square_m2: float


class FloorFigures:
    """What the checks measure of floors. planned : indices into `floors` of those that are doubted."""

    def __init__(self, scene: Scene, floors: Sequence[Floor], planned: Sequence[int]) -> None:
        self.scene, self.floors, self.planned = scene, floors, planned

    @cached_property
    def ground(self) -> GroundPlaces:
        """Places on the ground of all floors."""
        scene = self.scene
        low_m, high_m = scene.vertices_m[:, :2].min(axis=0), scene.vertices_m[:, :2].max(axis=0)
        step_m = max(_SQUARE_M, math.sqrt(float(np.prod(high_m - low_m)) / _MAX_CELLS))
        n_x, n_y = (np.floor((high_m - low_m) / step_m).astype(np.int64) + 1).tolist()
        every = np.arange(scene.n_triangles, dtype=np.int32)
        low_m = low_m + step_m * np.array([0.37, 0.43])  # off the round figures that designers align walls to
        columns = sample_scene(scene, every, low_m=low_m, step_m=step_m, shape=(n_x, n_y))
        floor_of = np.full(scene.n_triangles, -1, dtype=np.int32)
        for index, floor in enumerate(self.floors):
            floor_of[floor.ground_triangles] = index
        floor_at, clear_m = floor_of[columns.triangle], columns.clear_height_m()
        row = np.flatnonzero((floor_at >= 0) & (clear_m >= MIN_CLEAR_M))
        _, first = np.unique(np.stack([columns.column[row], floor_at[row]]), axis=1, return_index=True)
        row = row[first]
        column = columns.column[row]
        last = np.searchsorted(columns.column, column, side="right") - 1  # crossings ascend
        return GroundPlaces(
            plan_m=np.column_stack([columns.x_m[column % n_x], columns.y_m[column // n_x]]),
            ground_m=columns.z_m[row],
            headroom_m=clear_m[row],
            top_m=columns.z_m[last],
            floor=floor_at[row],
            square=column,
            square_m2=step_m * step_m,
        )

    def room_height_m(self, index: int) -> float:
        """Median height of rooms on a floor, where something is overhead; NaN where nothing is."""
        here_m = self.ground.headroom_m[self.ground.floor == index]
        here_m = here_m[np.isfinite(here_m)]
        return float(np.median(here_m)) if here_m.size else math.nan

    def height_to_top_m(self, index: int) -> float:
        """Height of the building above a floor's ground, which it has over a part of the ground at least.

        Plumb lines through the ground count, where something is overhead: neither a tower beside nor a chimney does.
        """
        at = self.ground
        here = (at.floor == index) & np.isfinite(at.headroom_m)
        return float(np.quantile((at.top_m - at.ground_m)[here], 1.0 - _PART)) if here.any() else 0.0

    def next_above(self, index: int) -> tuple[int, float] | None:
        """The next floor over a part of this one, and how much higher its ground is there; None: none is over it.

        Ground of one floor has several heights where wings lie half a storey apart.
        """
        at = self.ground
        own = np.flatnonzero(at.floor == index)
        for other in range(len(self.floors)):
            if self.floors[other].elevation_m <= self.floors[index].elevation_m:
                continue
            over = np.flatnonzero(at.floor == other)
            shared, low, high = np.intersect1d(at.square[own], at.square[over], return_indices=True)
            n_least = min(np.unique(at.square[own]).size, np.unique(at.square[over]).size)
            if shared.size and shared.size >= _OVER_SHARE * n_least:
                return other, float(np.median(at.ground_m[over[high]] - at.ground_m[own[low]]))
        return None

    def beside_m2(self, index: int) -> float:
        """Ground of other floors under what is open at a floor's height: the hall below a gallery, the other wing."""
        at, height_m = self.ground, self.floors[index].elevation_m
        over = (at.ground_m < height_m + _BESIDE_M) & (at.ground_m + at.headroom_m > height_m + WALL_CUT_M)
        return float(np.count_nonzero((at.floor != index) & over)) * at.square_m2

    def enclosed_m2(self, index: int) -> float:
        """Area between the walls around a floor's ground at the height of a cut; terrain is no wall."""
        scene, floor = self.scene, self.floors[index]
        own_m = self.ground.plan_m[self.ground.floor == index]
        site = np.array([element.kind in SITE_KINDS for element in scene.elements], dtype=np.bool_)
        around_m = floor.bounds_m + np.array([[-_AROUND_M], [_AROUND_M]])
        cut = ~site[scene.element_of_triangle]
        _, segments_m = cut_of_scene(scene, cut, floor.elevation_m + WALL_CUT_M, around_m)
        if not len(own_m) or not len(segments_m):
            return 0.0
        ends_m = segments_m.reshape(-1, 2)
        low_m, high_m = ends_m.min(axis=0) - GAP_M, ends_m.max(axis=0) + GAP_M
        cell_m = max(_CELL_M, math.sqrt(float(np.prod(high_m - low_m)) / _MAX_CELLS))
        n_x, n_y = (np.floor((high_m - low_m) / cell_m).astype(np.int64) + 1).tolist()
        inside = between_walls(cut_cells(segments_m, low_m, cell_m, (n_y, n_x)), cell_m)
        label, _ = ndimage.label(inside)
        ix, iy = np.rint((own_m - low_m) / cell_m).astype(np.int64).T
        on_grid = (ix >= 0) & (ix < n_x) & (iy >= 0) & (iy < n_y)
        around = np.unique(label[iy[on_grid], ix[on_grid]])
        return float(np.isin(label, around[around > 0]).sum()) * cell_m * cell_m


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
        stations = [each for each in plan.stations if each.floor in of]
        if stations and plan.survey.scope is not None:  # those that only join what is surveyed stand beside it
            height_m = np.array([[0.0, 0.0, each.instrument_height_m] for each in stations])
            beside = ~plan.survey.scope.surveys(np.stack([each.position_m for each in stations]) - height_m)
            stations = [each for each, is_out in zip(stations, beside.tolist(), strict=True) if not is_out]
        self.stations: tuple[Station, ...] = tuple(stations)

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


def at_knee(ground_m: FloatArray) -> FloatArray:
    """(K, 3) places at the height at which rooms are searched for, over ground (K, 3)."""
    knee_m: FloatArray = ground_m + np.array([0.0, 0.0, _KNEE_M])
    return knee_m


def _places_of(survey: Survey, reach: Reach) -> FloorPlaces:
    space = reach.space
    solid = np.array([*(region.in_solid for region in reach.regions), True])
    node = np.flatnonzero(space.on_ground & ~solid[reach.near_region])
    side = max(1, round(_SQUARE_M / space.grid.cell_m))
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
        planned[planned] = survey.scope.surveys(ground_m[planned])
    return FloorPlaces(chosen, ground_m, count * space.cell_m2, floor, reached, planned)


def _nearest_m(ground_m: FloatArray, heads_m: FloatArray) -> float:
    """Distance in plan from places (K, 3) to the nearest of sensors (S, 3) over the same floor; inf: to none."""
    least_m = math.inf
    for head_m in heads_m:
        level = np.abs(head_m[2] - ground_m[:, 2]) <= _OVER_GROUND_M
        away_m = np.linalg.norm(ground_m[level, :2] - head_m[:2], axis=1)
        least_m = min(least_m, float(away_m.min(initial=math.inf)))
    return least_m

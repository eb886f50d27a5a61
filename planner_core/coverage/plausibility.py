"""Plausibility: what every plan is held against before it is written, as a table. docs/method/plausibility.md.

Input a finished `Plan` and the `Reach` that its stations were chosen in (local frame, metres); output lines for the
plan's warnings. Each check measures one quantity, has the range that real buildings and crews keep, and a sentence that
names what was measured, what is plausible, the cause that the figures show, and a remedy. None of them changes a plan.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import ndimage

from planner_core.model import (
    BoolArray,
    FloatArray,
    Floor,
    Int32Array,
    Int64Array,
    NetworkKind,
    Objective,
    Plan,
    Room,
    Scene,
    Station,
)
from planner_core.positions.reach import Reach
from planner_core.positions.rooms import find_rooms
from planner_core.scene.extent import LONGEST_M, UNITS_M, extent_m, likely_unit
from planner_core.scene.ground_planes import SITE_KINDS
from planner_core.scene.level_surfaces import DOORWAY_M, WALL_CUT_M, closed_walls, cut_length
from planner_core.scene.portions import portions
from planner_core.scene.rooms import room_of_points

#: Ground, rooms and stations are told apart by one place of each square of this side: the narrowest rooms have several.
_SQUARE_M = 0.4
#: The room of a place is looked for at this height above the ground: over thresholds, below most furniture.
_KNEE_M = 0.5
#: Smaller plans have more stations per area in any case: each room of a flat takes one or two, see the page.
_SMALL_M2 = 100.0
#: Two set-ups a room, its middle and its door, are practice: where no more are planned, rooms are the cause.
_SETUPS_A_ROOM = 2.0
#: A station that meets the limits on the floor within less scans a part of a room.
_SHORT_M = 5.0
#: Stations that add less than this of their own are there for the network; where this share are, it is the cause.
_LITTLE_M2, _LINKING_SHARE = 1.0, 1 / 3
#: A hall, an open-plan office: from one station one sees most of it.
_HALL_M2 = 100.0
#: Floors lie over each other where they share this part of the smaller one's ground.
_OVER_SHARE = 0.1
#: Rooms of a file that are smaller are shafts and cupboards, which nobody enters with a tripod.
_LEAST_ROOM_M2 = 2.0
#: So many rooms that cannot be entered are no accident of one closed door.
_LEAST_ROOMS = 3
#: Ground of other floors accounts for what is enclosed at a floor's height if it lies below this, above the floor.
_BESIDE_M = 2.0
_CELL_M, _MAX_CELLS = 0.2, 1_000_000
#: Walls around a ledge or dock are nearer; what is further off is another building, or a stray face.
_AROUND_M = 100.0
#: Two set-ups a room, and one more for a corner; with more than that, each has this ground.
_MANY = 4
#: A set-up has some 25 m2 in practice: rooms of twice as much have one, inside or in a door, which is this near.
_LARGE_ROOM_M2, _DOOR_M = 50.0, 1.0
#: A sensor on its tripod is no higher above the ground of its room.
_OVER_GROUND_M = 3.0
#: Names of rooms in a sentence.
_MOST_NAMED = 3


@dataclass(frozen=True)
class Check:
    """One row of the table. low, high : the plausible range of `quantity`, both included; inf: open at that end."""

    quantity: str
    unit: str
    low: float
    high: float
    lines: Callable[[Figures, Check], list[str]]

    def holds(self, figure: float) -> bool:
        """Tell whether a figure is plausible."""
        return self.low <= figure <= self.high

    @property
    def expected(self) -> str:
        """The range in words."""
        if math.isinf(self.high):
            return f"{self.low:g} {self.unit} or more"
        return f"{self.low:g} to {self.high:g} {self.unit}" if self.low > 0 else f"{self.high:g} {self.unit} or less"


def implausible(plan: Plan, reach: Reach) -> tuple[str, ...]:
    """Return lines on what is not as buildings and crews are, in the order of `CHECKS`; none of a usual plan."""
    figures = Figures(plan, reach)
    return tuple(line for check in CHECKS for line in check.lines(figures, check))


# ---------------------------------------------------------------------------------------------- figures
@dataclass(frozen=True)
class Places:
    """Walkable places of the floors, one of each square and region, the insides of solids left out.

    node : (K,) int64 of the free space. ground_m : (K, 3). area_m2 : (K,) of the ground that each stands for.
    floor : (K,) int32. square : (K,) int64, the same for places over each other. reached, planned : (K,) bool, whether
    a crew comes there; and whether it is in scope, on a planned floor, too.
    """

    node: Int64Array
    ground_m: FloatArray
    area_m2: FloatArray
    floor: Int32Array
    square: Int64Array
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


class Figures:
    """What the checks measure, each worked out once."""

    def __init__(self, plan: Plan, reach: Reach) -> None:
        self.plan, self.reach = plan, reach
        self.survey, self.scene, self.floors = plan.survey, plan.survey.scene, plan.survey.floors
        of = {self.floors[index].id for index in self.survey.planned}
        self.stations: tuple[Station, ...] = tuple(each for each in plan.stations if each.floor in of)

    @cached_property
    def places(self) -> Places:
        """Walkable places."""
        space = self.reach.space
        solid = np.array([*(region.in_solid for region in self.reach.regions), True])
        node = np.flatnonzero(space.on_ground & ~solid[self.reach.near_region])
        side = max(1, round(_SQUARE_M / space.grid.cell_m))
        ix, iy = space.column[node] % space.grid.nx // side, space.column[node] // space.grid.nx // side
        square = iy * (space.grid.nx // side + 1) + ix
        key = (square * len(self.floors) + space.floor[node]) * len(self.reach.regions) + self.reach.near_region[node]
        _, first, count = np.unique(key, return_index=True, return_counts=True)
        chosen = node[first]
        ground_m, floor = space.position_m(chosen), space.floor[chosen]
        of_region = np.array([*(region.reached for region in self.reach.regions), False])
        reached = of_region[self.reach.near_region[chosen]]
        planned = reached & np.isin(floor, self.survey.planned)
        if self.survey.scope is not None:
            planned[planned] = self.survey.scope.admits(ground_m[planned])
        return Places(chosen, ground_m, count * space.cell_m2, floor, square[first], reached, planned)

    @cached_property
    def planned_m2(self) -> float:
        """Ground of the planned floors that is in scope and reached, with what is under furniture and walls there."""
        at, total_m2 = self.places, 0.0
        for index in self.survey.planned:
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
            place = room_of_points(scene, _at_knee(at.ground_m))
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
            if area_m2 >= _LEAST_ROOM_M2:
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

    @cached_property
    def headroom_m(self) -> FloatArray:
        """(F,) median height of rooms on each floor, where something is overhead; NaN where nothing is."""
        at, headroom_m = self.places, self.reach.space.headroom_m
        out = np.full(len(self.floors), np.nan)
        for index in range(len(self.floors)):
            here_m = headroom_m[at.node[(at.floor == index) & at.reached]]
            if np.isfinite(here_m).any():
                out[index] = np.median(here_m[np.isfinite(here_m)])
        return out

    def next_above(self, index: int) -> int | None:
        """The next floor over a part of this one; None: it is the topmost there."""
        at = self.places
        own = np.unique(at.square[at.floor == index])
        for other in range(len(self.floors)):
            if self.floors[other].elevation_m > self.floors[index].elevation_m:
                over = np.unique(at.square[at.floor == other])
                shared = np.intersect1d(own, over, assume_unique=True).size
                if shared and shared >= _OVER_SHARE * min(own.size, over.size):
                    return other
        return None


# ------------------------------------------------------------------------------- stations per 1000 m2
def _stations_per_ground(f: Figures, check: Check) -> list[str]:
    n, area_m2 = len(f.stations), f.planned_m2
    if not n or area_m2 < _SMALL_M2 or check.holds(1000 * n / area_m2):
        return []
    measured = (
        f"{_count(n, 'station')} on {area_m2:.0f} m2 of planned ground, {1000 * n / area_m2:.0f} per 1000 m2, "
        f"expected {check.low:g} to {check.high:g}"
    )
    if 1000 * n / area_m2 > check.high:
        return [f"{measured}: {_why_many(f)}"]
    if not _is_met(f) or check.holds(1000 * (n + 1) / area_m2):
        return []  # as many as were allowed or listed; or one more would do
    return [f"{measured}: {_why_few(f, area_m2)}"]


def _why_many(f: Figures) -> str:
    n, rooms = len(f.stations), f.rooms
    if rooms and n <= _SETUPS_A_ROOM * len(rooms):
        mean_m2 = sum(room.area_m2 for room in rooms) / len(rooms)
        return (
            f"{len(rooms)} rooms of {mean_m2:.0f} m2 on average take {n / len(rooms):.1f} each, and practice is up to "
            f"{_SETUPS_A_ROOM:g}; to plan fewer, require less of small rooms (--requirements) or a lower --coverage"
        )
    return _why_close(f, f.stations)


def _why_close(f: Figures, stations: Sequence[Station]) -> str:
    """Why stations are closer than in practice, and the remedy: requirements first, then what hides surfaces."""
    asked = f.plan.settings.requirements
    if asked.seen_from > 1:
        return f"each surface is required from {asked.seen_from} stations; check whether one is enough (--seen-from)"
    limit, within_m = _shortest(f)
    if within_m < _SHORT_M:
        return (
            f"the required {limit} holds on the floor within {within_m:.1f} m of a station; check whether the contract "
            "requires it of all surfaces, or state it for parts (--requirements)"
        )
    linking = sum(station.own_area_m2 < _LITTLE_M2 for station in stations)
    if asked.network != NetworkKind.NONE and linking >= _LINKING_SHARE * len(stations):
        redundant = " twice" if asked.network == NetworkKind.REDUNDANT else ""
        return (
            f"{linking} of them add less than {_LITTLE_M2:g} m2 each and connect the others{redundant}, at an overlap "
            f"of {100 * asked.overlap:g} % at least; check what the registration needs (--overlap)"
        )
    return (
        "no limit explains them, so furniture, niches or what hangs from ceilings hides much; leave out what the site "
        "does not have (--leave-out), or require a lower --coverage"
    )


def _shortest(f: Figures) -> tuple[str, float]:
    """The limit of all surfaces that holds on the floor over the shortest distance in plan from a station, metres."""
    asked, template = f.plan.settings.requirements.asked, f.survey.template
    height_m = float(np.nanmedian([station.instrument_height_m for station in f.stations]))
    found = [("scanner's range", template.range_max_m)]
    if asked.range_m is not None:
        found.append((f"range of {asked.range_m:g} m", math.sqrt(max(asked.range_m**2 - height_m**2, 0.0))))
    if asked.incidence_rad is not None:
        angle = min(asked.incidence_rad, math.radians(89.9))
        found.append((f"incidence of {math.degrees(asked.incidence_rad):.0f}°", height_m * math.tan(angle)))
    if asked.spacing_m is not None and template.elevation_rad.size > 1:
        step_rad = float(np.ptp(template.elevation_rad)) / (template.elevation_rad.size - 1)
        # Rows on the floor are r^2 step / h apart, see docs/method/deliverables.md.
        found.append(
            (f"spacing of {1000 * asked.spacing_m:g} mm", math.sqrt(height_m * asked.spacing_m / max(step_rad, 1e-9)))
        )
    return min(found, key=lambda limit: limit[1])


def _why_few(f: Figures, area_m2: float) -> str:
    asked, rooms = f.plan.settings.requirements, f.rooms
    if asked.coverage < 0.8:
        return f"only {100 * asked.coverage:g} % are required; state the --coverage that the contract needs"
    if rooms and area_m2 / len(rooms) >= _HALL_M2:
        return (
            f"rooms measure {area_m2 / len(rooms):.0f} m2 on average and the scanner reaches "
            f"{f.survey.template.range_max_m:g} m; where drawings need points as dense and steep, state a --deliverable"
        )
    return (
        f"each scans several of {_count(len(rooms), 'room')}; check whether walls or doors are missing in the model, "
        "and whether --glass lets beams pass"
    )


# ------------------------------------------------------------------------------------ storeys per height
def _floor_to_floor(f: Figures, check: Check) -> list[str]:
    lines = []
    for index in f.survey.planned:
        floor, above = f.floors[index], f.next_above(index)
        if above is None:
            continue
        rise_m = f.floors[above].elevation_m - floor.elevation_m
        if not check.holds(rise_m):
            lines.append(
                f"floors {floor.name!r} and {f.floors[above].name!r} lie {rise_m:.2f} m over each other, expected "
                f"{check.expected}: one of them is furniture, a plenum or a second slab; unmark what is no floor "
                "(docs/howto/pick-ground.md)"
            )
    return lines


def _height_without_floor(f: Figures, check: Check) -> list[str]:
    lines = []
    for index in f.survey.planned:
        floor, room_m, above = f.floors[index], float(f.headroom_m[index]), f.next_above(index)
        if above is not None:
            rise_m, most_m = f.floors[above].elevation_m - floor.elevation_m, check.high
            to = f"floor {f.floors[above].name!r} follows"
        else:
            rise_m = _top_m(f.scene, floor) - floor.elevation_m
            to, most_m = "the building ends", max(2.0 * check.high, 1.5 * room_m)  # attics, and roofs of vaulted halls
        if rise_m - room_m > most_m:  # not where nothing is overhead: room_m is NaN
            lines.append(
                f"rooms of floor {floor.name!r} are {room_m:.1f} m high and {to} {rise_m:.1f} m above, with no floor "
                f"in between, expected {most_m:.1f} m at most above the rooms: a storey was not found; see the "
                "warnings of floors, load the file with its slabs, or mark its ground (docs/howto/pick-ground.md)"
            )
    return lines


def _top_m(scene: Scene, floor: Floor) -> float:
    """Height under which nearly all surface over a floor lies: chimneys and masts are not storeys."""
    low_m, high_m = floor.bounds_m
    found, weight = [np.array([floor.elevation_m])], [np.zeros(1)]
    for some in portions(scene.n_triangles):
        corners_m = scene.vertices_m[scene.triangles[some]]
        middle_m = corners_m.mean(axis=1)
        over = ((middle_m[:, :2] >= low_m) & (middle_m[:, :2] <= high_m)).all(axis=1)
        over &= middle_m[:, 2] > floor.elevation_m
        a, b = corners_m[over, 1] - corners_m[over, 0], corners_m[over, 2] - corners_m[over, 0]
        found.append(corners_m[over, :, 2].max(axis=1))
        weight.append(np.linalg.norm(np.cross(a, b), axis=1))
    z_m, area = np.concatenate(found), np.concatenate(weight)
    order = np.argsort(z_m, kind="stable")
    share = np.cumsum(area[order]) / max(float(area.sum()), 1e-12)
    return float(z_m[order][min(int(np.searchsorted(share, 0.98)), order.size - 1)])


# ----------------------------------------------------------------------------------------- rooms entered
def _rooms_entered(f: Figures, check: Check) -> list[str]:
    """Rooms that the file names; those of a mesh are in the line of each area that cannot be reached."""
    rooms, at = f.scene.rooms, f.places
    if not rooms:
        return []
    place = room_of_points(f.scene, _at_knee(at.ground_m))
    entered = np.isin(np.arange(len(rooms)), place[at.reached])
    sealed = np.isin(np.arange(len(rooms)), place[~at.reached]) & ~entered
    starts_m = np.array([f.floors[index].elevation_m for index in range(len(f.floors))])
    foot_m = np.array([room.box_m[0, 2] for room in rooms])
    near = np.abs(foot_m[:, None] - starts_m).argmin(axis=1)
    counted = np.isin(near, f.survey.planned) & (np.array([_plan_m2(room) for room in rooms]) >= _LEAST_ROOM_M2)
    n, n_out = int(counted.sum()), int((counted & ~entered).sum())
    if n_out < _LEAST_ROOMS or check.holds(100.0 * (n - n_out) / n):
        return []
    off = np.abs(foot_m - starts_m[near]) > WALL_CUT_M
    causes = [
        (counted & sealed, "no door leads to {}", "check doors, or give an entrance (--entrance)"),
        (counted & ~entered & ~sealed & off, "no floor was found at {}", "load the file with the slabs"),
        (
            counted & ~entered & ~sealed & ~off,
            "no room for a tripod is in {}",
            "check their slabs, heights and furniture",
        ),
    ]
    words = [
        (phrase.format(_rooms_named([rooms[k].title for k in np.flatnonzero(which).tolist()])), remedy)
        for which, phrase, remedy in causes
        if which.any()
    ]
    return [
        f"{n - n_out} of {n} rooms of the file can be entered, {100 * (n - n_out) / n:.0f} %, expected "
        f"{check.expected}: {', '.join(phrase for phrase, _ in words)}; {'; '.join(remedy for _, remedy in words)}"
    ]


def _plan_m2(room: Room) -> float:
    """Area of a room seen from above: half of its closed surface's, whatever its windings."""
    a, b, c = (room.vertices_m[room.triangles[:, corner], :2] for corner in range(3))
    ab, ac = b - a, c - a
    return float(0.25 * np.abs(ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]).sum())


# ------------------------------------------------------------------------------------ ground and footprint
def _ground_of_footprint(f: Figures, check: Check) -> list[str]:
    lines = []
    for index in f.survey.planned:
        floor = f.floors[index]
        enclosed_m2 = _enclosed_m2(f, index)
        if enclosed_m2 < _SMALL_M2:
            continue
        ground_m2 = floor.ground_area_m2 + _beside_m2(f, index)
        if check.holds(100 * ground_m2 / enclosed_m2):
            continue
        lines.append(
            f"ground of floor {floor.name!r} is {floor.ground_area_m2:.0f} m2, and {enclosed_m2:.0f} m2 lie between "
            f"the walls at its height, {100 * ground_m2 / enclosed_m2:.0f} %, expected {check.expected}: a dock or a "
            "ledge was taken for the floor, or slabs are in another file; load that too, or mark the ground "
            "(docs/howto/pick-ground.md)"
        )
    return lines


def _beside_m2(f: Figures, index: int) -> float:
    """Ground of other floors under what is open at a floor's height: the hall below a gallery, the other wing."""
    at, height_m = f.places, f.floors[index].elevation_m
    ground_m, headroom_m = at.ground_m[:, 2], f.reach.space.headroom_m[at.node]
    over = (ground_m < height_m + _BESIDE_M) & (ground_m + headroom_m > height_m + WALL_CUT_M)
    return float(at.area_m2[(at.floor != index) & over].sum())


def _enclosed_m2(f: Figures, index: int) -> float:
    """Area between the walls around a floor's ground at the height of a cut, openings of a door's width bridged."""
    scene, at = f.scene, f.places
    own_m = at.ground_m[at.floor == index][:, :2]
    segments_m = _walls_at(scene, f.floors[index].elevation_m + WALL_CUT_M)
    low_m, high_m = f.floors[index].bounds_m + np.array([[-_AROUND_M], [_AROUND_M]])
    middle_m = segments_m.mean(axis=1)
    segments_m = segments_m[((middle_m >= low_m) & (middle_m <= high_m)).all(axis=1)]
    if not len(own_m) or not len(segments_m):
        return 0.0
    ends_m = segments_m.reshape(-1, 2)
    low_m, high_m = ends_m.min(axis=0) - 2 * DOORWAY_M, ends_m.max(axis=0) + 2 * DOORWAY_M
    cell_m = max(_CELL_M, math.sqrt(float(np.prod(high_m - low_m)) / _MAX_CELLS))
    n_x, n_y = (np.floor((high_m - low_m) / cell_m).astype(np.int64) + 1).tolist()
    closed = closed_walls(segments_m, low_m, cell_m, (n_x, n_y))
    label, _ = ndimage.label(ndimage.binary_fill_holes(closed))
    at_own = ((own_m - low_m) / cell_m).astype(np.int64)
    inside = ((at_own >= 0) & (at_own < (n_x, n_y))).all(axis=1)
    around = np.unique(label[tuple(at_own[inside].T)])
    return float(np.isin(label, around[around > 0]).sum()) * cell_m * cell_m


def _walls_at(scene: Scene, height_m: float) -> FloatArray:
    """(M, 2, 2) cut of the building with a level plane, in plan; terrain is none."""
    site = np.array([element.kind in SITE_KINDS for element in scene.elements], dtype=np.bool_)
    found = [np.empty((0, 2, 2))]
    for some in portions(scene.n_triangles):
        z_m = scene.vertices_m[:, 2][scene.triangles[some]] - height_m
        cut = (z_m.min(axis=1) < 0) & (z_m.max(axis=1) >= 0) & ~site[scene.element_of_triangle[some]]
        found.append(cut_length(scene.vertices_m[scene.triangles[some][cut]], height_m)[1])
    return np.concatenate(found)


# ------------------------------------------------------------------------------------------------- extent
def _extent(f: Figures, check: Check) -> list[str]:
    """Size of the floors in plan; scenes that loading has doubted by their unit are not doubted twice."""
    source = f.scene.source
    bounds_m = np.stack([f.floors[index].bounds_m for index in f.survey.planned])
    longest_m = float((bounds_m[:, 1].max(axis=0) - bounds_m[:, 0].min(axis=0)).max())
    is_doubted = float(extent_m(f.scene).max()) > LONGEST_M or source.told_metres_per_unit is not None
    if is_doubted or check.holds(longest_m):
        return []
    unit = likely_unit(longest_m, source.metres_per_unit)
    remedy = "check what it holds"
    if unit is not None and UNITS_M[unit] != source.metres_per_unit:
        length_m = longest_m / source.metres_per_unit * UNITS_M[unit]
        remedy = f"if so, pass its unit, such as --units {unit}, in which they are {length_m:.3g} m long"
    return [
        f"the planned floors are {longest_m:.3g} m long, expected {check.expected}: {source.path.name or 'the scene'} "
        f"was read in units of {source.metres_per_unit:g} m, which may be wrong; {remedy}"
    ]


# -------------------------------------------------------------------------------------- stations per room
def _ground_per_station(f: Figures, check: Check) -> list[str]:
    """Rooms crowded with stations, and large ones without any."""
    many = [room for room in f.rooms if len(room.stations) >= _MANY]
    crowded = [room for room in many if not check.holds(room.area_m2 / len(room.stations))]
    lines = [
        f"room {room.name} of {room.area_m2:.0f} m2 has {len(room.stations)} stations, one per "
        f"{room.area_m2 / len(room.stations):.1f} m2, expected {check.expected}: {_why_close(f, room.stations)}"
        for room in sorted(crowded, key=lambda room: room.area_m2 / len(room.stations))[:_MOST_NAMED]
    ]
    bare = [room for room in f.rooms if room.away_m > _DOOR_M and room.area_m2 >= _LARGE_ROOM_M2]
    if f.stations and bare and _is_met(f):
        words = ", ".join(f"{room.name} ({room.area_m2:.0f} m2)" for room in bare[:_MOST_NAMED])
        more = f" and {len(bare) - _MOST_NAMED} more" if len(bare) > _MOST_NAMED else ""
        lines.append(
            f"no station stands in room {words}{more}, expected one in each of {_LARGE_ROOM_M2:g} m2 or more: what is "
            "covered there is scanned through doors, glass or missing walls; check these in the model (--glass), or "
            "require the coverage of these rooms by zone (--requirements)"
        )
    return lines


def _is_met(f: Figures) -> bool:
    """Whether the plan covers what is required, and not just what so many stations can."""
    asked, settings = f.plan.settings.requirements, f.plan.settings
    return settings.objective != Objective.COVERAGE and f.plan.coverage.meets(asked.coverage)


def _at_knee(ground_m: FloatArray) -> FloatArray:
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


# --------------------------------------------------------------------------------------------------- words
def _count(n: int, noun: str) -> str:
    return f"{n} {noun}{'' if n == 1 else 's'}"


def _rooms_named(titles: Sequence[str]) -> str:
    names = ", ".join(repr(title) for title in titles[:_MOST_NAMED])
    return f"{len(titles)} ({names}{' ...' if len(titles) > _MOST_NAMED else ''})"


#: What every plan is held against, in the order of its warnings; docs/method/plausibility.md has the ranges' sources.
CHECKS = (
    Check("stations per 1000 m2 of planned ground", "stations", 10.0, 70.0, _stations_per_ground),
    Check("height from floor to floor", "m", 2.0, math.inf, _floor_to_floor),
    Check("height above the rooms without a floor", "m", 0.0, 3.0, _height_without_floor),
    Check("rooms of the file that can be entered", "%", 67.0, 100.0, _rooms_entered),
    Check("ground of a floor between the walls at its height", "%", 33.0, math.inf, _ground_of_footprint),
    Check("length of the planned floors", "m", 3.0, 400.0, _extent),
    Check("ground per station of a room", "m2", 4.0, math.inf, _ground_per_station),
)

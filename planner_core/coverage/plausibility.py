"""Plausibility: what every plan is held against before it is written, as a table. docs/method/plausibility.md.

Input a finished `Plan` and the `Reach` that its stations were chosen in (local frame, metres); output lines for the
plan's warnings. Each check measures one quantity, has the range that real buildings and crews keep, and a sentence that
names what was measured, what is plausible, the cause that the figures show, and a remedy. None of them changes a plan.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from planner_core.coverage.percent import link_limits_words
from planner_core.coverage.plausibility_figures import LEAST_ROOM_M2, FloorFigures, PlanFigures, at_knee
from planner_core.model import Floor, NetworkKind, Objective, Plan, Room, Scene, Station
from planner_core.positions.reach import Reach
from planner_core.scene.extent import LONGEST_M, UNITS_M, extent_m, likely_unit
from planner_core.scene.ground_planes import with_ground_planes
from planner_core.scene.level_surfaces import WALL_CUT_M
from planner_core.scene.rooms import room_of_points

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
#: So many rooms that cannot be entered are no accident of one closed door.
_LEAST_ROOMS = 3
#: Two set-ups a room, and one more for a corner; with more than that, each has this ground.
_MANY = 4
#: A set-up has some 25 m2 in practice: rooms of twice as much have one, inside or in a door, which is this near.
_LARGE_ROOM_M2, _DOOR_M = 50.0, 1.0
#: Names of rooms in a sentence.
_MOST_NAMED = 3


_F = TypeVar("_F", bound=FloorFigures, contravariant=True)


@dataclass(frozen=True)
class Range:
    """What is plausible. low, high : the range of `quantity`, both included; inf: open at that end."""

    quantity: str
    unit: str
    low: float
    high: float

    def holds(self, figure: float) -> bool:
        """Tell whether a figure is plausible."""
        return self.low <= figure <= self.high

    def written(self, figure: float, decimals: int = 0) -> str:
        """Return a figure as text, rounded; one that is outside the range never reads as if it were within."""
        rounded = round(figure, decimals)
        if self.holds(rounded) and not self.holds(figure):
            rounded += math.copysign(10.0**-decimals, figure - rounded)
        return f"{rounded:.{decimals}f}"

    @property
    def expected(self) -> str:
        """The range in words."""
        if math.isinf(self.high):
            return f"{self.low:g} {self.unit} or more"
        return f"{self.low:g} to {self.high:g} {self.unit}" if self.low > 0 else f"{self.high:g} {self.unit} or less"


@dataclass(frozen=True)
class Check(Range, Generic[_F]):
    """One row of the table. lines : of figures that are outside the range."""

    lines: Callable[[_F, Range], list[str]]


def implausible(plan: Plan, reach: Reach) -> tuple[str, ...]:
    """Return lines on what is not as buildings and crews are, in the order of `CHECKS`; none of a usual plan."""
    figures = PlanFigures(plan, reach)
    return tuple(line for check in CHECKS for line in check.lines(figures, check))


def implausible_floors(scene: Scene, floors: tuple[Floor, ...]) -> tuple[str, ...]:
    """Return the lines of `FLOOR_CHECKS` on floors that were found in a scene, before anything is planned."""
    if not floors:
        return ()
    scene, floors = with_ground_planes(scene, floors)
    figures = FloorFigures(scene, floors, range(len(floors)))
    return tuple(line for check in FLOOR_CHECKS for line in check.lines(figures, check))


# ------------------------------------------------------------------------------- stations per 1000 m2
def _stations_per_ground(f: PlanFigures, check: Range) -> list[str]:
    n, area_m2 = len(f.stations), f.planned_m2
    if not n or area_m2 < _SMALL_M2 or check.holds(1000 * n / area_m2):
        return []
    measured = (
        f"{_count(n, 'station')} on {area_m2:.0f} m2 of planned ground, {check.written(1000 * n / area_m2)} per "
        f"1000 m2, expected {check.low:g} to {check.high:g}"
    )
    if 1000 * n / area_m2 > check.high:
        return [f"{measured}: {_why_many(f)}"]
    if not _is_met(f) or check.holds(1000 * (n + 1) / area_m2):
        return []  # as many as were allowed or listed; or one more would do
    return [f"{measured}: {_why_few(f, area_m2)}"]


def _why_many(f: PlanFigures) -> str:
    n, rooms = len(f.stations), f.rooms
    if rooms and n <= _SETUPS_A_ROOM * len(rooms):
        mean_m2 = sum(room.area_m2 for room in rooms) / len(rooms)
        return (
            f"{len(rooms)} rooms of {mean_m2:.0f} m2 on average take {n / len(rooms):.1f} each, and practice is up to "
            f"{_SETUPS_A_ROOM:g}; to plan fewer, require less of small rooms (--requirements) or a lower --coverage"
        )
    return _why_close(f, f.stations)


def _why_close(f: PlanFigures, stations: Sequence[Station]) -> str:
    """Why stations are closer than in practice, and the remedy: requirements first, then what hides surfaces."""
    requirements = f.plan.settings.requirements
    if requirements.seen_from > 1:
        n_required = requirements.seen_from
        return f"each surface is required from {n_required} stations; check whether one is enough (--seen-from)"
    limit, within_m = _shortest(f)
    if within_m < _SHORT_M:
        return (
            f"the required {limit} holds on the floor within {within_m:.1f} m of a station; check whether the contract "
            "requires it of all surfaces, or state it for parts (--requirements)"
        )
    linking = sum(station.own_area_m2 < _LITTLE_M2 for station in stations)
    if requirements.network != NetworkKind.NONE and linking >= _LINKING_SHARE * len(stations):
        redundant = " twice" if requirements.network == NetworkKind.REDUNDANT else ""
        return (
            f"{linking} of them add less than {_LITTLE_M2:g} m2 each and connect the others{redundant}, by links of "
            f"{link_limits_words(requirements.link_limits)}; check what the registration needs "
            f"({'--overlap' if requirements.overlap else '--pre-alignment'})"
        )
    return (
        "no limit explains them, so furniture, niches or what hangs from ceilings hides much; leave out what the site "
        "does not have (--leave-out), or require a lower --coverage"
    )


def _shortest(f: PlanFigures) -> tuple[str, float]:
    """The limit of all surfaces that holds on the floor over the shortest distance in plan from a station, metres."""
    limits, template = f.plan.settings.requirements.limits, f.survey.template
    height_m = float(np.nanmedian([station.instrument_height_m for station in f.stations]))
    found = [("scanner's range", template.range_max_m)]
    if limits.range_m is not None:
        found.append((f"range of {limits.range_m:g} m", math.sqrt(max(limits.range_m**2 - height_m**2, 0.0))))
    if limits.incidence_rad is not None:
        angle = min(limits.incidence_rad, math.radians(89.9))
        found.append((f"incidence of {math.degrees(limits.incidence_rad):.0f}°", height_m * math.tan(angle)))
    if limits.spacing_m is not None and template.elevation_rad.size > 1:
        step_rad = float(np.ptp(template.elevation_rad)) / (template.elevation_rad.size - 1)
        # Rows on the floor are r^2 step / h apart, see docs/method/deliverables.md.
        found.append(
            (f"spacing of {1000 * limits.spacing_m:g} mm", math.sqrt(height_m * limits.spacing_m / max(step_rad, 1e-9)))
        )
    return min(found, key=lambda limit: limit[1])


def _why_few(f: PlanFigures, area_m2: float) -> str:
    requirements, rooms = f.plan.settings.requirements, f.rooms
    if requirements.coverage < 0.8:
        return f"only {100 * requirements.coverage:g} % are required; state the --coverage that the contract needs"
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
def _floor_to_floor(f: FloorFigures, check: Range) -> list[str]:
    lines = []
    for index in f.planned:
        floor, above = f.floors[index], f.next_above(index)
        if above is None:
            continue
        over, rise_m = above
        if not check.holds(rise_m):
            lines.append(
                f"floors {floor.name!r} and {f.floors[over].name!r} lie {check.written(rise_m, 2)} m over each other, "
                f"expected {check.expected}: one of them is furniture, a plenum or a second slab; unmark what is no "
                "floor (docs/howto/pick-ground.md)"
            )
    return lines


def _height_without_floor(f: FloorFigures, check: Range) -> list[str]:
    lines = []
    for index in f.planned:
        floor, room_m, above = f.floors[index], f.room_height_m(index), f.next_above(index)
        if above is not None:
            (over, rise_m), most_m = above, check.high
            to = f"floor {f.floors[over].name!r} follows"
        else:
            rise_m = f.height_to_top_m(index)
            to, most_m = "the building ends", max(2.0 * check.high, 1.5 * room_m)  # attics, and roofs of vaulted halls
        if rise_m - room_m > most_m:  # not where nothing is overhead: room_m is NaN
            lines.append(
                f"rooms of floor {floor.name!r} are {room_m:.1f} m high and {to} {rise_m:.1f} m above, with no floor "
                f"in between, expected {most_m:.1f} m at most above the rooms: a storey was not found; see the "
                "warnings of floors, load the file with its slabs, or mark its ground (docs/howto/pick-ground.md)"
            )
    return lines


# ----------------------------------------------------------------------------------------- rooms entered
def _rooms_entered(f: PlanFigures, check: Range) -> list[str]:
    """Rooms that the file names; those of a mesh are in the line of each area that cannot be reached."""
    rooms, at = f.scene.rooms, f.places
    if not rooms:
        return []
    place = room_of_points(f.scene, at_knee(at.ground_m))
    entered = np.isin(np.arange(len(rooms)), place[at.reached])
    unreachable = np.isin(np.arange(len(rooms)), place[~at.reached]) & ~entered
    starts_m = np.array([f.floors[index].elevation_m for index in range(len(f.floors))])
    foot_m = np.array([room.box_m[0, 2] for room in rooms])
    near = np.abs(foot_m[:, None] - starts_m).argmin(axis=1)
    counted = np.isin(near, f.planned) & (np.array([_plan_m2(room) for room in rooms]) >= LEAST_ROOM_M2)
    n, n_out = int(counted.sum()), int((counted & ~entered).sum())
    if n_out < _LEAST_ROOMS or check.holds(100.0 * (n - n_out) / n):
        return []
    off = np.abs(foot_m - starts_m[near]) > WALL_CUT_M
    causes = [
        (counted & unreachable, "no door leads to {}", "check doors, or give an entrance (--entrance)"),
        (counted & ~entered & ~unreachable & off, "no floor was found at {}", "load the file with the slabs"),
        (
            counted & ~entered & ~unreachable & ~off,
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
        f"{n - n_out} of {n} rooms of the file can be entered, {check.written(100 * (n - n_out) / n)} %, expected "
        f"{check.expected}: {', '.join(phrase for phrase, _ in words)}; {'; '.join(remedy for _, remedy in words)}"
    ]


def _plan_m2(room: Room) -> float:
    """Area of a room seen from above: half of its closed surface's, whatever its windings."""
    a, b, c = (room.vertices_m[room.triangles[:, corner], :2] for corner in range(3))
    ab, ac = b - a, c - a
    return float(0.25 * np.abs(ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]).sum())


# ------------------------------------------------------------------------------------ ground and footprint
def _ground_of_footprint(f: FloorFigures, check: Range) -> list[str]:
    lines = []
    for index in f.planned:
        floor = f.floors[index]
        enclosed_m2 = f.enclosed_m2(index)
        if enclosed_m2 < _SMALL_M2:
            continue
        ground_m2 = floor.ground_area_m2 + f.beside_m2(index)
        if check.holds(100 * ground_m2 / enclosed_m2):
            continue
        lines.append(
            f"ground of floor {floor.name!r} is {floor.ground_area_m2:.0f} m2, and {enclosed_m2:.0f} m2 lie between "
            f"the walls at its height, {check.written(100 * ground_m2 / enclosed_m2)} %, expected {check.expected}: a "
            "dock or a ledge was taken for the floor, or slabs are in another file; load that too, or mark the ground "
            "(docs/howto/pick-ground.md)"
        )
    return lines


# ------------------------------------------------------------------------------------------------- extent
def _extent(f: FloorFigures, check: Range) -> list[str]:
    """Size of the floors in plan; scenes that loading has doubted by their unit are not doubted twice."""
    source = f.scene.source
    bounds_m = np.stack([f.floors[index].bounds_m for index in f.planned])
    longest_m = float((bounds_m[:, 1].max(axis=0) - bounds_m[:, 0].min(axis=0)).max())
    is_doubted = float(extent_m(f.scene).max()) > LONGEST_M or source.given_metres_per_unit is not None
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
def _ground_per_station(f: PlanFigures, check: Range) -> list[str]:
    """Rooms crowded with stations, and large ones without any."""
    many = [room for room in f.rooms if len(room.stations) >= _MANY]
    crowded = [room for room in many if not check.holds(room.area_m2 / len(room.stations))]
    lines = [
        f"room {room.name} of {room.area_m2:.0f} m2 has {len(room.stations)} stations, one per "
        f"{check.written(room.area_m2 / len(room.stations), 1)} m2, expected {check.expected}: "
        f"{_why_close(f, room.stations)}"
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


def _is_met(f: PlanFigures) -> bool:
    """Whether the plan covers what is required, and not just what so many stations can."""
    requirements, settings = f.plan.settings.requirements, f.plan.settings
    return settings.objective != Objective.COVERAGE and f.plan.coverage.meets(requirements.coverage)


# --------------------------------------------------------------------------------------------------- words
def _count(n: int, noun: str) -> str:
    return f"{n} {noun}{'' if n == 1 else 's'}"


def _rooms_named(titles: Sequence[str]) -> str:
    names = ", ".join(repr(title) for title in titles[:_MOST_NAMED])
    return f"{len(titles)} ({names}{' ...' if len(titles) > _MOST_NAMED else ''})"


#: What floors are held against as soon as they are found.
FLOOR_CHECKS: tuple[Check[FloorFigures], ...] = (
    Check("height from floor to floor", "m", 2.0, math.inf, _floor_to_floor),
    Check("height above the rooms without a floor", "m", 0.0, 3.0, _height_without_floor),
    Check("ground of a floor between the walls at its height", "%", 33.0, math.inf, _ground_of_footprint),
    Check("length of the planned floors", "m", 3.0, 400.0, _extent),
)
#: What every plan is held against, in the order of its warnings; docs/method/plausibility.md has the ranges' sources.
CHECKS: tuple[Check[PlanFigures], ...] = (
    Check("stations per 1000 m2 of planned ground", "stations", 10.0, 70.0, _stations_per_ground),
    *FLOOR_CHECKS[:2],
    Check("rooms of the file that can be entered", "%", 67.0, 100.0, _rooms_entered),
    *FLOOR_CHECKS[2:],
    Check("ground per station of a room", "m2", 4.0, math.inf, _ground_per_station),
)

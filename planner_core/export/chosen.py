"""Which floors, stations and ways a format writes, and what people read about each of them."""

from __future__ import annotations

import math
from collections.abc import Container
from dataclasses import dataclass

import numpy as np

from planner_core.errors import ExportError, RequirementError
from planner_core.export.options import Options
from planner_core.model import FloatArray
from planner_core.plan_folder.plan_model.results import FloorSection
from planner_core.plan_folder.plan_source import FieldStation, PlanSource

#: Stations that a message names; of more it gives the number.
_MAX_NAMED = 5


def chosen_floors(plan: PlanSource, options: Options) -> tuple[FloorSection, ...]:
    """Return the floors that `options.floors` names by id or name, upper and lower case alike; all where it is empty.

    Raises
    ------
    RequirementError
        One is not there.
    """
    wanted = {name.casefold() for name in options.floors}
    for name in options.floors:
        if not any(name.casefold() in (floor.id.casefold(), floor.name.casefold()) for floor in plan.floors):
            there = ", ".join(f"{floor.id} ({floor.name})" for floor in plan.floors)
            raise RequirementError(f"floor: got {name!r}, expected one of {there}; see plan.json")
    return tuple(floor for floor in plan.floors if not wanted or wanted & {floor.id.casefold(), floor.name.casefold()})


def chosen_stations(plan: PlanSource, options: Options) -> tuple[FieldStation, ...]:
    """Return the stations of these floors, in visiting order; those of no known floor only where all are wanted."""
    ids = {floor.id for floor in chosen_floors(plan, options)}
    return tuple(station for station in plan.stations if not options.floors or station.floor_id in ids)


@dataclass(frozen=True)
class FloorStations:
    """Stations of one floor, in visiting order. id, name : empty for those of a floor that the plan does not have."""

    id: str
    name: str
    stations: tuple[FieldStation, ...]


def stations_by_floor(plan: PlanSource, options: Options) -> tuple[FloorStations, ...]:
    """Return the chosen stations floor by floor, lowest first, floors without stations left out; raises as above."""
    chosen = chosen_stations(plan, options)
    floors = [(floor.id, floor.name) for floor in chosen_floors(plan, options)]
    known = {floor_id for floor_id, _ in floors}
    groups = [
        FloorStations(floor_id, name, tuple(each for each in chosen if each.floor_id == floor_id))
        for floor_id, name in floors
    ]
    groups.append(FloorStations("", "", tuple(each for each in chosen if each.floor_id not in known)))
    return tuple(group for group in groups if group.stations)


def has_ground(station: FieldStation) -> bool:
    """Whether its ground point is known: a given station may have no instrument height."""
    return math.isfinite(station.instrument_height_m)


def without_ground_remark(stations: tuple[FieldStation, ...], then: str) -> tuple[str, ...]:
    """Name the stations without a ground point, and say what comes of it."""
    unknown = [station.id for station in stations if not has_ground(station)]
    return (f"the instrument height of {named(unknown)} is not known: {then}",) if unknown else ()


def require_ground(stations: tuple[FieldStation, ...], what: str) -> None:
    """Refuse stations whose ground point is not known: given ones without an instrument height.

    Raises
    ------
    ExportError
        Naming them.
    """
    unknown = [station.id for station in stations if not has_ground(station)]
    if unknown:
        raise ExportError(
            f"{what}: the instrument height of {named(unknown)} is not known, expected one for the ground point; give "
            "it in the station list, or export sensor heights with --instrument sensor"
        )


def stakeout_point(plan: PlanSource, station: FieldStation, options: Options) -> FloatArray:
    """(3,) float64 E, N, H as `to_output_coordinates`: of the point that is set out, ground or sensor."""
    return to_output_coordinates(
        plan, station.site_m if options.instrument == "sensor" else station.site_ground_m, options
    )


def to_output_coordinates(plan: PlanSource, site_m: FloatArray, options: Options) -> FloatArray:
    """(3,) float64 of the site frame, metres -> in the unit of the plan's frame, less `options.subtract`."""
    return np.asarray(plan.frame.in_unit(site_m) - np.array(options.subtract, dtype=np.float64))


def subtracted_remark(plan: PlanSource, options: Options) -> tuple[str, ...]:
    """Say that coordinates are not the site's own, where they are not."""
    if not any(options.subtract):
        return ()
    east, north, height = options.subtract
    unit = plan.frame.unit.symbol
    return (
        f"{east:.4f} {unit} is subtracted from eastings, {north:.4f} {unit} from northings, {height:.4f} {unit} from "
        "heights",
    )


def coordinates_line(plan: PlanSource, options: Options) -> str:
    """What a file states of its coordinates: `SiteFrame.crs_line`, and what is taken off them."""
    less = ", ".join(f"{value:.4f}" for value in options.subtract)
    taken_off = f"; less E, N, H {less} {plan.frame.unit.symbol}" if any(options.subtract) else ""
    return f"{plan.frame.crs_line}{taken_off}"


def description_of(plan: PlanSource, station: FieldStation) -> str:
    """`S001 Ground floor h 1.50`, in feet `h 4.92 ft`; marked where scanned before."""
    unit, height = plan.frame.unit, ""
    if math.isfinite(station.instrument_height_m):
        height = f" h {unit.of(station.instrument_height_m):.2f}{' ft' if unit.is_feet else ''}"
    return f"{station.id} {station.floor_name}{height}{' scanned' if station.id in plan.scanned_before else ''}"


def named(names: list[str]) -> str:
    """Join names for a message: the first few, and how many more there are."""
    more = f" and {len(names) - _MAX_NAMED} more" if len(names) > _MAX_NAMED else ""
    return ", ".join(names[:_MAX_NAMED]) + more


# -------------------------------------------------------------------------------------------------- the route
@dataclass(frozen=True, eq=False)
class RouteLeg:
    """A leg of the walk. from_id, to_id : stations; empty for where the walk begins and ends.

    points_m : (M, 3) float64, its corners; M is 0 where no way inside the model leads there. length_m : NaN there.
    floors : ids of those it passes, in their order.
    """

    from_id: str
    to_id: str
    points_m: FloatArray
    length_m: float
    floors: tuple[str, ...]

    @property
    def walkable(self) -> bool:
        """Whether there is a way."""
        return bool(self.points_m.shape[0] >= 2)

    @property
    def title(self) -> str:
        """`S001 to S002`."""
        return f"{self.from_id or 'start'} to {self.to_id or 'end'}"


def ways_of(plan: PlanSource) -> tuple[RouteLeg, ...]:
    """Return the legs of the route in their order; none where no route was planned."""
    route = plan.document["route"]
    if route is None:
        return ()
    return tuple(
        RouteLeg(
            from_id=leg["from"] or "",
            to_id=leg["to"] or "",
            points_m=np.array(leg["points"], dtype=np.float64).reshape(-1, 3),
            length_m=math.nan if leg["length_m"] is None else leg["length_m"],
            floors=tuple(leg["floors"]),
        )
        for leg in route["legs"]
    )


def route_remarks(ways: tuple[RouteLeg, ...]) -> tuple[str, ...]:
    """Say what of the walk is missing, a line each."""
    if not ways:
        return ("the plan has no route, so none is written",)
    broken = [way.title for way in ways if not way.walkable]
    return (f"no path inside the model leads from {', '.join(broken)}",) if broken else ()


def ways_to(ways: tuple[RouteLeg, ...], stations: Container[str]) -> list[RouteLeg]:
    """Legs that there is a way along, and that lead from or to one of some stations."""
    return [way for way in ways if way.walkable and (way.from_id in stations or way.to_id in stations)]

"""The site in the building's own terms: a `Site` (scene frame, floors by name) as carrier, zones, entrances and ends.

Input a `Survey` and its `Site`, output what `free_space` and `reachability` take: local frame, metres and radians,
floors by index. A `Carrier` carries the scanner; zones limit where it may go.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import (
    BoolArray,
    FloatArray,
    Floor,
    Int32Array,
    KeepOut,
    PriorStation,
    Role,
    Site,
    Survey,
    SurveyScope,
)
from planner_core.positions.outlines import over_polygon

#: A place given by its ground may lie this little below the floor's median height.
_ON_GROUND_M = 0.3


@dataclass(frozen=True)
class Forbidden:
    """A place where no station may stand. plan_m : (2,) float64, local. floor : index into `Survey.floors`."""

    plan_m: FloatArray
    floor: int
    radius_m: float


class Ends(NamedTuple):
    """Where the walk begins and ends: places (3,) on the ground, local frame, or None for wherever it is shortest."""

    start_m: FloatArray | None = None
    end_m: FloatArray | None = None
    closed: bool = False


#: The walk begins and ends where that makes it shortest.
ANYWHERE = Ends()


@dataclass(frozen=True)
class LocalSite:
    """zones : a zone a floor for areas of all floors. entrances_m : (K, 3) local, or None where none are given.

    prior : stations given beforehand, in the scene frame, in the order of the site.
    """

    carrier: Carrier
    zones: tuple[WalkingZone, ...]
    entrances_m: FloatArray | None
    forbidden: tuple[Forbidden, ...]
    scope: SurveyScope | None = None
    ends: Ends = ANYWHERE
    prior: tuple[PriorStation, ...] = ()

    def in_zone(self, plan_m: FloatArray, floor: Int32Array) -> BoolArray:
        """(N,) bool: whether zones keep places (N, 2) on floors (N,) free of stations."""
        return blocked_by_zones(self.zones, plan_m, floor)

    def near_forbidden(self, plan_m: FloatArray, floor: Int32Array) -> BoolArray:
        """(N,) bool: whether places (N, 2) on floors (N,) are in a forbidden one's circle in plan, its rim included."""
        near = np.zeros(plan_m.shape[0], dtype=bool)
        for place in self.forbidden:
            off = plan_m - place.plan_m
            near |= (floor == place.floor) & (np.hypot(off[:, 0], off[:, 1]) <= place.radius_m)
        return near


def local_site(survey: Survey, site: Site) -> LocalSite:
    """Bring a site to the local frame.

    Raises
    ------
    RequirementError
        A floor that is not there, an outline of fewer than three corners, a carrier that makes no sense.
    """
    entrances_m = np.array(site.entrances_m, dtype=np.float64).reshape(-1, 3) - survey.scene.offset_m
    return LocalSite(
        carrier=carrier_of(site),
        zones=tuple(zone for area in site.keep_out for zone in _zones(survey, area)),
        entrances_m=entrances_m if site.entrances_m else None,
        forbidden=tuple(_forbidden(survey, place) for place in site.prior if place.role == Role.FORBIDDEN),
        scope=survey.scope,
        ends=ends_of(site, survey.scene.offset_m),
        prior=tuple(station for station in site.prior if station.role != Role.FORBIDDEN),
    )


def ends_of(site: Site, offset_m: FloatArray) -> Ends:
    """Ends of the walk as the site has them: from its start, else its first entrance. offset_m : `Scene.offset_m`."""
    start = site.start_m or (site.entrances_m[0] if site.entrances_m else None)
    local = [None if place is None else np.asarray(place, np.float64) - offset_m for place in (start, site.end_m)]
    return Ends(local[0], local[1], site.returns)


def carrier_of(site: Site) -> Carrier:
    """Who carries the scanner: a person unless the site has other figures."""
    given = {"radius_m": site.carrier_radius_m, "step_m": site.step_m, "height_m": site.carrier_height_m}
    changes = {name: value for name, value in given.items() if value is not None}
    if site.carrier_height_m is not None:
        changes["stairs_height_m"] = min(PERSON.stairs_height_m, site.carrier_height_m)
    return replace(PERSON, opens_doors=site.opens_doors, **changes)


def floor_named(floors: tuple[Floor, ...], name: str, what: str) -> int:
    """Index of the floor of that id or name, upper and lower case alike.

    Raises
    ------
    RequirementError
        There is none; `what` names whose floor it is.
    """
    index = index_of_floor(floors, name)
    if index is None:
        there = floors_in_words(floors)
        raise RequirementError(f"{what}: got the floor {name!r}, expected one of {there}; `tlsplan floors` lists them")
    return index


def index_of_floor(floors: tuple[Floor, ...], name: str) -> int | None:
    """Index of the first floor of that id or name, upper and lower case alike; None where there is none."""
    for index, floor in enumerate(floors):
        if name.casefold() in (floor.id.casefold(), floor.name.casefold()):
            return index
    return None


def floors_in_words(floors: tuple[Floor, ...]) -> str:
    """Ids and names, for messages."""
    return ", ".join(f"{floor.id} ({floor.name})" for floor in floors)


@dataclass(frozen=True)
class Carrier:
    """A body that walks or drives: an upright cylinder that climbs steps. The defaults are a person's.

    radius_m : of the body. step_m : greatest step up or down; what is lower is walked over. height_m : headroom needed:
    one ducks under beams and sloping roofs. stairs_height_m : headroom needed off the floors' ground, if that is less.
    max_slope_rad : steepest ground.
    opens_doors : doors (`IfcDoor`) are no obstacles, shut or open: models show them shut, a crew opens them.

    Raises
    ------
    RequirementError
        Lengths below zero or not finite, or a height that is not above two steps.
    """

    radius_m: float = 0.25
    step_m: float = 0.25
    height_m: float = 1.7
    stairs_height_m: float = 1.7
    max_slope_rad: float = math.radians(25.0)
    opens_doors: bool = True

    def __post_init__(self) -> None:
        for name in ("radius_m", "step_m"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise RequirementError(f"carrier's {name}: got {value:g}, expected 0 or more metres; e.g. 0.25")
        for name in ("height_m", "stairs_height_m"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 2.0 * self.step_m):
                raise RequirementError(
                    f"carrier's {name}: got {value:g}, expected more than two steps of {self.step_m:g} m; e.g. 1.7"
                )
        if not 0 <= self.max_slope_rad < math.pi / 2:
            raise RequirementError(
                f"carrier's max_slope_rad: got {self.max_slope_rad:g}, expected an angle from 0 to below pi/2; "
                "e.g. 0.44"
            )


#: Codes allow risers of up to 0.22 m, and where models miss a screed one is higher by it: hence steps of 0.25 m.
#: A surveyor with a tripod over the shoulder.
PERSON = Carrier()


@dataclass(frozen=True)
class WalkingZone:
    """An area of one floor that is kept out of, or that alone may be walked.

    outline_m : (K, 2) float64, corners of a simple polygon in plan, local frame. floor : index into `Survey.floors`.
    access : False: nobody goes in. True: on this floor nobody goes anywhere but into zones of access.
    """

    outline_m: FloatArray
    floor: int
    access: bool = False

    def __post_init__(self) -> None:
        outline = np.asarray(self.outline_m, dtype=np.float64)
        if outline.ndim != 2 or outline.shape[1] != 2 or outline.shape[0] < 3 or not np.isfinite(outline).all():
            raise RequirementError(
                f"zone's outline: got an array of shape {outline.shape}, expected at least three finite corners (x, y)"
            )
        object.__setattr__(self, "outline_m", outline)


def needed_height_m(carrier: Carrier, ground_floor: Int32Array) -> FloatArray:
    """(N,) headroom needed on grounds of floors (N,), -1 for what is none."""
    return np.where(ground_floor >= 0, carrier.height_m, min(carrier.height_m, carrier.stairs_height_m))


def blocked_by_zones(zones: tuple[WalkingZone, ...], plan_m: FloatArray, floor: Int32Array) -> BoolArray:
    """(N,) bool: whether zones keep a body from places (N, 2) on floors (N,)."""
    blocked = np.zeros(plan_m.shape[0], dtype=bool)
    for index in sorted({zone.floor for zone in zones}):
        here = np.flatnonzero(floor == index)
        allowed = [over_polygon(plan_m[here], z.outline_m) for z in zones if z.floor == index and z.access]
        excluded = [over_polygon(plan_m[here], z.outline_m) for z in zones if z.floor == index and not z.access]
        if allowed:
            blocked[here] |= ~np.logical_or.reduce(allowed)
        if excluded:
            blocked[here] |= np.logical_or.reduce(excluded)
    return blocked


def _zones(survey: Survey, area: KeepOut) -> list[WalkingZone]:
    what = ("access" if area.access else "keep-out") + (f" {area.name!r}" if area.name else "")
    floors = [floor_named(survey.floors, area.floor, what)] if area.floor else list(range(len(survey.floors)))
    outline_m = np.array(area.outline_m, dtype=np.float64).reshape(-1, 2) - survey.scene.offset_m[:2]
    return [WalkingZone(outline_m, floor, access=area.access) for floor in floors]


def _forbidden(survey: Survey, place: PriorStation) -> Forbidden:
    position_m = np.array(place.position_m, dtype=np.float64) - survey.scene.offset_m
    if place.floor:
        floor = floor_named(survey.floors, place.floor, f"forbidden position {place.id!r}")
    else:
        below = [i for i, each in enumerate(survey.floors) if each.elevation_m <= position_m[2] + _ON_GROUND_M]
        floor = below[-1] if below else 0
    return Forbidden(plan_m=position_m[:2], floor=floor, radius_m=place.radius_m)

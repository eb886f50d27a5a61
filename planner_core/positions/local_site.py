"""The site in the building's own terms: a `Site` (scene frame, floors by name) as mover, zones, entrances and ends.

Input a `Survey` and its `Site`, output what `free_space` and `reachability` take: local frame, floors by index.
"""

from __future__ import annotations

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
from planner_core.positions.carrier import PERSON, Mover, WalkingZone, blocked_by_zones

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

    mover: Mover
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
        A floor that is not there, an outline of fewer than three corners, a mover that makes no sense.
    """
    entrances_m = np.array(site.entrances_m, dtype=np.float64).reshape(-1, 3) - survey.scene.offset_m
    return LocalSite(
        mover=mover_of(site),
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


def mover_of(site: Site) -> Mover:
    """Who carries the scanner: a person unless the site has other figures."""
    given = {"radius_m": site.mover_radius_m, "step_m": site.step_m, "height_m": site.mover_height_m}
    changes = {name: value for name, value in given.items() if value is not None}
    if site.mover_height_m is not None:
        changes["stairs_height_m"] = min(PERSON.stairs_height_m, site.mover_height_m)
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

"""A draft: the stations of a plan as reviewers have changed them, and where they want none.

Positions are in the LOCAL frame, metres, the sensor's origin; outlines and places that are kept free are in the scene
frame, as everything of a `Site`. Drafts are values: equal ones are the same to every cache.

`draft_of_review` is the draft that a review makes of a plan, from the plan's stations as the review leaves them (scene
frame).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import FloatArray, Floor, KeepOut, PriorStation, Role
from planner_core.model.review import ForbiddenPlace, Review, ReviewedStation
from planner_core.positions.candidates import SET_UP_DIGITS, local_of_written_m

Place = tuple[float, float, float]


@dataclass(frozen=True)
class DraftStation:
    """position_m : (x, y, z), local, the sensor's origin. floor : a floor's id.

    instrument_height_m : above the ground; None: not known, as of stations from elsewhere. fixed : its scan exists.
    locked : the reviewer wants it in every plan.
    """

    id: str
    floor: str
    position_m: Place
    instrument_height_m: float | None
    fixed: bool = False
    locked: bool = False

    @property
    def at_m(self) -> FloatArray:
        """(3,) float64, the position."""
        return np.array(self.position_m, dtype=np.float64)


@dataclass(frozen=True)
class Draft:
    """stations : in the order of the plan, added ones last. keep_out, forbidden : of the review, besides the plan's.

    entrances_m : of the review, scene frame; the route begins at the first. scanned : ids of stations that stand where
    they were scanned, besides the plan's: links between them count as set up.
    """

    stations: tuple[DraftStation, ...]
    keep_out: tuple[KeepOut, ...] = ()
    forbidden: tuple[PriorStation, ...] = ()
    entrances_m: tuple[Place, ...] = ()
    scanned: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        ids = self.ids
        if len(set(ids)) != len(ids):
            twice = next(name for name in ids if ids.count(name) > 1)
            raise RequirementError(f"draft: got station {twice!r} twice, expected each id once; rename one")

    @property
    def ids(self) -> tuple[str, ...]:
        """Ids of the stations, in their order."""
        return tuple(station.id for station in self.stations)

    def station(self, name: str) -> DraftStation:
        """Return the station of that id.

        Raises
        ------
        RequirementError
            There is none.
        """
        for station in self.stations:
            if station.id == name:
                return station
        raise RequirementError(
            f"station: got {name!r}, expected one of {', '.join(self.ids) or 'none, the draft is empty'}; "
            "reload the review, it may have been removed"
        )

    def without(self, name: str) -> Draft:
        """Leave out the station of that id, if there is one."""
        return replace(self, stations=tuple(station for station in self.stations if station.id != name))

    def having(self, changed: DraftStation) -> Draft:
        """Put a station in the place of the one of its id, or last."""
        if changed.id not in self.ids:
            return replace(self, stations=(*self.stations, changed))
        return replace(
            self, stations=tuple(changed if station.id == changed.id else station for station in self.stations)
        )


def local_place(scene_m: Iterable[float], offset_m: FloatArray) -> Place:
    """Bring a position (3,) of the scene frame, as a plan or a review has it, to the local frame.

    A plan's own stations stand where the plan was computed for, to the last bit.
    """
    x, y, z = local_of_written_m(scene_m, offset_m).tolist()
    return x, y, z


def rounded_place(local_m: FloatArray, offset_m: FloatArray) -> Place:
    """Return a place (3,) of the local frame rounded to 0.1 mm in the scene frame.

    `local_place` of those digits is the same place, bit by bit: one that has gone through a text file or over the
    network need not be scanned again.
    """
    return local_place(np.round(local_m + offset_m, SET_UP_DIGITS).tolist(), offset_m)


def draft_of_review(
    review: Review, stations: Sequence[ReviewedStation], floors: Sequence[Floor], offset_m: FloatArray
) -> Draft:
    """Return the draft.

    Parameters
    ----------
    stations
        Of the plan, as `planner_core.review.stations.reviewed_stations` returns them.
    floors
        Of the survey: a forbidden place without a floor is one on each.
    offset_m
        scene = local + offset.
    """
    return Draft(
        stations=tuple(
            DraftStation(
                id=station.id,
                floor=station.floor,
                position_m=local_place(station.position_m, offset_m),
                instrument_height_m=station.instrument_height_m,
                fixed=station.fixed,
                locked=station.locked,
            )
            for station in stations
        ),
        keep_out=tuple(
            KeepOut(zone.outline_m, floor=zone.floor, name=zone.name)
            for zone in review.zones.values()
            if zone.kind == "keep_out"
        ),
        forbidden=tuple(place for each in review.forbidden.values() for place in _prior(each, floors)),
        entrances_m=review.entrances_m,
    )


def _prior(place: ForbiddenPlace, floors: Sequence[Floor]) -> tuple[PriorStation, ...]:
    names = [place.floor] if place.floor else [floor.id for floor in floors]
    return tuple(
        PriorStation(f"{place.id} {name}", place.position_m, Role.FORBIDDEN, name, radius_m=place.radius_m)
        for name in names
    )

"""The draft that a review makes of a plan: stations as they stand now, and what is to be kept free of stations.

Input a `Review` with the plan's stations as it leaves them (scene frame), output a `Draft`.
"""

from __future__ import annotations

from collections.abc import Sequence

from planner_core.model import FloatArray, Floor, KeepOut, PriorStation, Role
from planner_core.model.review import ForbiddenPlace, Review, ReviewedStation
from planner_core.planning.live.draft import Draft, DraftStation, local_place


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

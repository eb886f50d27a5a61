"""The stations as a review leaves them: PlanUnderReview, Review -> what a draft of the plan consists of."""

from __future__ import annotations

from planner_core.model.review import PlanUnderReview, Review, ReviewedStation, StationEdit


def reviewed_stations(plan: PlanUnderReview, review: Review) -> tuple[ReviewedStation, ...]:
    """Return the plan's stations in the order of visits, without those taken out.

    Added ones come behind the nearest, by id.
    """
    found = [
        reviewed_station(station.id, station, edit)
        for station in plan.stations
        if (edit := review.stations.get(station.id)) is None or not edit.removed
    ]
    for name, edit in sorted(review.stations.items()):
        if edit.added:
            added = reviewed_station(name, None, edit)
            found.insert(_place_in_visits(found, added), added)
    return tuple(found)


def _place_in_visits(stations: list[ReviewedStation], added: ReviewedStation) -> int:
    """Behind the station of its floor that is nearest in plan, the first of equals; last where its floor has none.

    The viewer's `draftStations` has the same rule.
    """
    x, y, _ = added.position_m
    away = [
        ((each.position_m[0] - x) ** 2 + (each.position_m[1] - y) ** 2, place)
        for place, each in enumerate(stations)
        if each.floor == added.floor
    ]
    return min(away)[1] + 1 if away else len(stations)


def reviewed_station(name: str, planned: ReviewedStation | None, edit: StationEdit | None) -> ReviewedStation:
    """Return one station: the plan's (None: it has none), with an edit of it (None: there is none)."""
    if edit is None:
        edit = StationEdit()
    if planned is None and edit.position_m is None:
        raise ValueError(f"station {name}: neither planned nor placed")
    moved = edit.position_m is not None
    return ReviewedStation(
        id=name,
        floor=(edit.floor or "") if planned is None else planned.floor if edit.floor is None else edit.floor,
        position_m=planned.position_m if edit.position_m is None and planned is not None else _given(edit),
        instrument_height_m=edit.instrument_height_m if moved or planned is None else planned.instrument_height_m,
        fixed=planned is not None and planned.fixed,
        locked=(planned is not None and planned.locked) if edit.locked is None else edit.locked,
        added=planned is None,
        moved=planned is not None and moved,
    )


def _given(edit: StationEdit) -> tuple[float, float, float]:
    assert edit.position_m is not None
    return edit.position_m

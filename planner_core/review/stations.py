"""The stations as a review leaves them: PlanUnderReview, Review -> what a draft of the plan consists of."""

from __future__ import annotations

from planner_core.model.review import PlanUnderReview, Review, ReviewedStation, StationEdit


def reviewed_stations(plan: PlanUnderReview, review: Review) -> tuple[ReviewedStation, ...]:
    """Return the plan's stations in its order, without those taken out, then the added ones by id."""
    planned = [
        reviewed_station(station.id, station, edit)
        for station in plan.stations
        if (edit := review.stations.get(station.id)) is None or not edit.removed
    ]
    added = [reviewed_station(name, None, edit) for name, edit in sorted(review.stations.items()) if edit.added]
    return (*planned, *added)


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

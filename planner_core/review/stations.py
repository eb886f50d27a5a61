"""The stations as a review leaves them: PlanUnderReview, Review -> what a draft of the plan consists of."""

from __future__ import annotations

import hashlib
from pathlib import Path

from planner_core.errors import PlanFolderError
from planner_core.model.review import PlanUnderReview, Review, ReviewedStation, StationEdit
from planner_core.plan_folder.plan_json import read_plan

# ---------------------------------------------------------------------------------------------------------- plan facts
# What a review needs to know of its plan: plan.json -> PlanUnderReview.


def plan_under_review(plan_folder: Path) -> PlanUnderReview:
    """Read the plan of a folder.

    Raises
    ------
    PlanFolderError
        There is none, or a value of it is not as it is written.
    """
    file = plan_folder / "plan.json"
    plan = read_plan(plan_folder)
    try:
        sha256 = hashlib.sha256(file.read_bytes()).hexdigest()
    except OSError as error:
        raise PlanFolderError(f"{file}: can't be read ({error}), expected a plan.json; check the path") from error
    locked = {station.id for station in plan.site.prior if station.role == "locked"}
    return PlanUnderReview(
        sha256=sha256,
        stations=tuple(
            ReviewedStation(row.id, row.floor, row.position, row.instrument_height_m, row.fixed, row.id in locked)
            for row in plan.stations
        ),
        floor_elevations_m={floor.id: floor.elevation_m for floor in plan.floors},
        n_elements=plan.scene.n_elements,
        offset_m=plan.scene.offset,
        links=tuple((link.a, link.b) for link in plan.registration.links),
    )


# ------------------------------------------------------------------------------------------------------------ stations
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

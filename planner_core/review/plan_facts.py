"""What a review needs to know of its plan: plan.json -> PlanUnderReview."""

from __future__ import annotations

import hashlib
from pathlib import Path

from planner_core.errors import PlanFolderError
from planner_core.model.review import PlanUnderReview, ReviewedStation
from planner_core.plan_folder.plan_json import read_plan


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

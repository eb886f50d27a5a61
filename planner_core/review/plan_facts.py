"""What a review needs to know of its plan: plan.json -> PlanUnderReview."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from planner_core.errors import PlanFolderError, ReviewError
from planner_core.model.review import PlanUnderReview, Point, ReviewedStation, check_point
from planner_core.plan_folder.plan_json import read_plan_json


def plan_under_review(plan_folder: Path) -> PlanUnderReview:
    """Read the plan of a folder.

    Raises
    ------
    PlanFolderError
        There is none, or it lacks what every plan of this version has.
    """
    file = plan_folder / "plan.json"
    document = read_plan_json(plan_folder)
    try:
        sha256 = hashlib.sha256(file.read_bytes()).hexdigest()
    except OSError as error:
        raise PlanFolderError(f"{file}: can't be read ({error}), expected a plan.json; check the path") from error
    try:
        return _facts(document, sha256)
    except (KeyError, TypeError, ValueError, AttributeError, ReviewError) as error:
        raise PlanFolderError(
            f"{file}: is no plan that can be reviewed ({type(error).__name__}: {error}), expected one of this version; "
            "plan again"
        ) from error


def _facts(document: Mapping[str, Any], sha256: str) -> PlanUnderReview:
    locked = {row["id"] for row in (document.get("site") or {}).get("settled", ()) if row["role"] == "locked"}
    return PlanUnderReview(
        sha256=sha256,
        stations=tuple(_station(row, locked) for row in document["stations"]),
        floor_elevations_m={str(row["id"]): float(row["elevation_m"]) for row in document["floors"]},
        n_elements=int(document["scene"]["n_elements"]),
        offset_m=_point("offset", document["scene"]["offset"]),
        links=tuple((str(link["a"]), str(link["b"])) for link in document["registration"]["links"]),
    )


def _station(row: Mapping[str, Any], locked: set[str]) -> ReviewedStation:
    height_m = row["instrument_height_m"]
    return ReviewedStation(
        id=str(row["id"]),
        floor=str(row["floor"]),
        position_m=_point("position", row["position"]),
        instrument_height_m=None if height_m is None else float(height_m),
        fixed=bool(row["fixed"]),
        locked=row["id"] in locked,
    )


def _point(what: str, values: Any) -> Point:
    x, y, z = (float(value) for value in values)
    check_point(what, (x, y, z))
    return x, y, z

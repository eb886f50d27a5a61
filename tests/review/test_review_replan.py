"""What a review makes of the settings that a plan is made with again."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from planner_core.errors import ReviewError
from planner_core.model import (
    Entrance,
    ForbiddenPlace,
    KeepOut,
    PartRequirement,
    PlanSettings,
    PlanUnderReview,
    PointLimits,
    PriorStation,
    Requirements,
    Review,
    Scanner,
    Site,
    Zone,
)
from planner_core.model.site import GroundPick
from planner_core.review import changes as c
from planner_core.review.commit import Committed, commit
from planner_core.review.replan import load_options_with_review, settings_with_review
from planner_core.scene.load import LoadOptions

from .conftest import ANA, OFFSET_M, make_plan

X, Y, Z = OFFSET_M
HERE = (X + 5.0, Y + 5.0, Z + 1.6)
SQUARE = ((X, Y), (X + 2, Y), (X + 2, Y + 2), (X, Y + 2))
SCANNED = PriorStation("S002", (X + 2.0, Y + 2.0, Z + 1.5), "scanned", "F0", 1.5)
SETTINGS = PlanSettings(
    scanner=Scanner(
        name="t", title="t", source="t", range_min_m=0.3, range_max_m=10.0, n_azimuths=8,
        elevation_rad=tuple(np.linspace(-1, 1, 3)), instrument_height_min_m=1.0, instrument_height_max_m=2.0,
    ),
    requirements=Requirements(
        0.9, limits=PointLimits(range_m=20.0), seen_from=2, parts=(PartRequirement("hall", 0.5, classes=("IfcWall",)),)
    ),
    site=Site(
        keep_out=(KeepOut(SQUARE, name="lab"),),
        prior=(SCANNED, PriorStation("S003", (X + 3.0, Y + 2.0, Z + 1.5), "locked", "F0"),
                 PriorStation("old", HERE, "kept"), PriorStation("shaft", HERE, "forbidden", "F1")),
        ground_picks=(GroundPick((X, Y, Z)),),
    ),
)  # fmt: skip


def again(*changes: c.Change) -> PlanSettings:
    review = Review()
    if changes:
        outcome = commit(review, 0, changes, make_plan(), ANA)
        assert isinstance(outcome, Committed)
        review = outcome.review
    return settings_with_review(SETTINGS, review, make_plan())


def roles(settings: PlanSettings) -> dict[str, str]:
    return {station.id: station.role for station in settings.site.prior}


def test_without_changes_stations_are_kept_and_what_was_settled_stays() -> None:
    settings = again()
    assert roles(settings) == {
        "S002": "scanned", "shaft": "forbidden", "S001": "kept", "S003": "locked", "S 04": "kept",
    }  # fmt: skip
    assert settings.site.keep_out == SETTINGS.site.keep_out
    assert settings.requirements == SETTINGS.requirements
    assert SCANNED in settings.site.prior


def test_stations_are_settled_where_reviewers_put_them() -> None:
    settings = again(
        c.MoveStation("S001", HERE, 1.6, "F1"),
        c.LockStation("S001"),
        c.UnlockStation("S003"),
        c.RemoveStation("S 04"),
        c.AddStation(HERE, "F0", 1.6),
    )
    assert roles(settings) == {
        "S002": "scanned", "shaft": "forbidden", "S001": "locked", "S003": "kept", "S004": "kept",
    }  # fmt: skip
    moved = next(station for station in settings.site.prior if station.id == "S001")
    assert moved == PriorStation("S001", HERE, "locked", "F1", 1.6)


def test_a_rejected_station_is_not_kept_and_its_place_is_forbidden() -> None:
    settings = again(c.SetVerdict("S001", "rejected"), c.SetVerdict("S 04", "accepted"))
    assert roles(settings)["rejected S001"] == "forbidden"
    assert "S001" not in roles(settings)
    assert roles(settings)["S 04"] == "kept"
    forbidden = next(station for station in settings.site.prior if station.id == "rejected S001")
    assert (forbidden.position_m, forbidden.radius_m, forbidden.floor) == ((X + 1.0, Y + 2.0, Z + 1.5), 0.5, "F0")


def test_a_station_that_is_locked_and_rejected_is_told() -> None:
    with pytest.raises(ReviewError, match="S003: is locked, and Ana rejected it"):
        again(c.SetVerdict("S003", "rejected"))


def test_forbidden_places_without_a_floor_are_on_every_floor() -> None:
    settings = again(c.Forbid(ForbiddenPlace("", HERE, 1.5)), c.Forbid(ForbiddenPlace("", HERE, 2.0, "F1")))
    found = [(s.id, s.floor, s.radius_m) for s in settings.site.prior if s.id.startswith("P")]
    assert found == [("P001 F0", "F0", 1.5), ("P001 F1", "F1", 1.5), ("P002", "F1", 2.0)]


def test_zones_and_picks_come_besides_what_was_asked(plan: PlanUnderReview) -> None:
    pick = GroundPick(HERE, is_ground=False, floor="F0")
    settings = again(
        c.AddZone(Zone("", "keep_out", SQUARE, "F0", "crane")),
        c.AddZone(Zone("", "priority", SQUARE, "F1", "hall", 0.98)),
        c.AddZone(Zone("", "priority", SQUARE, "", "", 0.97)),
        c.PickGround(pick),
    )
    assert settings.site.keep_out == (*SETTINGS.site.keep_out, KeepOut(SQUARE, "F0", name="crane"))
    assert settings.site.ground_picks == (*SETTINGS.site.ground_picks, pick)
    asked = SETTINGS.requirements.limits
    assert settings.requirements.parts[1:] == (
        PartRequirement("hall (Z002)", 0.98, asked, 2, ("F1",), zone=SQUARE),
        PartRequirement("Z003", 0.97, asked, 2, zone=SQUARE),
    )


def test_the_route_begins_at_the_entrance_of_the_review_and_those_of_the_plan_stay() -> None:
    review = Review(
        entrances={name: Entrance(name, (X + at, Y, Z), "F0") for name, at in (("E010", 2.0), ("E002", 1.0))}
    )
    asked = dataclasses.replace(SETTINGS, site=Site(entrances_m=((X, Y, Z),), start_m=HERE, returns=True))
    site = settings_with_review(asked, review, make_plan()).site
    assert site.entrances_m == ((X + 1.0, Y, Z), (X + 2.0, Y, Z), (X, Y, Z))
    assert (site.start_m, site.returns) == (None, True)
    assert settings_with_review(asked, Review(), make_plan()).site.start_m == HERE


def test_doors_are_as_the_review_says_and_others_as_they_were() -> None:
    options = LoadOptions(doors="open", doors_open=("a", "b"), doors_shut=("c", "d"))
    review = Review(doors={"a": "shut", "d": "open", "e": "shut"})
    assert load_options_with_review(options, review) == dataclasses.replace(
        options, doors_open=("b", "d"), doors_shut=("a", "c", "e")
    )
    assert load_options_with_review(options, Review()) == options

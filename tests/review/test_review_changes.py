"""Changes of a review: what each does, what takes it back, what is refused."""

from __future__ import annotations

import dataclasses

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.errors import ReviewError
from planner_core.model import Entrance, ForbiddenPlace, PlanUnderReview, Review, Zone
from planner_core.model.review import MOST_OBJECTS
from planner_core.model.site import GroundPick
from planner_core.review import changes as c
from planner_core.review.apply import apply
from planner_core.review.stations import reviewed_stations

from .conftest import ANA, BEN, OFFSET_M, make_plan, some_changes

X, Y, Z = OFFSET_M
HERE = (X + 5.0, Y + 5.0, Z + 1.6)
SQUARE = ((X, Y), (X + 2, Y), (X + 2, Y + 2), (X, Y + 2))


def context(by: c.Signature = ANA, revision: int = 1) -> c.Context:
    return c.Context(make_plan(), by, revision)


def after(*changes: c.Change, review: Review | None = None, by: c.Signature = ANA) -> Review:
    review = review or Review()
    for change in changes:
        review = apply(review, change, context(by)).review
    return review


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(changes=st.lists(st.tuples(some_changes, st.sampled_from([ANA, BEN])), max_size=14))
def test_the_inverse_of_every_change_takes_it_back_whatever_was_changed_before(changes) -> None:
    review, steps = Review(), []
    for change, by in changes:
        try:
            applied = apply(review, change, context(by))
        except ReviewError:
            continue
        assert apply(applied.review, applied.inverse, context(by)).review == review, change
        steps.append((applied.inverse, by, review))
        review = applied.review
    for inverse, by, before in reversed(steps):
        review = apply(review, inverse, context(by)).review
        assert review == before
    assert review == Review()


@settings(max_examples=100, deadline=None)
@given(changes=st.lists(some_changes, max_size=12))
def test_a_change_that_was_taken_back_can_be_made_again_by_the_inverse_of_the_inverse(changes) -> None:
    review = Review()
    for change in changes:
        try:
            applied = apply(review, change, context())
        except ReviewError:
            continue
        undone = apply(applied.review, applied.inverse, context())
        assert apply(undone.review, undone.inverse, context()).review == applied.review
        review = applied.review


def test_a_moved_station_keeps_its_height_and_floor_unless_told(plan: PlanUnderReview) -> None:
    moved = reviewed_stations(plan, after(c.MoveStation("S001", HERE)))[0]
    assert (moved.position_m, moved.instrument_height_m, moved.floor, moved.moved) == (HERE, 1.5, "F0", True)
    moved = reviewed_stations(plan, after(c.MoveStation("S001", HERE, None, "F1")))[0]
    assert (moved.instrument_height_m, moved.floor) == (None, "F1")


def test_a_raised_station_stays_over_its_spot(plan: PlanUnderReview) -> None:
    raised = reviewed_stations(plan, after(c.SetHeight("S001", 1.9)))[0]
    assert raised.instrument_height_m == 1.9
    assert raised.position_m == pytest.approx((X + 1.0, Y + 2.0, Z + 1.9), abs=1e-6)


def test_stations_taken_out_are_gone_and_added_ones_come_behind_the_nearest_with_free_ids(
    plan: PlanUnderReview,
) -> None:
    review = after(c.RemoveStation("S001"), c.AddStation(HERE, "F1", 1.6), c.AddStation(HERE, "F0"))
    stations = reviewed_stations(plan, review)
    # S004 is alone on its floor, S005 nearest to the last of its own.
    assert [station.id for station in stations] == ["S002", "S003", "S 04", "S005", "S004"]
    assert [station.added for station in stations] == [False, False, False, True, True]
    between = after(c.AddStation((X + 2.2, Y + 2.1, Z + 1.6), "F0"), review=review)
    assert [station.id for station in reviewed_stations(plan, between)][:3] == ["S002", "S006", "S003"]


def test_the_id_of_a_removed_station_is_not_given_to_another_one() -> None:
    review = after(c.AddStation(HERE, "F0"), c.SetVerdict("S004", "rejected"), c.RemoveStation("S004"))
    assert set(after(c.AddStation(HERE, "F0"), review=review).stations) == {"S005"}


def test_a_lock_of_the_plan_can_be_opened(plan: PlanUnderReview) -> None:
    locked = {s.id: s.locked for s in reviewed_stations(plan, Review())}
    assert locked == {"S001": False, "S002": False, "S003": True, "S 04": False}
    review = after(c.UnlockStation("S003"), c.LockStation("S001"))
    assert {s.id for s in reviewed_stations(plan, review) if s.locked} == {"S001"}


def test_a_locked_station_is_not_moved_nor_raised_and_its_place_not_forbidden() -> None:
    for change in (c.MoveStation("S003", HERE), c.SetHeight("S003", 1.9)):
        with pytest.raises(ReviewError, match="station S003: is locked, so it stays where it is; unlock it first"):
            after(change)
        assert after(c.UnlockStation("S003"), change).stations["S003"].position_m is not None
    beside = ForbiddenPlace("", (X + 3.4, Y + 2.0, Z), 0.5, "F0")  # S003 stands at (3, 2), 0.4 m away
    with pytest.raises(ReviewError, match=r"S003 is locked 0\.40 m away, within its radius of 0\.5 m; unlock"):
        after(c.Forbid(beside))
    with pytest.raises(ReviewError, match="S003 is locked"):
        after(c.Forbid(dataclasses.replace(beside, floor="")))
    for allowed in (dataclasses.replace(beside, floor="F1"), dataclasses.replace(beside, radius_m=0.3)):
        assert len(after(c.Forbid(allowed)).forbidden) == 1
    assert len(after(c.UnlockStation("S003"), c.Forbid(beside)).forbidden) == 1


def test_changes_that_cancel_each_other_leave_no_trace() -> None:
    assert after(c.LockStation("S001"), c.LockStation("S001", None)) == Review()
    assert after(c.MoveStation("S001", HERE), c.MoveStation("S001", None)) == Review()
    assert after(c.RemoveStation("S001"), c.RestoreStation("S001")) == Review()


def test_positions_are_kept_to_the_micrometre() -> None:
    review = after(c.MoveStation("S001", (X + 1 / 3, Y - 2 / 3, -0.0)))
    assert review.stations["S001"].position_m == (500000.333333, 3999999.333333, 0.0)


def test_entrances_come_in_the_order_in_which_they_were_set() -> None:
    there = (X + 1.0, Y + 1.0, Z)
    review = after(c.AddEntrance(Entrance("", HERE, "F0")), c.AddEntrance(Entrance("", there, "F1")))
    assert review.entrances_m == (HERE, there)
    back = after(c.RemoveEntrance("E001"), review=review)
    assert back.entrances_m == (there,)
    # Whoever still shows the first must not meet another one under its name.
    assert set(after(c.AddEntrance(Entrance("", HERE, "F0")), review=back).entrances) == {"E002", "E003"}


def test_a_door_is_open_or_shut_or_as_in_the_plan() -> None:
    review = after(c.SetDoor("a door", "open"), c.SetDoor("another", "shut"), c.SetDoor("a door", "shut"))
    assert review.doors == {"a door": "shut", "another": "shut"}
    assert after(c.SetDoor("a door", None), c.SetDoor("another", None), review=review) == Review()


def test_comments_and_verdicts_are_signed_by_whoever_makes_them() -> None:
    review = after(c.AddComment("Look", "S001"), c.SetVerdict("S003", "rejected", "in the way"), c.Sign("ok"), by=BEN)
    comment, verdict = review.comments["C001"], review.verdicts["S003"]
    assert (comment.author, comment.time, comment.target) == ("Ben", BEN.time, "S001")
    assert (verdict.by, verdict.time, verdict.note) == ("Ben", BEN.time, "in the way")
    assert review.sign_off is not None
    assert (review.sign_off.name, review.sign_off.plan_sha256, review.sign_off.revision) == ("Ben", "ab" * 32, 1)


def test_a_station_is_done_or_skipped_and_neither_again() -> None:
    review = after(c.SetProgress("S003", "skipped"), by=BEN)
    assert (review.progress["S003"].state, review.progress["S003"].by) == ("skipped", "Ben")
    done = apply(review, c.SetProgress("S003", "done"), context(ANA))
    assert done.review.progress["S003"].by == "Ana"
    assert done.inverse == c.SetProgress("S003", "skipped", "Ben", BEN.time)
    assert after(c.SetProgress("S003", None), review=done.review).progress == {}


def test_only_its_author_changes_or_removes_a_comment_and_anybody_settles_it() -> None:
    review = after(c.AddComment("Look"))
    for change in (c.EditComment("C001", "x"), c.RemoveComment("C001")):
        with pytest.raises(ReviewError, match="is Ana's"):
            apply(review, change, context(BEN))
    assert after(c.ResolveComment("C001"), review=review, by=BEN).comments["C001"].resolved
    assigned = after(c.AssignComment("C001", "Kim", "2026-12-01"), review=review, by=BEN).comments["C001"]
    assert (assigned.assignee, assigned.due, assigned.author) == ("Kim", "2026-12-01", "Ana")


ZONE = Zone("", "keep_out", SQUARE)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (c.MoveStation("S009", HERE), "neither in the plan nor added"),
        (c.MoveStation("S002", HERE), "scanned already"),
        (c.RemoveStation("S002"), "scanned already"),
        (c.MoveStation("S001", (float("nan"), 0, 0)), "expected metres"),
        (c.MoveStation("S001", (1e8, 0, 0)), "expected metres"),
        (c.MoveStation("S001", HERE, -1.0), "instrument height"),
        (c.MoveStation("S001", HERE, 1.5, "F9"), "expected one of F0, F1"),
        (c.SetHeight("S 04", 1.5), "not known"),
        (c.AddStation(HERE, "", 1.5), "expected one of F0, F1"),
        (c.AddStation(HERE, "F0", 1.5, "s001"), "there is one already"),
        (c.AddStation(HERE, "F0", 1.5, "S_04_3"), "there is one already"),
        (c.AddStation(HERE, "F0", 1.5, "../S1"), "expected a letter"),
        (c.RestoreStation("S001"), "was not taken out"),
        (c.Forbid(ForbiddenPlace("", HERE, floor="F7")), "expected one of F0, F1"),
        (c.Allow("P001"), "is not there"),
        (c.ChangeZone(dataclasses.replace(ZONE, id="Z001")), "is not there"),
        (c.AddZone(dataclasses.replace(ZONE, outline_m=(SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3]))), "cross"),
        (c.AddZone(dataclasses.replace(ZONE, outline_m=(*SQUARE, SQUARE[0]))), "a corner twice"),
        (c.AddZone(dataclasses.replace(ZONE, outline_m=(SQUARE[0], SQUARE[1], (X + 1, Y)))), "encloses nothing"),
        (c.PickGround(GroundPick(HERE, floor="attic")), "expected one of F0, F1"),
        (c.AddEntrance(Entrance("", HERE, "")), "expected one of F0, F1"),
        (c.RemoveEntrance("E001"), "is not there"),
        (c.SetDoor("", "open"), "got none"),
        (c.SetDoor("x" * 101, "open"), "101 characters"),
        (c.SetDoor("0w$5Bz2Kf9yR4Q_x7LmN1c", "ajar"), "expected one of open, shut"),
        (c.AddComment("x" * 10_001), "10001 bytes"),
        (c.AddComment("x", due="2026-02-30"), "expected a day as 2026-12-01"),
        (c.AddComment("x", assignee="a\nb"), "line break"),
        (c.AddComment("é" * 5_001), "10002 bytes"),
        (c.AddComment("  "), "no text"),
        (c.AddComment("a\x00b"), "control character"),
        (c.AddComment("\u202egnp.exe"), "control character"),
        (c.AddComment("\ud800"), "half a surrogate"),
        (c.AddComment("x", 7), "expected 0 to 6"),
        (c.AddComment("x", "S009"), "neither in the plan nor added"),
        (c.SetVerdict("S001", "perhaps"), "expected one of accepted, rejected"),
        (c.SetVerdict("S001", "accepted", by="x" * 101), "101 characters"),
        (c.ClearVerdict("S001"), "no verdict"),
        (c.SetProgress("S001", "lost"), "expected one of done, skipped"),
        (c.SetProgress("S001", None), "neither done nor skipped"),
        (c.SetProgress("S009", "done"), "neither in the plan nor added"),
        (c.Unsign(), "none to withdraw"),
    ],
)  # fmt: skip
def test_a_change_that_makes_no_sense_is_refused_in_one_line(change: c.Change, message: str) -> None:
    with pytest.raises(ReviewError, match=message) as refused:
        apply(Review(), change, context())
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    "fields",
    [
        {"kind": "hole"},
        {"outline_m": SQUARE[:2]},
        {"outline_m": SQUARE * 251},
        {"outline_m": (*SQUARE, (float("inf"), 0.0))},
        {"coverage": 0.9},
        {"kind": "priority"},
        {"kind": "priority", "coverage": 1.1},
        {"name": "two\nlines"},
        {"id": "no space"},
    ],
)
def test_a_zone_that_is_none_is_refused(fields: dict[str, object]) -> None:
    with pytest.raises(ReviewError):
        dataclasses.replace(ZONE, **fields)


def test_nobody_signs_over_another_signature_and_stations_taken_out_have_to_be_restored_first() -> None:
    with pytest.raises(ReviewError, match="Ana signed already"):
        after(c.Sign(), c.Sign())
    with pytest.raises(ReviewError, match="restore it first"):
        after(c.RemoveStation("S001"), c.LockStation("S001"))


def test_a_review_holds_so_many_objects_and_no_more() -> None:
    place = ForbiddenPlace("P", HERE)
    full = Review(forbidden={f"P{n}": place for n in range(MOST_OBJECTS)})
    with pytest.raises(ReviewError, match="10000 objects"):
        apply(full, c.AddComment("one more"), context())
    assert after(c.Allow("P7"), review=full).n_objects == MOST_OBJECTS - 1

"""Two people at one review: who is first, who is told, and what they are told."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.errors import ReviewError
from planner_core.model import PlanUnderReview, Review, Zone
from planner_core.review import changes as c
from planner_core.review import commit as commit_module
from planner_core.review.commit import Committed, Conflict, EditConflict, commit

from .conftest import ANA, BEN, OFFSET_M, content, make_plan, some_changes

X, Y, Z = OFFSET_M
HERE = (X + 5.0, Y + 5.0, Z + 1.6)
ZONE = Zone("Z001", "keep_out", ((X, Y), (X + 2, Y), (X + 2, Y + 2)))


def committed(review: Review, base: int, *changes: c.Change, by: c.Signature = ANA) -> Review:
    outcome = commit(review, base, changes, make_plan(), by)
    assert isinstance(outcome, Committed), outcome
    return outcome.review


def refused(review: Review, base: int, *changes: c.Change, by: c.Signature = BEN) -> Conflict:
    outcome = commit(review, base, changes, make_plan(), by)
    assert isinstance(outcome, Conflict)
    assert outcome.review == review
    return outcome


def test_changes_of_different_objects_do_not_get_in_each_others_way() -> None:
    review = committed(Review(), 0, c.MoveStation("S001", HERE))
    review = committed(review, 0, c.LockStation("S003"), c.AddComment("x"), c.AddStation(HERE, "F0"), by=BEN)
    assert set(review.stations) == {"S001", "S003", "S004"}
    assert review.revision == 2
    assert {name: touch.by for name, touch in review.touched.items()} == {
        "station:S001": "Ana", "station:S003": "Ben", "comment:C001": "Ben", "station:S004": "Ben",
    }  # fmt: skip


def test_who_changes_what_somebody_changed_meanwhile_is_told_who_and_when() -> None:
    review = committed(Review(), 0, c.MoveStation("S001", HERE))
    conflict = refused(review, 0, c.RemoveStation("S001"))
    assert conflict.clashes == (EditConflict("station:S001", "Ana", ANA.time),)
    assert "station S001 was changed in the meantime, last by Ana at 16:30:00 UTC" in conflict.message
    assert committed(review, 1, c.RemoveStation("S001"), by=BEN).stations["S001"].removed


def test_who_changes_what_somebody_removed_is_told_so_and_not_that_it_never_was() -> None:
    review = committed(committed(Review(), 0, c.AddZone(ZONE)), 1, c.RemoveZone("Z001"))
    assert refused(review, 1, c.ChangeZone(ZONE)).clashes[0].object == "zone:Z001"
    with pytest.raises(ReviewError, match="is not there"):
        commit(review, 2, [c.ChangeZone(ZONE)], make_plan(), BEN)


def test_nobody_accepts_a_station_that_was_moved_meanwhile() -> None:
    review = committed(Review(), 0, c.MoveStation("S001", HERE))
    assert refused(review, 0, c.SetVerdict("S001", "accepted")).clashes[0].object == "station:S001"
    assert "S003" in committed(review, 0, c.SetVerdict("S003", "accepted")).verdicts


def test_nobody_marks_as_done_what_was_moved_or_marked_meanwhile() -> None:
    review = committed(Review(), 0, c.MoveStation("S001", HERE))
    review = committed(review, 1, c.SetProgress("S003", "skipped"), by=BEN)
    assert refused(review, 0, c.SetProgress("S001", "done")).clashes[0].object == "station:S001"
    clash = refused(review, 1, c.SetProgress("S003", "done"))
    assert (clash.clashes[0].object, clash.clashes[0].by) == ("progress:S003", "Ben")
    assert clash.message.startswith("the progress of station S003 was changed in the meantime")


def test_whoever_signs_has_seen_everything() -> None:
    review = committed(Review(), 0, c.AddComment("wait"))
    assert refused(review, 0, c.Sign()).clashes[0].object == "comment:C001"
    signed = committed(review, 1, c.Sign(), by=BEN)
    assert signed.sign_off is not None
    assert signed.sign_off.revision == signed.revision == 2


def test_of_several_changes_all_are_made_or_none() -> None:
    review = Review()
    with pytest.raises(ReviewError, match="change 2: station S009"):
        commit(review, 0, [c.LockStation("S001"), c.LockStation("S009")], make_plan(), ANA)
    review = committed(review, 0, c.MoveStation("S001", HERE))
    conflict = refused(review, 0, c.LockStation("S003"), c.LockStation("S001"), c.UnlockStation("S001"))
    assert [clash.object for clash in conflict.clashes] == ["station:S001"]


def test_who_shows_a_later_revision_than_there_is_is_told_to_reload() -> None:
    conflict = refused(Review(), 3, c.LockStation("S001"))
    assert conflict.clashes == ()
    assert "revision 3" in conflict.message
    assert "reload" in conflict.message


@pytest.mark.parametrize("n_changes", [0, 1001])
def test_no_changes_and_too_many_are_refused(n_changes: int) -> None:
    with pytest.raises(ReviewError, match=f"got {n_changes}"):
        commit(Review(), 0, [c.LockStation("S001")] * n_changes, make_plan(), ANA)


@pytest.mark.parametrize("author", ["", "  ", "two\nlines", "x" * 101])
def test_an_author_without_a_name_is_refused(author: str) -> None:
    with pytest.raises(ReviewError, match="author"):
        commit(Review(), 0, [c.LockStation("S001")], make_plan(), c.Signature(author, ANA.time))


def test_only_so_many_removed_objects_are_remembered(plan: PlanUnderReview, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(commit_module, "MOST_GONE", 2)
    review = Review()
    for n in range(5):
        name = f"Z{n}"
        zone = Zone(name, "keep_out", ZONE.outline_m)
        review = committed(review, review.revision, c.AddZone(zone))
        if n < 4:
            review = committed(review, review.revision, c.RemoveZone(name))
    review = committed(review, review.revision, c.LockStation("S001"))
    assert set(review.touched) == {"zone:Z2", "zone:Z3", "zone:Z4", "station:S001"}


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(batches=st.lists(st.lists(some_changes, min_size=1, max_size=4), max_size=6))
def test_the_undo_of_a_commit_takes_all_of_it_back_and_counts_on(batches) -> None:
    review = Review()
    for batch in batches:
        try:
            outcome = commit(review, review.revision, batch, make_plan(), ANA)
        except ReviewError:
            continue
        assert isinstance(outcome, Committed)
        back = commit(outcome.review, outcome.review.revision, outcome.undo, make_plan(), ANA)
        assert isinstance(back, Committed)
        assert content(back.review) == content(review)
        assert back.review.revision == review.revision + 2
        assert set(back.objects) == set(outcome.objects)
        review = outcome.review

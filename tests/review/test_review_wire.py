"""Changes as JSON and back: each is its own document."""

from __future__ import annotations

import dataclasses
import json
from typing import get_args

import pytest
from hypothesis import given, settings
from pydantic import TypeAdapter, ValidationError

from planner_core.errors import ReviewError
from planner_core.model import Review, SignOff
from planner_core.review import changes as c
from planner_core.review.apply import KINDS, apply

from .conftest import ANA, make_plan, some_changes

CHANGE, REVIEW = TypeAdapter(c.Change), TypeAdapter(Review)


def over_the_wire(change: c.Change) -> c.Change:
    sent = CHANGE.validate_python(json.loads(json.dumps(dataclasses.asdict(change))))
    assert type(sent) is type(change)
    return sent


def test_every_change_has_a_kind_of_its_own_that_a_document_names() -> None:
    union, _ = get_args(c.Change)
    assert {change.kind: change for change in get_args(union)} == KINDS
    for change in get_args(union):
        schema = TypeAdapter(change).json_schema()
        assert schema["properties"]["kind"]["const"] == change.kind
        assert "kind" in schema["required"]
        assert schema["additionalProperties"] is False


@settings(max_examples=200, deadline=None)
@given(change=some_changes)
def test_a_change_is_the_same_after_it_went_over_the_wire(change: c.Change) -> None:
    assert over_the_wire(change) == change


@settings(max_examples=60, deadline=None)
@given(change=some_changes)
def test_inverses_and_reviews_go_over_the_wire_too(change: c.Change) -> None:
    context = c.Context(make_plan(), ANA, 1)
    review = apply(Review(), c.AddComment("x", id="C001"), context).review
    review = apply(review, c.LockStation("S001"), context).review
    try:
        applied = apply(review, change, context)
    except ReviewError:
        return
    back = over_the_wire(applied.inverse)
    assert apply(applied.review, back, context).review == review
    assert REVIEW.validate_python(json.loads(json.dumps(dataclasses.asdict(applied.review)))) == applied.review


def test_a_signature_that_is_put_back_is_the_one_that_was_there() -> None:
    signed = SignOff("Ana", ANA.time, "ab" * 32, 3, "go")
    assert over_the_wire(c.Sign("go", signed)) == c.Sign("go", signed)


def test_the_id_of_what_is_added_may_be_left_out() -> None:
    sent = {"kind": "add_entrance", "entrance": {"position_m": [1, 2, 0], "floor": "F0"}}
    assert CHANGE.validate_python(sent).entrance.id == ""
    assert CHANGE.validate_python({"kind": "move_station", "station": "S001", "position_m": None}) == c.MoveStation(
        "S001", None
    )


@pytest.mark.parametrize(
    "sent",
    [
        {"kind": "allow"},
        {"kind": "allow", "id": "P 1"},
        {"kind": "allow", "id": "P001", "more": 1},
        {"kind": "set_door", "door": "x", "state": "ajar"},
        {"kind": "lock_station", "station": "S001", "locked": "yes"},
        {"kind": "set_height", "station": "S001", "instrument_height_m": "1.6"},
        {"kind": "set_height", "station": "S001", "instrument_height_m": 101},
        {"kind": "change_zone", "zone": {"kind": "keep_out", "outline_m": [[0, 0], [1, 0], [1, 1]]}},
        {"kind": "add_zone", "zone": {"kind": "priority", "outline_m": [[0, 0], [1, 0], [1, 1]]}},
        {"kind": "no_such_change"},
    ],
)
def test_what_makes_no_sense_is_refused(sent: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        CHANGE.validate_python(sent)

"""Changes as JSON and back: the documents of the interface say what the library's changes say, every one."""

from __future__ import annotations

import dataclasses
import json
from typing import get_args

from hypothesis import given, settings
from pydantic import TypeAdapter

from planner_core.errors import ReviewError
from planner_core.model import Review, SignOff
from planner_core.review import changes as c
from planner_core.review.apply import KINDS, apply
from viewer_web.server.review_documents import (
    ChangeDocument,
    ReviewDocument,
    change_document,
    change_of,
    review_document,
)

from .conftest import ANA, make_plan, some_changes

CHANGE = TypeAdapter(ChangeDocument)


def over_the_wire(change: c.Change) -> c.Change:
    told = change_document(change)
    if told.get("instrument_height_m") == c.AS_NOW:
        del told["instrument_height_m"]  # which is what a page leaves out
    return change_of(CHANGE.validate_python(json.loads(json.dumps(told))))


def test_every_change_of_the_library_has_its_document() -> None:
    union, _ = get_args(ChangeDocument)
    documents = {get_args(model.model_fields["kind"].annotation)[0]: model for model in get_args(union)}
    assert set(documents) == set(KINDS)
    for kind, model in documents.items():
        fields = {field.name for field in dataclasses.fields(KINDS[kind])}
        assert set(model.model_fields) - {"kind"} == fields, kind


@settings(max_examples=200, deadline=None)
@given(change=some_changes)
def test_a_change_is_the_same_after_it_went_over_the_wire(change: c.Change) -> None:
    assert over_the_wire(change) == change


@settings(max_examples=60, deadline=None)
@given(change=some_changes)
def test_inverses_go_over_the_wire_too(change: c.Change) -> None:
    context = c.Context(make_plan(), ANA, 1)
    review = apply(Review(), c.AddComment("x", id="C001"), context).review
    review = apply(review, c.LockStation("S001"), context).review
    try:
        applied = apply(review, change, context)
    except ReviewError:
        return
    back = over_the_wire(applied.inverse)
    assert apply(applied.review, back, context).review == review
    ReviewDocument.model_validate(json.loads(json.dumps(review_document(applied.review))))


def test_a_signature_that_is_put_back_is_the_one_that_was_there() -> None:
    signed = SignOff("Ana", ANA.time, "ab" * 32, 3, "go")
    assert over_the_wire(c.Sign("go", signed)) == c.Sign("go", signed)

"""What does not fit a document: one line, with the place, what is there, what was expected, what to do."""

from typing import Annotated, Any, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BeforeValidator, Field

from planner_core.documents import Document, Entries, Number, ShortEntries, Whole, YesNo, read_as, schema_text
from planner_core.errors import PlanFolderError, RequirementError


def _even(value: int) -> int:
    if value % 2:
        raise RequirementError(f"got {value}, expected an even one; add 1")
    return value


class Leg(ShortEntries):
    length_m: Number
    even: Annotated[int, BeforeValidator(_even)] = 2


class Way(Entries):
    """A way."""

    name: str = ""
    """What it is called."""
    legs: tuple[Leg, ...] = ()
    n_stops: Annotated[Whole, Field(ge=1)] = 1
    returns: YesNo = False
    kind: Literal["foot", "robot"] = "foot"
    by_floor: dict[str, Leg] | None = None
    place: list[Number] | Leg | None = None


class Loose(Document):
    start: Number


def read(value: Any) -> Way:
    return read_as(Way, value, "way.json: ", remedy="measure again", error=PlanFolderError)


def test_what_fits_is_read() -> None:
    way = read({"Name": "A", "legs": [{"length-m": 1}, 2.5], "N stops": 3, "by_floor": {"Level 1": {"length_m": 4}}})
    assert [leg.length_m for leg in way.legs] == [1.0, 2.5]
    assert (way.name, way.n_stops, (way.by_floor or {})["Level 1"].length_m) == ("A", 3, 4.0)
    assert read_as(Loose, {"start": 1, "new": "key"}, "", remedy="").start == 1.0


@pytest.mark.parametrize(
    ("value", "told"),
    [
        ([], "way.json: got [], expected keys with values; measure again"),
        ({"nam": 1}, "way.json: got the unknown entry 'nam', expected a known one; did you mean name?"),
        ({"Name": "a", "name": "b"}, "way.json: got name twice, expected it once; leave one out"),
        ({"name": 3}, "way.json: name: got 3, expected text; measure again"),
        ({"legs": "far"}, "way.json: legs: got 'far', expected a list; measure again"),
        ({"legs": [1, {}]}, "way.json: legs[1]: got no length_m, expected all that is needed; measure again"),
        ({"legs": [1, "x"]}, "way.json: legs[1]: got 'x', expected a finite number; measure again"),
        ({"legs": [float("inf")]}, "way.json: legs[0]: got inf, expected a finite number; measure again"),
        ({"legs": [True]}, "way.json: legs[0]: got True, expected a finite number; measure again"),
        ({"legs": [{"length_m": 1, "even": 3}]}, "way.json: legs[0].even: got 3, expected an even one; add 1"),
        ({"n_stops": 1.5}, "way.json: n_stops: got 1.5, expected a whole number; measure again"),
        ({"n_stops": 0}, "way.json: n_stops: got 0, expected 1 or more; measure again"),
        ({"returns": 1}, "way.json: returns: got 1, expected true or false; measure again"),
        ({"kind": "boat"}, "way.json: kind: got 'boat', expected 'foot' or 'robot'; measure again"),
        ({"by_floor": {"a\nb": None}}, r"way.json: by_floor.'a\nb': got None, expected a finite number; measure again"),
        ({"place": [1, "x"]}, "way.json: place[1]: got 'x', expected a finite number; measure again"),
    ],
)
def test_what_does_not_fit_is_told_in_one_line(value: Any, told: str) -> None:
    with pytest.raises(PlanFolderError) as caught:
        read(value)
    assert str(caught.value) == told


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)


@given(st.sampled_from(sorted(Way.model_fields)), JSON)
def test_any_value_is_read_or_refused_in_one_short_line(key: str, value: Any) -> None:
    try:
        read({key: value})
    except PlanFolderError as error:
        assert len(str(error).splitlines()) == 1
        assert len(str(error)) < 400


def test_schema_says_what_the_docstrings_say() -> None:
    text = schema_text(Way, "tlsplan:way:1")
    assert '"$id": "tlsplan:way:1"' in text
    assert '"description": "What it is called."' in text
    assert '"title"' not in text

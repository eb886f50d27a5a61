"""Patterns of names, and that no pattern takes for ever."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.scene.patterns import fits


@pytest.mark.parametrize(
    ("pattern", "name", "does"),
    [
        ("IfcWall*", "IfcWallStandardCase", True),
        ("IfcWall", "IfcWallStandardCase", False),
        ("ifcwall", "IfcWall", False),
        ("a*a", "a", False),
        ("*ab*b", "ab", False),
        ("a**a", "aa", True),
        ("*?", "", False),
        ("", "", True),
        ("a?c", "a\nc", True),
        ("[ab]", "a", False),
        ("[ab]*", "[ab] 1", True),
        ("a.c", "abc", False),
    ],
)
def test_stars_and_question_marks_stand_for_letters_and_nothing_else_does(pattern: str, name: str, does: bool) -> None:
    assert fits(pattern, name) == does


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(st.lists(st.text("ab", max_size=4), min_size=1, max_size=6), st.data())
def test_a_name_fits_itself_with_parts_of_it_left_open(parts: list[str], data: st.DataObject) -> None:
    name = "".join(parts)
    signs = [data.draw(st.sampled_from([part, "*", "?" * len(part)])) for part in parts]
    assert fits("".join(signs), name)


@pytest.mark.parametrize("pattern", ["*" * 60 + "x", "*a" * 50 + "x", "*a?" * 40 + "*x*", "a*" * 60 + "?x"])
def test_patterns_of_many_stars_come_to_an_end(pattern: str) -> None:
    assert not fits(pattern, "a" * 150)

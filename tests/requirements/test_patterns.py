"""Patterns of names: against `fnmatch`, and that no pattern takes for ever."""

from fnmatch import fnmatchcase

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from planner_core.requirements.patterns import fits


@settings(max_examples=500, deadline=None)
@given(pattern=st.text("ab.?*", max_size=9), name=st.text("ab.\n*", max_size=9))
@example("a*a", "a")
@example("*ab*b", "ab")
@example("a**a", "aa")
@example("*?", "")
@example("", "")
def test_names_fit_patterns_as_fnmatch_says(pattern: str, name: str) -> None:
    assert fits(pattern, name) == fnmatchcase(name, pattern)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.text("ab", max_size=4), min_size=1, max_size=6), st.data())
def test_a_name_fits_itself_with_parts_of_it_left_open(parts: list[str], data: st.DataObject) -> None:
    name = "".join(parts)
    signs = [data.draw(st.sampled_from([part, "*", "?" * len(part)])) for part in parts]
    assert fits("".join(signs), name)


class CountedName(str):
    """A name that counts how often a piece of it is looked at."""

    looks = 0

    def __getitem__(self, key: object) -> str:
        self.looks += 1
        return super().__getitem__(key)  # type: ignore[index]


@pytest.mark.parametrize("pattern", ["*" * 60 + "x", "*a" * 50 + "x", "*a?" * 40 + "*x*", "a*" * 60 + "?x"])
def test_patterns_of_many_stars_look_at_each_place_once(pattern: str) -> None:
    name = CountedName("a" * 150)
    assert not fits(pattern, name)
    assert name.looks <= len(pattern) + len(name)

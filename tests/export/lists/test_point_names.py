"""Names that fit: short, plain, each once, and those that fit already left alone."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.errors import ExportError
from planner_core.export.point_names import fitted_names, plain_text

NAMES = st.lists(st.text(max_size=24), min_size=1, max_size=30, unique=True)


@given(ids=NAMES, limit=st.integers(3, 16))
def test_names_fit_and_differ_whatever_the_ids(ids: list[str], limit: int) -> None:
    names, remarks = fitted_names(ids, what="GSI-8", limit=limit, allowed="[A-Za-z0-9]")
    assert len(set(names)) == len(ids)
    for name in names:
        assert re.fullmatch(f"[A-Za-z0-9]{{1,{limit}}}", name)
    for before, after in zip(ids, names, strict=True):
        if re.fullmatch(f"[A-Za-z0-9]{{1,{limit}}}", before):
            assert after == before
    assert bool(remarks) == (tuple(ids) != names)


def test_the_end_of_a_long_name_stays() -> None:
    names, remarks = fitted_names(["building-A-level-2-S017"], what="GSI-8", limit=8, allowed=r"[\w-]")
    assert names == ("l-2-S017",)
    assert remarks == ("GSI-8 takes names of 8 plain characters: building-A-level-2-S017 is l-2-S017",)


def test_a_shortened_name_gives_way_to_one_that_has_it() -> None:
    names, _ = fitted_names(["hall-S0000001", "S0000001", "yard-S0000001"], what="list", limit=8)
    assert names == ("S0000002", "S0000001", "S0000003")


def test_the_same_id_twice_is_refused() -> None:
    with pytest.raises(ExportError, match="'S1' occurs twice"):
        fitted_names(["S1", "S2", "S1"], what="GSI-8", limit=8)


@pytest.mark.parametrize(
    ("text", "plain"),
    [("Erdgeschoß", "Erdgeschoss"), ("Étage à côté", "Etage a cote"), ("Łódź", "Lodz"), ("階1", "?1")],
)
def test_plain_text_keeps_what_ascii_can(text: str, plain: str) -> None:
    assert plain_text(text) == plain

"""What the summary says of bounds."""

import re
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tlsplan.summary import _bound


def printed_percent(bound: float) -> str:
    text = _bound({"objective": "most coverage", "bound": bound})
    return re.fullmatch(r", no plan with so many covers more than ([\d.]+) %", text)[1]


@given(st.integers(0, 10**9))
def test_bound_on_coverage_is_never_printed_lower_than_it_is(billionths):
    shown = Fraction(printed_percent(billionths / 10**9))
    exact = Fraction(billionths, 10**7)
    assert exact <= shown < exact + Fraction(1, 10)


@pytest.mark.parametrize(("bound", "shown"), [(0.9412, "94.2"), (0.942, "94.2"), (0.951, "95.1"), (1.0, "100.0")])
def test_bound_on_coverage_has_one_digit_more_only_where_it_is_needed(bound, shown):
    assert printed_percent(bound) == shown

"""Words of links against angles in plan; the same table of words as the viewer's test has."""

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.network.weak_motion import overlap_percent, overlap_share, weak_motion

BEARING_DEG = {"N–S": 0.0, "NE–SW": 45.0, "E–W": 90.0, "NW–SE": 135.0}


@pytest.mark.parametrize(
    ("weak_axis", "words"),
    [
        ("slides along x", "shift E–W"),
        ("slides along y", "shift N–S"),
        ("slides along 30 degrees from x to y", "shift NE–SW"),
        ("slides along 20 degrees from x to y", "shift E–W"),
        ("slides along 150 degrees from x to y", "shift NW–SE"),
        ("slides along the vertical", "shift up–down"),
        ("slides along (0.77, 0.00, -0.64)", "shift on a slope"),
        ("turns about the vertical", "turn (heading)"),
        ("tilts about x", "tilt about E–W"),
        ("tilts about y", "tilt about N–S"),
        ("tilts about 134 degrees from x to y", "tilt about NW–SE"),
        ("tilts about 179 degrees from x to y", "tilt about E–W"),
        ("tilts about (0.00, 0.77, 0.64)", "turn about a slope"),
        ("tilts about (0.10, 0.10, 0.99)", "turn (heading)"),
        ("tilts about (0.70, 0.70, 0.10)", "tilt about NE–SW"),
        ("", ""),
        ("wobbles", "wobbles"),
    ],
)
def test_weak_motion_is_told_as_in_the_viewer(weak_axis: str, words: str) -> None:
    told = weak_motion(weak_axis)
    assert told.words == words
    assert told.by_compass == any(line in words for line in BEARING_DEG)


@given(st.integers(0, 179), st.floats(-720.0, 720.0))
def test_line_that_is_named_is_the_nearest_of_four_from_any_north(angle_deg: int, north_deg: float) -> None:
    told = weak_motion(f"tilts about {angle_deg} degrees from x to y", north_rad=math.radians(north_deg))
    named_deg = BEARING_DEG[told.words.removeprefix("tilt about ")]
    off_deg = abs(math.remainder(named_deg + north_deg - (90 - angle_deg), 180.0))
    assert off_deg <= 22.5 + 1e-6


@pytest.mark.parametrize(
    ("weak_axis", "words"),
    [
        ("slides along x", "shift along x"),
        ("tilts about y", "tilt about y"),
        ("tilts about 134 degrees from x to y", "tilt about the line 44° from y to -x"),
        ("slides along 30 degrees from x to y", "shift along the line 60° from y to x"),
        ("turns about the vertical", "turn (heading)"),
    ],
)
def test_weak_motion_is_told_by_axes_where_no_north_is_known(weak_axis: str, words: str) -> None:
    told = weak_motion(weak_axis, north_rad=None)
    assert (told.words, told.by_compass) == (words, False)


@given(st.floats(0.0, 1.0))
def test_overlap_is_rounded_down_to_tenths_of_a_percent(overlap: float) -> None:
    told = Fraction(overlap_percent(overlap))
    # A float's shortest decimal is within half a unit in its last place.
    assert told <= 100 * Fraction(overlap) + Fraction(1, 10**13)
    assert 100 * Fraction(overlap) < told + Fraction(1, 10) + Fraction(1, 10**13)


@pytest.mark.parametrize(
    ("overlap", "told"),
    [
        (0.289, "28.9"),
        (0.3, "30.0"),
        (0.29999, "29.9"),
        (0.07966046, "7.9"),
        (1.0, "100.0"),
        (0.0, "0.0"),
        (1e-9, "0.0"),
    ],
)
def test_overlap_of_whole_tenths_stays_and_what_is_short_never_reads_as_enough(overlap: float, told: str) -> None:
    assert overlap_percent(overlap) == told


@given(st.floats(0.0, 1.0), st.integers(3, 9))
def test_overlap_of_few_decimals_is_the_largest_that_is_no_more(overlap: float, decimals: int) -> None:
    told, exact = overlap_share(overlap, decimals), Fraction(repr(overlap))
    assert 0 <= exact - Fraction(repr(told)) < Fraction(1, 10**decimals)
    assert round(told, decimals) == told

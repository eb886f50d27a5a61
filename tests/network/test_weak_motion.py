"""Words of links against angles in plan; the same table of words as the viewer's test has."""

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.model import WeakMotion
from planner_core.network.weak_motion import motion_words, overlap_percent, overlap_share

BEARING_DEG = {"N–S": 0.0, "NE–SW": 45.0, "E–W": 90.0, "NW–SE": 135.0}


X, Y, VERTICAL = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def level(angle_deg: float) -> tuple[float, float, float]:
    return math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg)), 0.0


@pytest.mark.parametrize(
    ("motion", "words"),
    [
        (WeakMotion("shift", X), "shift E–W"),
        (WeakMotion("shift", Y), "shift N–S"),
        (WeakMotion("shift", level(30)), "shift NE–SW"),
        (WeakMotion("shift", level(20)), "shift E–W"),
        (WeakMotion("shift", level(150)), "shift NW–SE"),
        (WeakMotion("shift", VERTICAL), "shift up–down"),
        (WeakMotion("shift", (0.77, 0.00, -0.64)), "shift on a slope"),
        (WeakMotion("turn", VERTICAL), "turn (heading)"),
        (WeakMotion("turn", X), "tilt about E–W"),
        (WeakMotion("turn", Y), "tilt about N–S"),
        (WeakMotion("turn", level(134)), "tilt about NW–SE"),
        (WeakMotion("turn", level(179)), "tilt about E–W"),
        (WeakMotion("turn", (0.00, 0.77, 0.64)), "turn about a slope"),
        (WeakMotion("turn", (0.10, 0.10, 0.99)), "turn (heading)"),
        (WeakMotion("turn", (0.70, 0.70, 0.10)), "tilt about NE–SW"),
        (None, ""),
    ],
)
def test_weak_motion_is_told_as_in_the_viewer(motion: WeakMotion | None, words: str) -> None:
    assert motion_words(motion) == words
    by_compass = any(line in words for line in BEARING_DEG)
    assert motion_words(motion, of_north=", north being +y") == words + (", north being +y" if by_compass else "")


@given(st.integers(0, 179), st.floats(-720.0, 720.0))
def test_line_that_is_named_is_the_nearest_of_four_from_any_north(angle_deg: int, north_deg: float) -> None:
    told = motion_words(WeakMotion("turn", level(angle_deg)), north_rad=math.radians(north_deg))
    named_deg = BEARING_DEG[told.removeprefix("tilt about ")]
    off_deg = abs(math.remainder(named_deg + north_deg - (90 - angle_deg), 180.0))
    assert off_deg <= 22.5 + 1e-6


@pytest.mark.parametrize(
    ("motion", "words"),
    [
        (WeakMotion("shift", X), "shift along x"),
        (WeakMotion("turn", Y), "tilt about y"),
        (WeakMotion("turn", level(134)), "tilt about the line 44° from y to -x"),
        (WeakMotion("shift", level(30)), "shift along the line 60° from y to x"),
        (WeakMotion("turn", VERTICAL), "turn (heading)"),
    ],
)
def test_weak_motion_is_told_by_axes_where_no_north_is_known(motion: WeakMotion, words: str) -> None:
    assert motion_words(motion, north_rad=None, of_north=", north being +y") == words


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

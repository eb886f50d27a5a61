"""The two feet, against figures worked out by hand from their definitions."""

import numpy as np
import pytest

from planner_core.model import FOOT, METRE, US_SURVEY_FOOT, LengthUnit
from planner_core.model.site_frame import feet_and_inches, unit_named, unit_of_size


def test_the_two_feet_differ_by_two_millionths_which_is_1_2_metres_at_two_million_feet() -> None:
    assert US_SURVEY_FOOT.metres / FOOT.metres - 1 == pytest.approx(2e-6, rel=1e-3)
    # 2 000 000 ft are 609 600 m; 2 000 000 ftUS are 2 400 000 000 / 3937 m = 609 601.2192 m.
    assert 2e6 * FOOT.metres == pytest.approx(609_600.0, abs=1e-6)
    assert 2e6 * US_SURVEY_FOOT.metres == pytest.approx(609_601.2192, abs=1e-4)


def test_lengths_go_there_and_back() -> None:
    assert US_SURVEY_FOOT.of(1200.0) == pytest.approx(3937.0, rel=1e-15)
    np.testing.assert_allclose(FOOT.of_array(np.array([0.3048, 3.048])), [1.0, 10.0], rtol=1e-15)
    assert METRE.of(1.5) == 1.5
    assert FOOT.text(1.524, 2) == "5.00 ft"


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("ftUS", US_SURVEY_FOOT),
        ("US Survey Foot", US_SURVEY_FOOT),
        ("US_Survey_Feet", US_SURVEY_FOOT),
        ("U.S. survey foot", US_SURVEY_FOOT),
        ("us-ft", US_SURVEY_FOOT),
        ("FOOT", FOOT),
        ("feet", FOOT),
        ("metre", METRE),
        ("Meter", METRE),
        ("clarke's foot", None),
        ("", None),
    ],
)
def test_units_are_known_by_the_names_that_files_use(name: str, unit: LengthUnit | None) -> None:
    assert unit_named(name) is unit


def test_units_are_known_by_their_size_and_the_feet_told_apart() -> None:
    assert unit_of_size(0.304800609601219) is US_SURVEY_FOOT  # as EPSG and most IFC files write it
    assert unit_of_size(0.3048) is FOOT
    assert unit_of_size(0.3047972654) is None  # Clarke's


@pytest.mark.parametrize(
    ("metres", "words"),
    [
        (1.6002, "5' 3\""),
        (1.6129, "5' 3 1/2\""),
        (1.5, "4' 11\""),  # 59.055 in
        (0.0, "0' 0\""),
        (0.3047, "1' 0\""),  # 11.996 in, rounded up to a foot
        (0.01905, "0' 0 3/4\""),
        (-1.6002, "-5' 3\""),
        (float("nan"), "not known"),
    ],
)
def test_lengths_in_feet_and_inches(metres: float, words: str) -> None:
    assert feet_and_inches(metres) == words

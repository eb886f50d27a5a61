"""Figures with units, against figures worked out by hand; what could be misread is refused."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.errors import RequirementError
from planner_core.model import FOOT
from planner_core.requirements.quantities import angle_rad, coordinate_m, count, length_m, plain_number, share


def spacing(value: object) -> float:
    return length_m(value, bare=(0.0, 0.1), most=1.0, example="6 mm")


@pytest.mark.parametrize(
    ("text", "metres"),
    [
        ("6 mm", 0.006),
        ("6mm", 0.006),
        (" 6  MM ", 0.006),
        ("6,5 mm", 0.0065),
        ("0.6 cm", 0.006),
        ("500 µm", 0.0005),
        ("500 um", 0.0005),
        ("6e-3 m", 0.006),
        (".006 m", 0.006),
        ("6 millimetres", 0.006),
        ("6 millimeter", 0.006),
        ("0.25 in", 0.00635),
        ("1 foot", 0.3048),
        (0.006, 0.006),
        ("0.006", 0.006),
    ],
)
def test_lengths_are_metres(text: object, metres: float) -> None:
    assert spacing(text) == pytest.approx(metres, rel=1e-12)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (6, "got 6, expected a length with its unit, such as 6 mm; say whether it is mm or m"),
        ("6", "with its unit"),
        (0.5, "with its unit"),
        ("1,000 mm", "write it without a comma"),
        ("6 furlongs", "its unit 'furlongs' is not known"),
        ("6 deg", "its unit 'deg' is not known"),
        ("-6 mm", "more than 0"),
        (0.0, "more than 0"),
        ("6 m", "at most 1 m"),
        ("six mm", "write a number and its unit"),
        ("6 mm or so", "not known"),
        ("6 6 mm", "not known"),
        ("", "a length such as"),
        (True, "a length such as"),
        (None, "a length such as"),
        ([6, "mm"], "a length such as"),
        (float("nan"), "finite"),
        (float("inf"), "finite"),
        (10**400, "finite"),
        ("1e999 mm", "finite"),
        ("6 mm\nspacing: 7 mm", "not known"),
    ],
)
def test_lengths_that_could_be_misread_are_refused_in_one_line(value: object, message: str) -> None:
    with pytest.raises(RequirementError, match=message) as caught:
        spacing(value)
    assert str(caught.value).startswith("got ")
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize(
    ("text", "degrees"),
    [
        ("65 deg", 65),
        ("65°", 65),
        (65, 65),
        ("65 degrees", 65),
        ("1 rad", 57.29577951308232),
        ("50 gon", 45),
        (90, 90),
        ("100 gon", 90),
    ],
)
def test_angles_are_radians(text: object, degrees: float) -> None:
    found = angle_rad(text)
    assert math.degrees(found) == pytest.approx(degrees, rel=1e-12)
    assert found <= math.pi / 2


@pytest.mark.parametrize("value", [1, 1.2, 2, "1.2", 0, -5, 91, "91 deg", "100 %", "2 rad"])
def test_angles_that_may_be_degrees_or_radians_are_refused(value: object) -> None:
    with pytest.raises(RequirementError, match=r"^got "):
        angle_rad(value)


@pytest.mark.parametrize(
    ("text", "fraction"),
    [
        ("95 %", 0.95),
        ("95%", 0.95),
        (95, 0.95),
        (0.95, 0.95),
        ("0.95", 0.95),
        ("95 percent", 0.95),
        (100, 1.0),
        ("100 %", 1.0),
        ("1 %", 0.01),
        (2, 0.02),
        ("99,5 %", 0.995),
    ],
)
def test_shares_are_fractions(text: object, fraction: float) -> None:
    assert share(text) == fraction


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (1, "write 1 % or 100 %"),
        ("1", "write 1 % or 100 %"),
        (1.0, "write 1 % or 100 %"),
        ("0.95 %", "expected a share such as 95 %; give 95 for 95 %$"),
        ("101 %", "to 100 %"),
        (101, "to 100 %"),
        (0, "more than 0"),
        (-0.5, "more than 0"),
        ("95 mm", "not known"),
        (False, "a share such as"),
    ],
)
def test_shares_that_could_be_misread_are_refused(value: object, message: str) -> None:
    with pytest.raises(RequirementError, match=message):
        share(value)


@given(st.integers(2, 100))
def test_a_percentage_is_the_float_that_its_decimal_is(percent: int) -> None:
    assert share(f"{percent} %") == share(percent) == float(f"{percent / 100:.2f}")


def test_no_share_at_all_will_do_where_it_may() -> None:
    assert share(0, zero=True) == share("0 %", zero=True) == 0.0


def test_counts_are_whole() -> None:
    assert count(2) == count("2") == count(2.0) == 2
    for wrong in (0, -1, 1.5, 101, True, "2 stations", None):
        with pytest.raises(RequirementError, match="a whole number"):
            count(wrong)


@pytest.mark.parametrize(
    ("text", "metres"),
    [
        # By hand: 1 in is 0.0254 m, 1 ft is 12 of them, and 3937 ftUS are 1200 m.
        ("2ft", 0.6096),
        ("18in", 0.4572),
        ('18"', 0.4572),
        ("5 ft 3 in", 1.6002),
        ("5ft3in", 1.6002),
        ("5' 3\"", 1.6002),
        ("5'-3\"", 1.6002),
        ("5 FEET 3 INCHES", 1.6002),
        ("5' 3 1/2\"", 1.6129),
        ("5' 3-1/2\"", 1.6129),
        ("5 ft 1/2 in", 1.5367),
        ("5 ft 3.5 in", 1.6129),
        ("3/4 in", 0.01905),
        ("2 1/2 in", 0.0635),
        ("-5 ft 3 in", -1.6002),
        ("3937 ftUS", 1200.0),
        ("3937 US survey feet", 1200.0),
        ("3937 ft", 1199.9976),
    ],
)
def test_feet_and_inches_are_metres(text: str, metres: float) -> None:
    assert coordinate_m(text) == pytest.approx(metres, rel=1e-12)


@pytest.mark.parametrize("text", ["5 ft 12 in", "5.5 ft 3 in", "3/0 in", "5 ft 3", "1/2 ft", "5 in 3 ft"])
def test_feet_and_inches_that_are_none_are_refused(text: str) -> None:
    with pytest.raises(RequirementError, match=r"^got .*expected a number of metres; "):
        coordinate_m(text)


def test_bare_coordinates_are_in_the_unit_of_the_place() -> None:
    assert coordinate_m("1000", unit=FOOT) == pytest.approx(304.8, rel=1e-12)
    assert coordinate_m("1000 m", unit=FOOT) == 1000.0


def test_plain_numbers_and_coordinates() -> None:
    assert plain_number("0.01", least=0, most=1) == 0.01
    with pytest.raises(RequirementError, match="from 0 to 1"):
        plain_number(2, least=0, most=1)
    assert [coordinate_m(value) for value in (-3, "2.5 m", "250 cm", 0)] == [-3.0, 2.5, 2.5, 0.0]
    with pytest.raises(RequirementError, match="metres"):
        coordinate_m("east")

"""Overlap of circles against areas of polygons with many sides, and the printed formula where it holds."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Point

from planner_core.paper.circle_overlap import shared_area_m2, shared_fraction

#: Sides of a quarter of a polygon; its area is short of its circle's by this share.
QUARTER = 256
SHORT = 1 - np.sin(np.pi / 2 / QUARTER) / (np.pi / 2 / QUARTER)
metres = st.floats(0.05, 20.0)


def by_polygons(d: float, r: float, s: float) -> float:
    return Point(0, 0).buffer(r, quad_segs=QUARTER).intersection(Point(d, 0).buffer(s, quad_segs=QUARTER)).area


@settings(max_examples=40, deadline=None)
@given(d=st.floats(0.0, 45.0), r=metres, s=metres)
def test_shared_area_is_that_of_polygons_of_many_sides(d, r, s):
    expected = by_polygons(d, r, s)
    # Each polygon is short by `SHORT` of its circle; what they share, by no more than both of that.
    slack = SHORT * np.pi * (r * r + s * s) + 1e-9
    assert abs(float(shared_area_m2(d, r, s)) - expected) <= slack, (d, r, s)


@given(d=st.floats(0.0, 45.0), r=metres, s=metres)
def test_shared_area_is_symmetric_and_no_larger_than_the_smaller_circle(d, r, s):
    area = float(shared_area_m2(d, r, s))
    assert area == pytest.approx(float(shared_area_m2(d, s, r)), rel=1e-9, abs=1e-9)
    assert 0.0 <= area <= np.pi * min(r, s) ** 2 * (1 + 1e-12)


def test_printed_formula_for_equal_radii_is_met_from_one_place_to_touching() -> None:
    r, d = 5.0, np.linspace(0.0, 10.0, 101)
    printed = 2 * (r**2 * np.arccos(d / (2 * r)) - d / 2 * np.sqrt(r**2 - (d / 2) ** 2))
    np.testing.assert_allclose(shared_area_m2(d, r, r), printed, atol=1e-12 * r * r)
    np.testing.assert_allclose(shared_fraction(d, r, r), printed / (np.pi * r * r), atol=1e-12)


@pytest.mark.parametrize(
    ("d", "r", "s", "area"),
    [
        (0.0, 2.0, 2.0, np.pi * 4),
        (0.0, 2.0, 1.0, np.pi),
        (1.0, 3.0, 2.0, np.pi * 4),  # touches from inside
        (0.5, 3.0, 2.0, np.pi * 4),
        (5.0, 3.0, 2.0, 0.0),  # touches from outside
        (50.0, 3.0, 2.0, 0.0),
        # 3, 4, 5: the circles meet at right angles, sectors less the kite
        (5.0, 3.0, 4.0, 9 * np.arctan2(4, 3) + 16 * np.arctan2(3, 4) - 12),
    ],
)
def test_shared_area_at_the_extremes_is_known(d: float, r: float, s: float, area: float) -> None:
    assert float(shared_area_m2(d, r, s)) == pytest.approx(area, abs=1e-12)
    assert float(shared_fraction(d, r, s)) == pytest.approx(area / (np.pi * r * r), abs=1e-12)


def test_printed_formula_has_no_value_for_one_circle_in_another() -> None:
    d, r, s = 0.5, 3.0, 2.0
    d_i = (d * d + r * r - s * s) / (2 * d)
    with np.errstate(invalid="ignore"):
        assert np.isnan(np.arccos(d_i / r))
    assert float(shared_area_m2(d, r, s)) == pytest.approx(np.pi * s * s)

"""Hatching against shapely: how long its lines are in an area, and what is taken off them."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.plan_folder.drawing.hatching import Family, spans_of_rings, spans_of_triangles, without

_COORDINATE = st.floats(-5.0, 5.0).map(lambda value: round(value, 3))
_TRIANGLE = st.lists(st.tuples(_COORDINATE, _COORDINATE), min_size=3, max_size=3)
_TRIANGLES = st.lists(_TRIANGLE, min_size=1, max_size=6)
#: At no angle of the sides below: whether a line along a side is inside is a matter of rounding.
_FAMILY = st.builds(Family, st.floats(0.2, 2.0), st.floats(0.05, 0.75))
_FEW = settings(max_examples=40, deadline=None)
_SQUARE = np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)])


def _area(triangles: list) -> shapely.Geometry:
    return shapely.union_all([shapely.Polygon(each) for each in triangles if shapely.Polygon(each).area > 1e-6])


def _hatched(area: shapely.Geometry, family: Family) -> float:
    """Length of the family's lines in an area, line by line."""
    reach = 12.0
    n = math.ceil(reach / family.step_m)
    feet = family.across * (np.arange(-n, n + 1) * family.step_m)[:, None]
    ends = np.stack([feet - reach * family.along, feet + reach * family.along], axis=1)
    return float(shapely.length(shapely.intersection(area, shapely.linestrings(ends))).sum())


def _length(lines: np.ndarray) -> float:
    return float(np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum())


@pytest.mark.slow
@_FEW
@given(triangles=_TRIANGLES, family=_FAMILY)
def test_hatching_is_as_long_as_the_lines_in_the_union(triangles: list, family: Family) -> None:
    made = spans_of_triangles(np.array(triangles), family).lines(family)
    assert abs(_length(made) - _hatched(_area(triangles), family)) <= 1e-3


@pytest.mark.slow
@_FEW
@given(triangles=_TRIANGLES, others=_TRIANGLES, family=_FAMILY)
def test_what_is_taken_off_is_what_both_have(triangles: list, others: list, family: Family) -> None:
    both, some = np.array(triangles + others), np.array(others)
    left = without(spans_of_triangles(both, family), spans_of_triangles(some, family))
    expected = _length(spans_of_triangles(both, family).lines(family)) - _length(
        spans_of_triangles(some, family).lines(family)
    )
    assert abs(_length(left.lines(family)) - expected) < 1e-3


@_FEW
@given(family=_FAMILY)
def test_ring_in_a_ring_is_a_hole(family: Family) -> None:
    hole = _SQUARE / 2 + 1
    made = spans_of_rings([[_SQUARE, hole]], family).lines(family)
    expected = _hatched(shapely.Polygon(_SQUARE, [hole]), family)
    assert math.isclose(_length(made), expected, rel_tol=1e-9)


def test_overlapping_solids_are_joined() -> None:
    family = Family(0.7, 0.3)
    made = spans_of_rings([[_SQUARE], [_SQUARE + 2.0]], family).lines(family)
    both = shapely.union(shapely.Polygon(_SQUARE), shapely.Polygon(_SQUARE + 2.0))
    assert math.isclose(_length(made), _hatched(both, family), rel_tol=1e-9)


def test_neighbours_are_hatched_by_the_same_lines() -> None:
    family = Family(0.31, math.pi / 4)
    halves = np.array([_SQUARE[[0, 1, 2]], _SQUARE[[0, 2, 3]]])
    whole = spans_of_triangles(halves, family)
    assert len(whole.line) == len(np.unique(whole.line))


def test_nothing_has_no_lines() -> None:
    family = Family(1.0, 0.0)
    empty = spans_of_triangles(np.zeros((0, 3, 2)), family)
    some = spans_of_rings([[_SQUARE]], family)
    assert empty.lines(family).shape == (0, 2, 2)
    assert spans_of_rings([], family).lines(family).shape == (0, 2, 2)
    assert _length(without(some, empty).lines(family)) == _length(some.lines(family)) > 0
    assert without(some, some).line.size == 0

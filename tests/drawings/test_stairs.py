"""Flights of stairs between the plans of two storeys."""

import numpy as np
import pytest
import shapely

from planner_core.drawings.stairs import flights_between, treads_of, unclear_stairs


def treads(begin, n, going=0.27, x=1.0, width=1.1, nosing=0.0):
    at = begin + going * np.arange(n)
    rows = [np.array([(x, y), (x + width, y)]) for y in at]
    return [*rows, *(row + np.array([0.0, nosing]) for row in rows if nosing)]


def test_rows_of_even_lines_are_treads():
    (found,) = treads_of([*treads(2.0, 8, nosing=0.03), np.array([(5.0, 0.0), (9.0, 0.0)])])
    assert found.area.bounds == pytest.approx((1.0, 2.0, 2.1, 2.0 + 7 * 0.27), abs=0.031)
    assert treads_of(treads(2.0, 2)) == []
    assert treads_of(treads(2.0, 8, going=0.9)) == []


@pytest.mark.parametrize("up", [True, False])
def test_both_plans_show_which_way_a_flight_rises(up):
    """The lower plan shows five treads from the foot, the upper one all or those at the head."""
    lower = treads_of(treads(2.0 if up else 4.16, 5))
    whole, head = treads_of(treads(2.0, 13)), treads_of(treads(4.43 if up else 2.0, 4))
    for upper in (whole, head):
        (flight,) = flights_between(lower, upper)
        assert np.sign(flight.along[1]) == (1 if up else -1)
        assert flight.area.bounds == pytest.approx((1.0, 2.0, 2.1, 5.24), abs=1e-6)
        foot = shapely.box(1.0, 2.0, 2.1, 2.1) if up else shapely.box(1.0, 5.14, 2.1, 5.24)
        assert shapely.distance(shapely.Point(flight.foot), foot) < 1e-6


def test_stairs_of_one_plan_alone_are_no_flight():
    assert flights_between(treads_of(treads(2.0, 8)), []) == []
    assert flights_between(treads_of(treads(2.0, 8)), treads_of(treads(2.0, 8, x=6.0))) == []


def test_lines_of_stairs_without_a_straight_flight_are_named():
    angles = np.linspace(0.0, 4.0, 12)
    winding = [np.array([(0.2 * np.cos(a), 0.2 * np.sin(a)), (1.2 * np.cos(a), 1.2 * np.sin(a))]) for a in angles]
    (line,) = unclear_stairs(winding, "a.dxf")
    assert line.startswith("a.dxf: its stairs (12 lines) have no straight flight of 3 treads and are left out")
    assert unclear_stairs([*winding, *treads(2.0, 8)], "a.dxf") == ()
    assert unclear_stairs([], "a.dxf") == ()

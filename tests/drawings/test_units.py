"""The unit of a drawing, judged by its doors and walls."""

import math

import numpy as np
import pytest

from planner_core.drawings.arcs import SwingArc, swing_arcs
from planner_core.drawings.units import DrawnSizes, drawn_sizes, unit_of
from planner_core.errors import SceneError


def arc(radius, sweep=90.0, begin=0.0, n=9, centre=(3.0, 4.0)):
    angle = np.deg2rad(np.linspace(begin, begin + sweep, n))
    return np.asarray(centre) + radius * np.column_stack([np.cos(angle), np.sin(angle)])


def test_swings_are_quarter_circles():
    leaf_and_arc = np.concatenate([[(3.0, 4.0)], arc(0.9)])
    straight = np.column_stack([np.arange(9.0), np.zeros(9)])
    found = swing_arcs([arc(0.9), leaf_and_arc, arc(0.9, sweep=360.0, n=30), straight, arc(0.9, sweep=20.0)])
    assert [round(each.radius, 6) for each in found] == [0.9, 0.9]
    assert found[0].centre == pytest.approx([3.0, 4.0])
    assert found[0].end == pytest.approx([3.0, 4.9])


def test_sizes_are_measured_in_the_drawing():
    walls = np.array(
        [[[0, 0], [5000, 0]], [[0, 240], [5000, 240]], [[0, 4000], [5000, 4000]], [[0, 4115], [5000, 4115]]]
    )
    swings = [SwingArc(np.zeros(2), np.zeros(2), np.zeros(2), radius) for radius in (800.0, 900.0, 1000.0)]
    sizes = drawn_sizes(walls.astype(float), swings, walls.reshape(-1, 2).astype(float))
    assert (sizes.door, sizes.extent) == (900.0, 5000.0)
    assert 115.0 <= sizes.wall <= 240.0
    rooms_between = drawn_sizes(walls[::2].astype(float), swings, walls.reshape(-1, 2).astype(float))
    assert math.isnan(rooms_between.wall)


@pytest.mark.parametrize(
    ("sizes", "unit_m"),
    [
        (DrawnSizes(900.0, 150.0, 12_000.0), 0.001),
        (DrawnSizes(90.0, 15.0, 1200.0), 0.01),
        (DrawnSizes(0.9, 0.15, 12.0), 1.0),
        (DrawnSizes(36.0, 6.0, 500.0), 0.0254),
        (DrawnSizes(3.0, 0.5, 40.0), 0.3048),
    ],
)
def test_unit_that_is_not_stated_follows_from_doors_and_walls_with_a_warning(sizes, unit_m):
    found, warnings = unit_of("a.dxf", sizes, stated_m=None, source="$INSUNITS")
    assert found == unit_m
    assert "a.dxf: it states no unit and is read in" in warnings[0]
    assert "pass --units" in warnings[0]


def test_stated_unit_is_believed_where_it_fits_and_refused_where_not():
    sizes = DrawnSizes(0.9, 0.15, 12.0)
    assert unit_of("a.dxf", sizes, stated_m=1.0, source="$INSUNITS") == (1.0, ())
    with pytest.raises(
        SceneError, match=r"by \$INSUNITS its unit is 0\.001 m .*pass its unit, such as --units m; in m it has doors 0"
    ):
        unit_of("a.dxf", sizes, stated_m=0.001, source="$INSUNITS")
    with pytest.raises(SceneError, match=r"--units mm; .*; where its walls are as thick as that, --units cm\."):
        unit_of("a.dxf", DrawnSizes(math.nan, 75.0, 28_000.0), stated_m=0.01, source="$INSUNITS")


def test_unit_that_nothing_decides_has_to_be_given():
    nothing = DrawnSizes(math.nan, math.nan, 12.0)
    assert unit_of("a.dxf", nothing, stated_m=0.01, source="$INSUNITS") == (0.01, ())
    with pytest.raises(SceneError, match=r"states no unit and no doors or walls decide.*--units"):
        unit_of("a.dxf", nothing, stated_m=None, source="$INSUNITS")

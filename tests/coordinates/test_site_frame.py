"""The frame itself: round trips with northings of millions, north, scale and words."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from planner_core.coordinates.frame import matrix_of
from planner_core.model import SiteFrame

POINTS = arrays(np.float64, (5, 3), elements=st.floats(-2000, 2000))


@given(
    points=POINTS,
    east=st.floats(-1e6, 1e6),
    north=st.floats(-1e7, 1e7),
    angle=st.floats(-math.pi, math.pi),
    scale=st.floats(0.995, 1.005),
)
def test_there_and_back_is_the_same_point_to_a_micrometre(
    points: np.ndarray, east: float, north: float, angle: float, scale: float
) -> None:
    frame = SiteFrame(matrix=matrix_of((east, north, 100.0), angle, scale), source="given epsg")
    assert np.abs(frame.to_scene(frame.to_site(points)) - points).max() < 1e-6
    assert np.abs(frame.to_site(frame.to_scene(frame.to_site(points))) - frame.to_site(points)).max() < 1e-6


def test_one_point_and_many_give_the_same() -> None:
    frame = SiteFrame(matrix=matrix_of((458_870, 5_438_260, 110), 0.4, 0.9996))
    points = np.array([[1.0, 2, 3], [40, 50, 6]])
    assert frame.to_site(points)[1].tolist() == frame.to_site(points[1]).tolist()
    assert frame.to_scene(points)[1] == pytest.approx(frame.to_scene(points[1]), abs=1e-9)
    assert frame.to_site(np.zeros((0, 3))).shape == (0, 3)


@given(angle=st.floats(-3.1, 3.1), scale=st.floats(0.995, 1.005))
def test_going_along_grid_north_in_the_scene_raises_the_northing_only(angle: float, scale: float) -> None:
    frame = SiteFrame(matrix=matrix_of((458_870, 5_438_260, 110), angle, scale), source="given epsg")
    clockwise = frame.grid_north_rad
    step = frame.to_site(np.array([math.sin(clockwise), math.cos(clockwise), 0.0])) - frame.to_site(np.zeros(3))
    assert step == pytest.approx([0.0, scale, 0.0], abs=1e-8)
    assert frame.horizontal_scale == pytest.approx(scale)


def test_scene_coordinates_know_true_north_where_the_file_tells_it() -> None:
    assert SiteFrame().grid_north_rad == 0.0
    told = SiteFrame(true_north_rad=0.5)
    assert told.grid_north_rad == 0.5
    assert told.is_scene


def test_a_frame_says_what_its_coordinates_are() -> None:
    assert SiteFrame().crs_line == "scene coordinates, no CRS"
    local = SiteFrame(name="local site coordinates", source="control points")
    assert local.crs_line == "local site coordinates, no CRS; vertical datum not given"
    utm = SiteFrame(
        crs="EPSG:25832", name="EPSG:25832 UTM", vertical_crs="EPSG:7837", vertical_name="DHHN2016", source="given epsg"
    )
    assert utm.crs_line == "EPSG:25832 UTM; heights DHHN2016"

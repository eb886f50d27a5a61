"""Ambient occlusion of drawn depths: planes are bright however they lie, corners are not, what lies far behind is."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.model import Float32Array, FloatArray
from planner_core.plan_folder import pictures as occlusion
from planner_core.plan_folder.pictures import DARKEST, brightness

WIDTH, HEIGHT = 240, 150
PIXELS_AT_1_M = 500.0
"""An eye 10 m away sees 50 pixels a metre."""


def plane_m(slope: tuple[float, float], distance_m: float) -> FloatArray:
    """(H, W) depths of the plane z = distance + slope . (x, y), as an eye in the origin sees it in perspective."""
    x, y = np.meshgrid((np.arange(WIDTH) - WIDTH / 2) / PIXELS_AT_1_M, (np.arange(HEIGHT) - HEIGHT / 2) / PIXELS_AT_1_M)
    return np.asarray(distance_m / (1.0 - slope[0] * x - slope[1] * y))


def light_of(depth_m: FloatArray) -> Float32Array:
    return brightness(depth_m.astype(np.float32), PIXELS_AT_1_M)


@given(slope=st.tuples(st.floats(-2, 2), st.floats(-2, 2)), distance_m=st.floats(6, 60))
def test_planes_are_bright_however_they_lie(slope: tuple[float, float], distance_m: float) -> None:
    assert light_of(plane_m(slope, distance_m)).min() > 0.999


def test_a_corner_is_darkest_at_its_foot_and_bright_beyond_the_widest_ring() -> None:
    # Floor and wall that both recede by 45 degrees from their common edge, up and down the picture's middle.
    light = light_of(np.minimum(plane_m((1.0, 0.0), 10.0), plane_m((-1.0, 0.0), 10.0)))
    row = light[HEIGHT // 2]
    assert DARKEST <= row.min() < 0.85
    assert abs(int(row.argmin()) - WIDTH // 2) <= 2
    assert row[[20, -20]].min() > 0.999
    assert (np.diff(row[WIDTH // 2 - 30 : WIDTH // 2 - 2]) < 1e-3).all()


def test_an_edge_that_sticks_out_is_bright() -> None:
    assert light_of(np.maximum(plane_m((1.0, 0.0), 10.0), plane_m((-1.0, 0.0), 10.0))).min() > 0.999


def test_what_stands_on_a_floor_darkens_it_and_what_is_far_above_it_does_not() -> None:
    dark = []
    for above_m in (0.3, 4.0):
        depth_m = plane_m((0.0, 0.0), 10.0)
        depth_m[60:90, 100:140] -= above_m
        light = light_of(depth_m)
        assert light[60:90, 100:140].min() > 0.999
        dark.append(float(light[75, 98]))
    assert dark[0] < 0.95
    assert dark[1] > 0.999


def test_nothing_is_as_bright_as_paper_and_hides_nothing() -> None:
    nothing = np.full((HEIGHT, WIDTH), np.inf)
    assert light_of(nothing).min() == 1.0
    half = plane_m((0.3, 0.2), 10.0)
    half[:, 100:] = np.inf
    assert light_of(half).min() > 0.999


def test_rows_at_once_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    depth_m = np.random.default_rng(1).uniform(9.5, 10.5, (HEIGHT, WIDTH))
    whole = light_of(depth_m)
    monkeypatch.setattr(occlusion, "_ROWS_AT_ONCE", 7)
    np.testing.assert_array_equal(light_of(depth_m), whole)

"""Outlines: what lies over one, against angle counts; which cross themselves; their areas by other means."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.positions.outlines import area_of_outline_m2, crossing_sides, over_polygon


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_points_over_a_polygon_are_those_it_winds_around(seed: int) -> None:
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0, 2 * np.pi, rng.integers(3, 12)))
    corners = rng.uniform(0.3, 2.0, angle.size)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = rng.uniform(-2, 2, (200, 2))
    to_corner = corners[None] - points[:, None]
    turned = np.arctan2(to_corner[..., 1], to_corner[..., 0])
    steps = (np.roll(turned, -1, axis=1) - turned + np.pi) % (2 * np.pi) - np.pi
    wound = np.abs(steps.sum(axis=1)) > np.pi
    np.testing.assert_array_equal(over_polygon(points, corners), wound)
    np.testing.assert_array_equal(over_polygon(points, corners[::-1]), wound)


def test_squares_side_by_side_share_no_point_and_lose_none() -> None:
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=float)
    points = np.stack(np.meshgrid(np.arange(0, 2, 0.25), np.arange(0, 2, 0.25)), axis=-1).reshape(-1, 2)
    total = sum(over_polygon(points, square + np.array([x, y])).astype(int) for x in (0, 1) for y in (0, 1))
    assert (total == 1).all()


@pytest.mark.parametrize(
    ("corners", "crossing"),
    [
        ([[0, 0], [1, 0], [1, 1], [0, 1]], None),
        ([[0, 0], [1, 1], [1, 0], [0, 1]], (0, 2)),
        ([[0, 0], [4, 0], [4, 4], [2, -1], [0, 4]], (0, 2)),
        ([[0, 0], [4, 0], [4, 4], [2, 1], [0, 4]], None),
        ([[0, 0], [1, 0], [0, 1]], None),
        ([[0, 0], [2, 0], [2, 2], [1, 0], [0, 2]], None),  # a corner on a side only touches it
    ],
)
def test_outlines_that_cross_themselves_are_found(corners: list[list[float]], crossing: tuple[int, int] | None) -> None:
    assert crossing_sides(np.array(corners, dtype=float)) == crossing


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_areas_are_those_of_the_triangles_around_the_middle_even_far_away(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 12))
    angle = (np.arange(n) + rng.uniform(0, 0.9, n)) * 2 * np.pi / n
    spoke = rng.uniform(0.3, 20.0, n)
    corners = spoke[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    turn = (np.roll(angle, -1) - angle) % (2 * np.pi)
    by_hand = 0.5 * (spoke * np.roll(spoke, -1) * np.sin(turn)).sum()
    assert area_of_outline_m2(corners) == pytest.approx(abs(by_hand), abs=1e-12)
    assert area_of_outline_m2(corners[::-1] + np.array([5e5, 5.4e6])) == pytest.approx(abs(by_hand), abs=1e-6)

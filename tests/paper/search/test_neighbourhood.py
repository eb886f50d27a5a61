"""The directions of Fig. 8 and their three-dimensional counterparts."""

from dataclasses import replace

import numpy as np
import pytest

from planner_core.model.spatial_search import SearchSettings
from planner_core.paper.search.neighbourhood import circle, cube, directions, sphere, square, undoing

ALL = [cube(), square(), circle(16), circle(6), sphere(16), sphere(42)]


def test_cube_has_six_faces_and_eight_corners() -> None:
    vectors = {tuple(v) for v in cube().tolist()}
    assert len(vectors) == 14
    assert sum(np.abs(v).sum() == 1 for v in cube()) == 6
    assert sum((np.abs(v) == 1).all() for v in cube()) == 8


def test_square_has_the_eight_neighbours_in_a_plane() -> None:
    expected = {(x, y, 0) for x in (-1, 0, 1) for y in (-1, 0, 1)} - {(0, 0, 0)}
    assert {tuple(v) for v in square().tolist()} == expected


def test_circle_divides_the_full_turn_evenly() -> None:
    angle = np.sort(np.arctan2(circle(16)[:, 1], circle(16)[:, 0]) % (2 * np.pi))
    np.testing.assert_allclose(np.diff(angle), np.pi / 8, atol=1e-12)
    assert (circle(16)[:, 2] == 0).all()


@pytest.mark.parametrize("n", [8, 16, 64, 200])
def test_sphere_is_even(n: int) -> None:
    """Directions are more than half a cap's radius apart, and none is two of them from all, with n caps the sphere."""
    vectors = sphere(n)
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1.0, atol=1e-12)
    cap_rad = np.arccos(1 - 2 / n)  # n caps of this radius have the sphere's area
    between = np.arccos(np.clip(vectors @ vectors.T, -1, 1)) + 4 * np.eye(n)
    anywhere = np.random.default_rng(1).normal(size=(5000, 3))
    anywhere /= np.linalg.norm(anywhere, axis=1)[:, None]
    assert between.min() > 0.5 * cap_rad
    assert np.arccos((anywhere @ vectors.T).max(axis=1).clip(-1, 1)).max() < 2 * cap_rad


@pytest.mark.parametrize("moves", ALL)
def test_exactly_the_opposite_direction_undoes_a_move(moves: np.ndarray) -> None:
    np.testing.assert_allclose(moves[::-1], -moves, atol=1e-12)
    np.testing.assert_array_equal(undoing(moves, 1e-6), np.eye(len(moves), dtype=bool)[::-1])


def test_a_wider_slack_forbids_near_reversals_too() -> None:
    forbidden = undoing(circle(16), 1 - np.cos(np.pi / 8) + 1e-6)
    np.testing.assert_array_equal(forbidden.sum(axis=1), 3)


def test_fixed_height_takes_the_flat_neighbourhood() -> None:
    for name, flat, spatial in (("cube", 8, 14), ("sphere", 10, 10)):
        options = SearchSettings(neighbourhood=name, n_directions=10)
        assert len(directions(options)) == spatial and directions(options)[:, 2].any()
        level = directions(replace(options, fixed_height=True))
        assert len(level) == flat and not level[:, 2].any()

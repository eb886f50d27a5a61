"""What an agent finds is its own affair: not its company's, not the batches', not the bounds' other side.

The directions of Fig. 8 and their three-dimensional counterparts.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.model.spatial_search import SearchSettings
from planner_core.paper.search import search
from planner_core.paper.search.agents import circle, cube, directions, sphere, square, undoing

BOUNDS = np.array([[-1.0, -1.0, 0.5], [1.0, 1.0, 2.0]])
METHODS = pytest.mark.parametrize("method", ["ls", "sa", "ts"])
OPTIONS = SearchSettings(initial_temperature=30.0, max_without_improvement=4, max_iterations=30)
ALL = [cube(), square(), circle(16), circle(6), sphere(16), sphere(42)]


def starts_of(seed: int, n: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(BOUNDS[0], BOUNDS[1], (n, 3))


class InPieces:
    """A fitness that judges positions a few at a time, in another order."""

    def __init__(self, fitness, size: int) -> None:
        self.fitness, self.size = fitness, size

    def evaluate(self, positions_m):
        order = np.random.default_rng(len(positions_m)).permutation(len(positions_m))
        parts = [self.fitness.evaluate(positions_m[order[k : k + self.size]]) for k in range(0, order.size, self.size)]
        back = np.argsort(order)
        return tuple(np.concatenate([part[k] for part in parts])[back] for k in range(3))


@pytest.mark.slow
@METHODS
@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 2**20), n=st.integers(1, 6), more=st.integers(1, 4), memoised=st.booleans())
def test_more_agents_change_nothing_for_those_before(method, seed, n, more, memoised, make_rugged) -> None:
    options = replace(OPTIONS, seed=seed, memoised=memoised)
    starts = starts_of(seed, n + more)
    few = search(method, starts[:n], make_rugged((0, 0, 1)), options, bounds_m=BOUNDS)
    many = search(method, starts, make_rugged((0, 0, 1)), options, bounds_m=BOUNDS)
    n_rows = few.history.f2.shape[0]
    np.testing.assert_array_equal(few.history.position_m, many.history.position_m[:n_rows, :n])
    np.testing.assert_array_equal(few.history.n_iterations, many.history.n_iterations[:n])
    np.testing.assert_array_equal(few.position_m, many.position_m[:n])
    np.testing.assert_array_equal(few.f2, many.f2[:n])


@pytest.mark.slow
@METHODS
def test_batches_change_nothing(method, make_rugged) -> None:
    starts = starts_of(7, 9)
    whole = search(method, starts, make_rugged((0, 0, 1)), OPTIONS, bounds_m=BOUNDS)
    pieces = search(method, starts, InPieces(make_rugged((0, 0, 1)), 3), OPTIONS, bounds_m=BOUNDS)
    np.testing.assert_array_equal(whole.history.position_m, pieces.history.position_m)
    np.testing.assert_array_equal(whole.f1, pieces.f1)
    assert (whole.n_evaluations, whole.n_hits) == (pieces.n_evaluations, pieces.n_hits)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["sa", "ts"])
def test_the_seed_decides(method, make_rugged) -> None:
    ways = [
        search(method, starts_of(7, 9), make_rugged((0, 0, 1)), replace(OPTIONS, seed=seed), bounds_m=BOUNDS).history
        for seed in (1, 1, 2)
    ]
    np.testing.assert_array_equal(ways[0].position_m, ways[1].position_m)
    assert (ways[0].position_m != ways[2].position_m).any()


@pytest.mark.slow
@METHODS
@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 2**20), neighbourhood=st.sampled_from(["cube", "sphere"]), memoised=st.booleans())
def test_agents_stand_at_valid_positions_inside_the_bounds_only(
    method, seed, neighbourhood, memoised, make_rugged
) -> None:
    options = replace(OPTIONS, seed=seed, neighbourhood=neighbourhood, memoised=memoised)
    terrain = make_rugged((1.5, 0, 1))  # outside
    history = search(method, starts_of(seed, 8), terrain, options, bounds_m=BOUNDS).history
    asked = np.concatenate(terrain.asked)
    assert (asked >= BOUNDS[0] - 2e-6).all() and (asked <= BOUNDS[1] + 2e-6).all()  # rounding of sums of steps
    stood = history.position_m.reshape(-1, 3)
    inside = ((stood >= BOUNDS[0] - 1e-6) & (stood <= BOUNDS[1] + 1e-6)).all(axis=1)
    valid, f1, f2 = terrain.evaluate(stood)
    valid &= inside
    np.testing.assert_array_equal(history.f2.ravel(), np.where(valid, f2, np.inf))
    np.testing.assert_array_equal(history.f1.ravel(), np.where(valid, f1, 0))
    # Once valid, always valid: only a start may not be.
    assert (np.isfinite(history.f2[1:]) | ~np.isfinite(history.f2[:-1])).all()


@pytest.mark.slow
@METHODS
def test_the_result_is_the_best_of_each_agents_way(method, make_rugged) -> None:
    found = search(method, starts_of(3, 20), make_rugged((0, 0, 1)), OPTIONS, bounds_m=BOUNDS)
    history = found.history
    for agent in range(20):
        order = np.lexsort((np.arange(len(history.f2)), -history.f1[:, agent], history.f2[:, agent]))
        best = order[0]
        assert (found.f2[agent], found.f1[agent]) == (history.f2[best, agent], history.f1[best, agent])
        np.testing.assert_array_equal(found.position_m[agent], history.position_m[best, agent])
    assert found.f2.mean() <= history.f2[0].mean()


@METHODS
def test_progress_is_told_and_what_it_raises_ends_the_search(method, make_rugged) -> None:
    events = []
    search(method, starts_of(3, 4), make_rugged((0, 0, 1)), OPTIONS, bounds_m=BOUNDS, progress=events.append)
    assert [event.stage for event in events] == ["search"] * len(events)
    assert [event.done for event in events] == sorted(event.done for event in events)
    assert (events[0].done, events[-1].done, events[-1].total) == (0, 30, 30)

    def stop(event):
        if event.done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        search(method, starts_of(3, 4), make_rugged((0, 0, 1)), OPTIONS, bounds_m=BOUNDS, progress=stop)


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

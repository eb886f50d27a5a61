"""Greedy local search on landscapes whose ends are known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.paper.search import SearchSettings, search

BOUNDS = np.array([[-2.0, -2.0, 0.0], [2.0, 2.0, 2.0]])


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(
    centre=st.tuples(st.floats(-0.9, 0.9), st.floats(-0.9, 0.9), st.floats(0.6, 1.4)),
    steps=st.tuples(st.integers(-15, 15), st.integers(-15, 15), st.integers(10, 25)),
    fixed_height=st.booleans(),
)
def test_a_bowl_ends_in_the_cell_of_its_minimum(centre, steps, fixed_height, make_terrain, make_bowl) -> None:
    options = SearchSettings(neighbourhood="cube", fixed_height=fixed_height, max_iterations=100)
    start = 0.05 * np.array(steps, dtype=float)
    found = search("ls", start[None], make_terrain(make_bowl(centre)), options, bounds_m=BOUNDS)
    off = np.abs(found.position_m[0] - centre)
    assert (off[:2] <= 0.025 + 1e-9).all(), found.position_m
    if fixed_height:
        assert found.position_m[0, 2] == pytest.approx(start[2])
    else:
        assert off[2] <= 0.025 + 1e-9


def test_the_way_down_a_bowl_is_the_shortest(make_terrain, make_bowl) -> None:
    # 8 and 3 steps off in the plane: 3 diagonal moves and 5 along x.
    options = SearchSettings(neighbourhood="cube", fixed_height=True)
    found = search("ls", np.array([[0.4, 0.15, 1.0]]), make_terrain(make_bowl((0, 0, 1))), options, bounds_m=BOUNDS)
    assert found.history.n_iterations.tolist() == [9]  # eight moves, and the look round that finds nothing better
    assert (np.diff(found.history.f2[:9, 0]) < 0).all()


def test_the_move_that_undoes_the_last_one_is_not_even_looked_at(make_terrain, make_bowl) -> None:
    options = SearchSettings(neighbourhood="cube", fixed_height=True, memoised=False)
    terrain = make_terrain(make_bowl((1.0, 0, 1)))
    search("ls", np.array([[0.5, 0.0, 1.0]]), terrain, options, bounds_m=BOUNDS)
    assert [len(batch) for batch in terrain.asked] == [1, 8, *[7] * 10]
    for k, batch in enumerate(terrain.asked[2:]):
        behind = [0.5 + 0.05 * k, 0.0, 1.0]  # where the agent came from
        assert np.abs(batch - behind).max(axis=1).min() > 0.04


def test_a_plateau_is_left_for_more_patches_only(make_terrain) -> None:
    # F2 is the same everywhere; F1 grows to the east up to x = 0.3.
    terrain = make_terrain(
        lambda p: np.full(len(p), 7.0), f1=lambda p: np.minimum(np.rint(p[:, 0] * 20), 6).astype(np.int64)
    )
    options = SearchSettings(neighbourhood="cube", fixed_height=True)
    found = search("ls", np.array([[0.0, 0.0, 1.0]]), terrain, options, bounds_m=BOUNDS)
    assert (found.f1[0], found.f2[0]) == (6, 7.0)
    assert found.position_m[0, 0] == pytest.approx(0.3)
    assert found.history.n_iterations[0] == 7


def test_an_invalid_start_goes_to_a_valid_neighbour_or_is_said_not_to_be_found(make_terrain, make_bowl) -> None:
    terrain = make_terrain(make_bowl((0.5, 0, 1)), valid=lambda p: p[:, 0] > 0.02)
    starts = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 1.0]])
    options = SearchSettings(neighbourhood="cube", fixed_height=True)
    found = search("ls", starts, terrain, options, bounds_m=BOUNDS)
    assert found.found.tolist() == [True, False]
    np.testing.assert_allclose(found.position_m, [[0.5, 0.0, 1.0], [-1.0, 0.0, 1.0]], atol=1e-9)
    assert np.isinf(found.history.f2[0]).all() and np.isinf(found.f2[1]) and found.f1[1] == 0


def test_no_agents_are_no_trouble(make_terrain, make_bowl) -> None:
    for method in ("ls", "sa", "ts"):
        found = search(method, np.empty((0, 3)), make_terrain(make_bowl((0, 0, 0))), bounds_m=BOUNDS)
        assert found.position_m.shape == (0, 3) and found.history.f2.shape[1] == 0 and found.n_evaluations == 0

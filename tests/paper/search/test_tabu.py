"""Tabu search: no voxel twice, and a new beginning exactly when the rules say so."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import chisquare

from planner_core.paper.search import SearchSettings, search

BOUNDS = np.array([[-1.0, -1.0, 0.5], [1.0, 1.0, 2.0]])
SQUARE = SearchSettings(neighbourhood="cube", fixed_height=True, seed=4)


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10_000), fixed_height=st.booleans(), memoised=st.booleans())
def test_no_voxel_is_entered_twice(seed, fixed_height, memoised, make_rugged) -> None:
    options = SearchSettings(
        seed=seed,
        neighbourhood="cube",
        fixed_height=fixed_height,
        memoised=memoised,
        max_without_improvement=5,
        lattice_origin_m=(0.0, 0.0, 0.0),
    )
    starts = 0.05 * np.random.default_rng(seed).integers([-20, -20, 10], [20, 20, 40], (6, 3))
    history = search("ts", starts, make_rugged((0.1, 0.2, 1.2)), options, bounds_m=BOUNDS).history
    step = np.rint(history.position_m / 0.05).astype(int)
    voxel = (2 * step) // 3  # 1.5 steps a voxel, in whole numbers
    for agent in range(6):
        way = voxel[:, agent][np.r_[True, (step[1:, agent] != step[:-1, agent]).any(axis=1)]]
        assert len({tuple(v) for v in way.tolist()}) == len(way), f"seed {seed} agent {agent}"
    stayed = (step[1:] == step[:-1]).all(axis=2)
    assert not (stayed & history.restarted[1:]).any()


def test_in_its_minimum_an_agent_begins_anew_elsewhere(make_terrain, make_bowl) -> None:
    # Of voxels hardly longer than a step, this way enters a new one with every step.
    options = replace(SQUARE, tabu_voxel_steps=1.001)
    found = search("ts", np.array([[-0.3, 0.0, 1.0]]), make_terrain(make_bowl((0, 0, 1))), options, bounds_m=BOUNDS)
    restarted = np.flatnonzero(found.history.restarted[:, 0])
    assert restarted[0] == 7  # six moves down, and every neighbour is worse
    assert found.f2[0] == pytest.approx(0.0, abs=1e-12)
    f2 = found.history.f2[:, 0]
    others = np.setdiff1d(np.arange(1, f2.size), restarted)
    assert (f2[others] <= f2[others - 1]).all()  # but for new beginnings it never goes up


def test_where_all_neighbours_are_tabu_or_invalid_an_agent_begins_anew(make_terrain) -> None:
    # Two islands of one cell each: no neighbour is ever valid, and the start is tabu.
    islands = np.array([[0.0, 0.0], [0.7, 0.7]])
    valid = lambda p: (np.abs(p[:, None, :2] - islands).max(axis=2) < 0.3).any(axis=1)  # noqa: E731
    one_cell = lambda p: (np.abs(p[:, None, :2] - islands).max(axis=2) < 0.01).any(axis=1)  # noqa: E731
    wide = search(
        "ts",
        np.array([[0.0, 0.0, 1.0]]),
        make_terrain(lambda p: np.zeros(len(p)), valid=valid),
        SQUARE,
        bounds_m=BOUNDS,
    )
    assert not wide.history.restarted[1:5].any()
    narrow = make_terrain(lambda p: np.zeros(len(p)), valid=one_cell)
    found = search("ts", np.array([[0.0, 0.0, 1.0]]), narrow, SQUARE, bounds_m=BOUNDS)
    restarted = np.flatnonzero(found.history.restarted[:, 0])
    assert restarted.size == 1  # the other island once, and then there is nowhere left that is not tabu
    np.testing.assert_allclose(found.history.position_m[-1, 0, :2], [0.7, 0.7], atol=1e-9)


@pytest.mark.parametrize("patience", [1, 3, 10])
def test_without_a_new_best_an_agent_begins_anew_after_so_many_iterations(patience, make_terrain) -> None:
    # A plateau: every move is no worse, none is a new best.
    options = SearchSettings(
        neighbourhood="cube", fixed_height=True, max_without_improvement=patience, max_iterations=5 * (patience + 1)
    )
    flat = make_terrain(lambda p: np.zeros(len(p)))
    found = search("ts", np.array([[0.0, 0.0, 1.0]]), flat, options, bounds_m=BOUNDS * [10, 10, 1])
    assert np.flatnonzero(found.history.restarted[:, 0]).tolist() == [k * (patience + 1) for k in range(1, 6)]


def test_new_beginnings_are_spread_evenly_over_the_bounds(make_terrain) -> None:
    # Nothing but new beginnings: every position is worse than all that were seen before, and none has a neighbour.
    valid = lambda p: np.rint(p / 0.05).astype(int).sum(axis=1) % 3 == 0  # noqa: E731
    options = SearchSettings(neighbourhood="cube", max_iterations=60, max_without_improvement=1, seed=9)
    starts = np.tile([0.0, 0.0, 1.05], (40, 1))
    bounds = np.array([[-1.0, -0.5, 0.5], [1.0, 0.5, 2.0]])
    history = search(
        "ts", starts, make_terrain(lambda p: np.zeros(len(p)), valid=valid), options, bounds_m=bounds
    ).history
    places = history.position_m[history.restarted]
    assert len(places) > 1000
    for axis in range(3):
        counted = np.bincount(np.rint((places[:, axis] - bounds[0, axis]) / 0.05).astype(int))
        assert counted.size == round((bounds[1] - bounds[0])[axis] / 0.05) + 1  # both ends included
        assert chisquare(counted).pvalue > 1e-3, (axis, counted)


def test_at_fixed_height_new_beginnings_keep_the_agents_height(make_rugged) -> None:
    starts = np.array([[0.0, 0.0, 0.93], [0.5, 0.5, 1.41]])
    options = SearchSettings(fixed_height=True, memoised=False, max_without_improvement=2)
    history = search("ts", starts, make_rugged((0, 0, 1)), options, bounds_m=BOUNDS).history
    assert history.restarted.any(axis=0).all()
    np.testing.assert_allclose(history.position_m[:, :, 2], np.tile([0.93, 1.41], (61, 1)), atol=1e-9)


def test_tabu_search_beats_local_search_where_pits_are_many(make_rugged) -> None:
    starts = np.random.default_rng(0).uniform([-1, -1, 0.6], [1, 1, 1.9], (40, 3))
    means = [search(m, starts, make_rugged((0, 0, 1)), SQUARE, bounds_m=BOUNDS).f2 for m in ("ls", "ts")]
    assert np.median(means[1]) < np.median(means[0])

"""Overlap repair against networkx's components, exhaustive search on small pools, and areas by shapely."""

import itertools

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import unary_union
from shapely.geometry import Point

from planner_core.errors import RequirementError
from planner_core.paper.circle_overlap import Cell, disc_points, filled_share, occupancy_grid, shared_fraction
from planner_core.paper.overlap_repair import Reason, rank_by_overlap, repair_overlap, station_overlaps

R = 2.0


def circle_graph(at: np.ndarray, floor: np.ndarray) -> nx.Graph:
    """Circles of radius R that overlap on one floor."""
    graph = nx.Graph()
    graph.add_nodes_from(range(len(at)))
    for i, j in itertools.combinations(range(len(at)), 2):
        if floor[i] == floor[j] and np.hypot(*(at[i] - at[j])) < 2 * R:
            graph.add_edge(i, j)
    return graph


def covered_share(at: np.ndarray, others: np.ndarray, radius: float = R) -> float:
    """By polygons of 256 sides."""
    mine = Point(*at).buffer(radius, quad_segs=64)
    return mine.intersection(unary_union([Point(*one).buffer(radius, quad_segs=64) for one in others])).area / mine.area


def drawn(seed: int, n_stations: int, n_pool: int, side: float, n_floors: int = 1):
    rng = np.random.default_rng(seed)
    at, pool = rng.uniform(0, side, (n_stations, 2)), rng.uniform(0, side, (n_pool, 2))
    return at, pool, *(rng.integers(0, n_floors, n).astype(np.int32) for n in (n_stations, n_pool))


# ------------------------------------------------------------------------------------------- occupancy
@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(0, 5))
def test_occupancy_is_the_area_that_others_cover(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    at, others = rng.uniform(-1, 1, 2), rng.uniform(-1.5 * R, 1.5 * R, (n, 2))
    share = filled_share(occupancy_grid(at, others, radius_m=R, cells_across=128))
    assert share == pytest.approx(covered_share(at, others) if n else 0.0, abs=0.01), seed


def test_strewn_points_come_to_the_same_as_middles_of_cells_and_few_points_fill_less() -> None:
    at, others = np.zeros(2), np.array([[1.0, 0.5], [-2.5, 1.0]])
    exact = covered_share(at, others)
    shares = [
        filled_share(occupancy_grid(at, others, radius_m=R, cells_across=32, n_points=n)) for n in (50, 1000, 30000)
    ]
    assert shares[0] < 0.2 * exact
    assert shares[0] < shares[1] < shares[2]
    # Cells that another circle only touches are filled by points too: a little more than the area.
    assert exact < shares[2] < exact + 0.05


def test_grid_tells_cells_outside_free_and_filled() -> None:
    grid = occupancy_grid(np.zeros(2), np.array([[R, 0.0]]), radius_m=R, cells_across=4)
    assert grid.tolist() == [
        [Cell.OUTSIDE, Cell.FREE, Cell.FREE, Cell.OUTSIDE],
        [Cell.FREE, Cell.FREE, Cell.FILLED, Cell.FILLED],
        [Cell.FREE, Cell.FREE, Cell.FILLED, Cell.FILLED],
        [Cell.OUTSIDE, Cell.FREE, Cell.FREE, Cell.OUTSIDE],
    ]
    up = occupancy_grid(np.zeros(2), np.array([[0.0, R]]), radius_m=R, cells_across=4)
    np.testing.assert_array_equal(up, grid.T)


def test_circles_apart_fill_nothing_and_one_in_the_same_place_everything() -> None:
    assert filled_share(occupancy_grid(np.zeros(2), np.array([[2 * R, 0.0]]), radius_m=R, n_points=5000)) == 0.0
    assert filled_share(occupancy_grid(np.zeros(2), np.zeros((1, 2)), radius_m=R)) == 1.0
    assert filled_share(occupancy_grid(np.zeros(2), np.empty((0, 2)), radius_m=R)) == 0.0


def test_points_of_a_disc_are_even() -> None:
    points = disc_points(4096)
    radius = np.hypot(*points.T)
    assert radius.max() < 1.0
    assert np.mean(radius**2 < 0.25) == pytest.approx(0.25, abs=0.005)
    assert np.mean(points[:, 0] > 0) == pytest.approx(0.5, abs=0.005)
    assert np.abs(points.mean(axis=0)).max() < 0.01


@pytest.mark.parametrize(
    ("wrong", "word"),
    [
        ({"radius_m": 0.0}, "radius_m"),
        ({"radius_m": np.inf}, "radius_m"),
        ({"radius_m": 1.0, "cells_across": 0}, "cells_across"),
        ({"radius_m": 1.0, "n_points": 0}, "n_points"),
    ],
)
def test_grids_that_make_no_sense_are_refused(wrong: dict, word: str) -> None:
    with pytest.raises(RequirementError, match=word):
        occupancy_grid(np.zeros(2), np.zeros((1, 2)), **wrong)


def test_overlaps_of_stations_are_their_shares_of_circles() -> None:
    at = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 2.0], [0.2, 0.1], [50.0, 0.0]])
    floor = np.array([0, 0, 0, 1, 0], dtype=np.int32)
    found = station_overlaps(at, radius_m=R, floor=floor)
    for i in range(3):
        others = at[[j for j in range(3) if j != i]]
        assert found[i] == pytest.approx(covered_share(at[i], others), abs=0.01)
    assert found[3] == found[4] == 0.0
    assert station_overlaps(np.empty((0, 2)), radius_m=R).shape == (0,)


# --------------------------------------------------------------------------------------------- ranking
def test_ranking_prefers_what_reaches_the_required_overlap_and_then_what_is_close_to_it() -> None:
    share = np.array([0.1, 0.29, 0.3, 0.35, 0.9, 0.0])
    preferred, score = rank_by_overlap(share, required=0.3, radius_m=5.0)
    order = np.lexsort((-score, ~preferred))
    assert share[order].tolist() == [0.3, 0.35, 0.9, 0.29, 0.1, 0.0]
    # By the printed formula without its bit, 0.29 comes before 0.35.
    assert score[1] > score[3]
    np.testing.assert_allclose(score, [4.8, 4.99, 5.0, 4.95, 4.4, 4.7])


# ---------------------------------------------------------------------------------------------- repair
def test_lone_station_gets_the_candidate_closest_to_the_required_overlap_from_above() -> None:
    pool = np.array([[0.2, 0.0], [2.0, 0.0], [2.4, 0.0], [2.6, 0.0], [3.9, 0.0]])
    share = shared_fraction(pool[:, 0], R, R)
    # Candidate 3 is closer to it, but from below.
    required = float(0.2 * share[2] + 0.8 * share[3])
    found = repair_overlap(np.zeros((1, 2)), pool, radius_m=R, required=required)
    assert found.added.tolist() == [2]
    assert found.history[0].reason is Reason.OVERLAP
    assert found.history[0].share == pytest.approx(share[2])
    assert found.overlap == pytest.approx([share[2], share[2]], abs=0.01)
    assert (found.sets, found.short) == (((0, 1),), ())


def test_candidates_below_the_required_overlap_add_up() -> None:
    pool = np.array([[3.0, 0.0], [-3.0, 0.0], [0.0, 3.0], [0.0, 3.9]])
    one = float(shared_fraction(3.0, R, R))
    found = repair_overlap(np.zeros((1, 2)), pool, radius_m=R, required=1.5 * one)
    assert found.added[:2].tolist() == [0, 1]
    assert found.overlap[0] == pytest.approx(2 * one, abs=0.01)


def test_two_stations_are_joined_by_steps_towards_each_other() -> None:
    at = np.array([[0.0, 0.0], [10.0, 0.0]])
    pool = np.array([[x, y] for x in np.arange(-4.0, 14.5, 0.5) for y in (-1.0, 0.0, 1.0)])
    found = repair_overlap(at, pool, radius_m=R, required=0.2)
    assert found.is_joined
    assert found.sets == (tuple(range(2 + found.added.size)),)
    assert found.short == ()
    joins = [addition for addition in found.history if addition.reason is Reason.JOIN]
    assert joins
    assert all(addition.share >= 0.2 for addition in found.history)
    assert [addition.station for addition in found.history] == list(range(2, 2 + found.added.size))
    assert found.history[-1].n_sets == 1


def test_steps_go_by_equation_5_and_not_by_overlap_alone() -> None:
    at = np.array([[0.0, 0.0], [10.0, 0.0]])
    sideways, ahead = [0.5, 2.4], [2.0, 0.0]
    found = repair_overlap(at, np.array([sideways, ahead]), radius_m=R, required=0.0)
    assert [addition.candidate for addition in found.history[:1]] == [1]
    gain = [
        (10.0 - np.hypot(10.0 - x, y)) / 10.0 * (R - float(shared_fraction(np.hypot(x, y), R, R)))
        for x, y in (sideways, ahead)
    ]
    assert gain[1] > gain[0] > 0


def test_a_step_is_taken_from_the_other_end_where_none_leads_nearer_from_the_first() -> None:
    at = np.array([[0.0, 0.0], [6.0, 0.0]])
    pool = np.array([[-0.5, 3.5], [2.5, 4.5], [4.8, 3.5]])
    found = repair_overlap(at, pool, radius_m=R, required=0.0)
    assert found.is_joined
    assert found.added.tolist() == [2, 0, 1]
    assert {addition.reason for addition in found.history} == {Reason.JOIN}
    assert found.history[0].of_station == 1


def test_stations_that_join_sets_are_brought_to_the_required_overlap_too() -> None:
    at = np.array([[0.0, 0.0], [1.0, 0.0], [8.0, 0.0], [9.0, 0.0]])
    pool = np.array([[4.5, 0.0], [4.5, 1.0]])
    found = repair_overlap(at, pool, radius_m=R, required=0.4)
    assert found.is_joined
    assert [addition.reason for addition in found.history] == [Reason.JOIN, Reason.OVERLAP]
    assert (found.overlap >= 0.4).all()


@pytest.mark.parametrize("distance", [0.3, 1.0, 1.7, 2.6, 3.3])
def test_a_single_neighbour_counts_by_the_closed_form(distance: float) -> None:
    at = np.array([[0.0, 0.0], [distance, 0.0]])
    share = float(shared_fraction(distance, R, R))
    found = repair_overlap(at, at + 0.5, radius_m=R, required=share, cells_across=7)
    assert found.added.size == 0
    assert (found.overlap >= share).all()


def test_sets_round_a_corner_are_bridged_where_no_step_leads_nearer() -> None:
    # Two stations at the ends of a horseshoe: the pool leads away first, then round.
    angle = np.deg2rad(np.arange(30, 331, 15))
    shoe = 5.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    at = 5.0 * np.array([[np.cos(a), np.sin(a)] for a in np.deg2rad([28.0, 332.0])])
    found = repair_overlap(at, shoe, radius_m=1.0, required=0.0)
    assert found.is_joined
    assert {addition.reason for addition in found.history} == {Reason.BRIDGE}
    everything = np.concatenate([at, shoe]) * R
    hops = nx.shortest_path_length(circle_graph(everything, np.zeros(len(everything))), 0, 1)
    assert found.added.size == hops - 1
    assert [addition.of_station for addition in found.history] == [0, *range(2, 1 + found.added.size)]
    assert min(addition.share for addition in found.history) > 0


def test_stations_without_a_way_between_them_are_left_and_told() -> None:
    at = np.array([[0.0, 0.0], [20.0, 0.0], [23.0, 0.0]])
    found = repair_overlap(at, np.array([[1.0, 0.0], [19.0, 0.0]]), radius_m=R, required=0.9)
    assert not found.is_joined
    assert len(found.sets) == 2
    assert found.short
    assert sorted(found.added.tolist()) == [0, 1]
    alone = repair_overlap(at, np.empty((0, 2)), radius_m=R, required=0.3)
    assert (alone.added.size, alone.history, alone.sets) == (0, (), ((0,), (1, 2)))
    assert alone.short == (0, 1, 2)


def test_floors_are_repaired_by_themselves() -> None:
    at = np.array([[0.0, 0.0, 1.5], [0.5, 0.0, 4.5], [7.0, 0.0, 1.5]])
    pool = np.array([[x, 0.0, z] for z in (1.5, 4.5) for x in np.arange(-1.0, 9.0, 0.5)])
    pool_floor = (pool[:, 2] > 3).astype(np.int32)
    floor = np.array([0, 1, 0], dtype=np.int32)
    found = repair_overlap(at, pool, radius_m=R, required=0.4, station_floor=floor, pool_floor=pool_floor)
    assert found.is_joined
    assert found.n_floors == len(found.sets) == 2
    floors = np.concatenate([floor, pool_floor[found.added]])
    assert all(len(set(floors[list(one)])) == 1 for one in found.sets)
    assert (found.overlap >= 0.4).all()


def test_candidates_in_the_place_of_a_station_are_not_taken() -> None:
    at = np.array([[0.0, 0.0, 1.0]])
    pool = np.array([[0.0, 0.0, 1.8], [1.0, 0.0, 1.0], [1.0, 0.0, 1.4]])
    found = repair_overlap(at, pool, radius_m=R, required=0.6)
    assert found.added.tolist() == [1]


def test_nothing_is_added_to_stations_that_overlap_enough() -> None:
    at = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    pool = np.random.default_rng(1).uniform(-3, 3, (50, 2))
    found = repair_overlap(at, pool, radius_m=R, required=0.5)
    assert found.added.size == 0
    assert found.sets == ((0, 1, 2),)
    none = repair_overlap(np.empty((0, 2)), pool, radius_m=R, required=0.5)
    assert (none.added.size, none.sets, none.is_joined) == (0, (), True)


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    n_stations=st.integers(1, 6),
    n_pool=st.integers(0, 40),
    side=st.floats(4.0, 25.0),
    required=st.sampled_from([0.0, 0.2, 0.4, 0.6]),
)
def test_sets_are_the_components_of_stations_and_pool_together(seed, n_stations, n_pool, side, required):
    at, pool, floor, pool_floor = drawn(seed, n_stations, n_pool, side, n_floors=2)
    found = repair_overlap(
        at, pool, radius_m=R, required=required, station_floor=floor, pool_floor=pool_floor, cells_across=24
    )
    positions = np.concatenate([at, pool[found.added]])
    floors = np.concatenate([floor, pool_floor[found.added]])
    stations = {frozenset(one) for one in nx.connected_components(circle_graph(positions, floors))}
    assert {frozenset(one) for one in found.sets} == stations, seed
    whole = circle_graph(np.concatenate([at, pool]), np.concatenate([floor, pool_floor]))
    reachable = [one for one in nx.connected_components(whole) if min(one) < n_stations]
    assert len(found.sets) == len(reachable), seed
    assert found.is_joined == (len(reachable) == np.unique(floor).size)


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    n_pool=st.integers(0, 40),
    side=st.floats(4.0, 12.0),
    required=st.sampled_from([0.1, 0.3, 0.5, 0.8]),
)
def test_stations_overlap_enough_wherever_the_whole_pool_would_do(seed, n_pool, side, required):
    at, pool, _, _ = drawn(seed, 4, n_pool, side)
    found = repair_overlap(at, pool, radius_m=R, required=required, cells_across=48)
    positions = np.concatenate([at, pool[found.added]])
    everything = np.concatenate([at, pool])
    names = [0, 1, 2, 3, *(4 + found.added)]
    for station, name in enumerate(names):
        others = np.delete(positions, station, axis=0)
        assert found.overlap[station] == pytest.approx(covered_share(positions[station], others), abs=0.02), seed
        at_most = covered_share(positions[station], np.delete(everything, name, axis=0))
        if at_most >= required + 0.03:
            assert found.overlap[station] >= required, seed
    assert found.short == tuple(np.flatnonzero(found.overlap < required).tolist())


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_repair_is_the_same_every_time_and_wherever_the_building_stands(seed: int) -> None:
    at, pool, _, _ = drawn(seed, 4, 30, 15.0)
    one = repair_overlap(at, pool, radius_m=R, required=0.3)
    again = repair_overlap(at, pool, radius_m=R, required=0.3)
    assert one.history == again.history
    assert one.overlap.tobytes() == again.overlap.tobytes()
    assert np.unique(one.added).size == one.added.size
    moved = repair_overlap(at + 64.0, pool + 64.0, radius_m=R, required=0.3)
    assert len(moved.sets) == len(one.sets)


def test_progress_hears_of_every_station() -> None:
    at, pool, _, _ = drawn(3, 4, 60, 15.0)
    heard: list[int] = []
    found = repair_overlap(at, pool, radius_m=R, required=0.3, progress=lambda event: heard.append(event.done))
    assert heard == list(range(1, found.added.size + 1))
    assert len(heard) > 2


@pytest.mark.parametrize(
    ("wrong", "word"),
    [
        ({"required": 1.0}, "required"),
        ({"required": -0.1}, "required"),
        ({"required": np.nan}, "required"),
        ({"radius_m": np.inf}, "radius_m"),
        ({"stations_m": np.zeros(3)}, "stations_m"),
        ({"pool_m": np.full((2, 2), np.nan)}, "pool_m"),
        ({"pool_floor": np.zeros(5, dtype=np.int32)}, "pool_m"),
        ({"cells_across": 0}, "cells_across"),
    ],
)
def test_requests_that_make_no_sense_are_refused(wrong: dict, word: str) -> None:
    asked = {"stations_m": np.array([[0.0, 0], [1, 0]]), "pool_m": np.zeros((2, 2)), "radius_m": R, "required": 0.3}
    asked |= wrong
    with pytest.raises(RequirementError, match=word):
        repair_overlap(asked.pop("stations_m"), asked.pop("pool_m"), **asked)

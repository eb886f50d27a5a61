"""Lists recognised by their shape: made by a known turn and shift; and what must not be taken for certain."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from slow_cases import all_slow_but

from planner_core.as_scanned.shape import ShapeFit, shape_fit

FAR = (458_870.0, 5_438_260.0, 110.25)


def plan_of(seed: int = 0, n: int = 24) -> np.ndarray:
    """Stations of two floors of 20 by 14 m, nowhere nearer than 1.5 m to each other in plan."""
    rng = np.random.default_rng(seed)
    places: list[np.ndarray] = []
    while len(places) < n:
        at = np.array([*rng.uniform((0, 0), (20, 14)), 1.5 if len(places) % 2 else 4.3])
        if all(np.hypot(*(at - other)[:2]) > 1.5 for other in places):
            places.append(at)
    return np.array(places)


def moved(places: np.ndarray, turn_rad: float, shift: tuple[float, float, float]) -> np.ndarray:
    """By complex numbers, with none of the library's code."""
    plane = (places[:, 0] + 1j * places[:, 1]) * complex(math.cos(turn_rad), math.sin(turn_rad))
    return np.column_stack([plane.real + shift[0], plane.imag + shift[1], places[:, 2] + shift[2]])


def found(listed: np.ndarray, planned: np.ndarray) -> ShapeFit:
    fit = shape_fit(listed, planned)
    assert fit is not None
    return fit


@pytest.mark.slow
@settings(max_examples=12, deadline=None, derandomize=True)
@given(
    turn_rad=st.floats(-math.pi, math.pi),
    east=st.floats(-5e5, 5e5),
    north=st.floats(-6e6, 6e6),
    seed=st.integers(0, 99),
)
def test_any_turn_and_shift_is_found_again(turn_rad: float, east: float, north: float, seed: int) -> None:
    planned = plan_of(seed, 12)
    order = np.random.default_rng(seed).permutation(12)
    fit = found(moved(planned, turn_rad, (east, north, 7.0))[order], planned)
    assert fit.is_certain
    assert abs(complex(math.cos(fit.turn_rad - turn_rad), math.sin(fit.turn_rad - turn_rad)) - 1) < 1e-6
    assert fit.shift_m == pytest.approx([east, north, 7.0], abs=1e-5)
    assert order[fit.pairs[:, 0]].tolist() == fit.pairs[:, 1].tolist()
    assert len(fit.pairs) == 12
    assert fit.rms_m < 1e-6


@pytest.mark.parametrize("turn_rad", [0.0, 0.4, -2.9])
@pytest.mark.parametrize("seed", all_slow_but([0], range(4)))
def test_a_crew_that_deviates_leaves_out_and_adds_is_recognised(turn_rad: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    planned = plan_of(seed)
    kept = rng.permutation(24)[:17]
    places = planned[kept] + rng.normal(0, 0.12, (17, 3)) * (1, 1, 0.2)
    places = np.vstack([places, rng.uniform((0, 0, 1.5), (20, 14, 1.5), (2, 3))])
    fit = found(moved(places, turn_rad, FAR), planned)
    assert fit.is_certain
    assert fit.turn_rad == pytest.approx(turn_rad, abs=0.02)
    right = [i < 17 and kept[i] == k for i, k in fit.pairs.tolist()]
    assert sum(right) >= 15
    assert len(right) - sum(right) <= 1
    assert moved(planned, fit.turn_rad, fit.shift_m) == pytest.approx(moved(planned, turn_rad, FAR), abs=0.4)


def test_a_turn_is_not_taken_where_none_is_as_good() -> None:
    planned = plan_of(3)
    listed = planned + np.random.default_rng(3).normal(0, 0.1, planned.shape) + FAR
    assert found(listed, planned).turn_rad == 0.0
    assert shape_fit(moved(planned, 0.5, FAR), planned, may_turn=False) is None


def grid(columns: int, rows: int) -> np.ndarray:
    return np.array([(6.0 * x, 5.0 * y, 1.5) for x in range(columns) for y in range(rows)])


@pytest.mark.slow
@pytest.mark.parametrize(
    "planned",
    [
        grid(5, 4),  # turned by half a circle, the same
        np.column_stack([6.0 * np.arange(8), np.zeros(8), np.full(8, 1.5)]),
        np.vstack([plan_of(1, 10), moved(plan_of(1, 10), math.pi, (45.0, 20.0, 0.0))]),
    ],
    ids=["grid", "row", "two like halves"],
)
def test_what_fits_in_several_ways_is_not_certain(planned: np.ndarray) -> None:
    fit = found(planned + FAR, planned)
    assert not fit.is_certain
    assert fit.other_share > 0.95


def test_a_part_of_a_grid_without_any_turn_is_not_certain_either() -> None:
    fit = shape_fit(grid(5, 4)[:8] + FAR, grid(5, 4), may_turn=False)
    assert fit is not None
    assert not fit.is_certain


@pytest.mark.slow
def test_stations_of_another_building_are_not_recognised() -> None:
    certain = 0
    for seed in range(12):
        fit = shape_fit(moved(plan_of(seed + 100, 6 + seed), 0.3, FAR), plan_of(seed))
        certain += fit is not None and fit.is_certain
    assert certain == 0


def test_mirrored_stations_are_not_recognised() -> None:
    planned = plan_of(7)
    assert shape_fit(planned[:, [1, 0, 2]] + FAR, planned) is None


@pytest.mark.parametrize("n", [0, 1, 4])
def test_few_stations_have_no_shape(n: int) -> None:
    assert shape_fit(plan_of()[:n], plan_of()) is None
    assert shape_fit(plan_of(), plan_of()[:n]) is None


def test_heights_that_are_not_known_are_left_out() -> None:
    planned = plan_of()
    some = planned.copy()
    some[:3, 2] = np.nan
    fit = found(planned + FAR, some)
    assert len(fit.pairs) == 21
    assert np.array_equal(planned[fit.pairs[:, 0]], some[fit.pairs[:, 1]])
    assert shape_fit(some + FAR, planned) is None


@pytest.mark.slow
def test_the_order_of_lists_changes_nothing() -> None:
    planned = plan_of(9)
    listed = moved(planned, 1.1, FAR) + np.random.default_rng(9).normal(0, 0.1, planned.shape)
    fits = [found(listed[order], planned) for order in (slice(None), slice(None, None, -1))]
    for one, other in pairwise(fits):
        assert one.turn_rad == pytest.approx(other.turn_rad, abs=1e-9)
        assert one.shift_m == pytest.approx(other.shift_m, abs=1e-6)
    again = found(listed, planned)
    assert again.turn_rad == fits[0].turn_rad
    assert again.shift_m.tolist() == fits[0].shift_m.tolist()

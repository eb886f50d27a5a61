"""One a cell, and the best that lie apart, against brute force. Places are halves of metres: some lie just as far."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.errors import RequirementError
from planner_core.paper.search.improve import best_apart, by_worth, one_per_cell


def scattered(seed: int, n: int):
    stream = np.random.default_rng(seed)
    f2 = stream.integers(0, 6, n).astype(float)
    f2[stream.random(n) < 0.1] = np.inf
    return 0.5 * stream.integers(-6, 7, (n, 3)), stream.integers(0, 3, n), f2


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**20), n=st.integers(0, 60), layers=st.booleans())
def test_each_occupied_cell_keeps_its_best(seed, n, layers) -> None:
    place, f1, f2 = scattered(seed, n)
    length = (1.0, 0.5, 0.7 if layers else np.inf)
    kept = one_per_cell(place, f1, f2, cell_m=length, origin_m=(0.1, 0.0, 0.2))
    cells: dict[tuple, list] = {}
    for i in range(n):
        if np.isfinite(f2[i]):
            key = ((place[i, 0] - 0.1) // 1.0, place[i, 1] // 0.5, (place[i, 2] - 0.2) // 0.7 if layers else 0)
            cells.setdefault(key, []).append((f2[i], -f1[i], i))
    assert kept.tolist() == [i for _, _, i in sorted(min(cell) for cell in cells.values())]


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 2**20),
    n=st.integers(0, 60),
    wanted=st.integers(0, 20),
    apart=st.sampled_from([0.0, 0.5, 1.0, 1.2, 2.5]),
)
def test_the_best_apart_are_taken_greedily(seed, n, wanted, apart) -> None:
    place, f1, f2 = scattered(seed, n)
    expected: list[int] = []
    for _, _, i in sorted((f2[i], -f1[i], i) for i in range(n) if np.isfinite(f2[i])):
        if len(expected) < wanted and all(np.linalg.norm(place[i] - place[j]) >= apart for j in expected):
            expected.append(i)
    assert best_apart(place, f1, f2, n=wanted, least_distance_m=apart).tolist() == expected


def test_ranking_goes_by_f2_then_f1_then_number_and_leaves_out_the_invalid() -> None:
    f2, f1 = np.array([3.0, 1.0, 1.0, np.inf, 1.0]), np.array([9, 2, 5, 9, 5])
    assert by_worth(f1, f2).tolist() == [2, 4, 1, 0]


@pytest.mark.parametrize("length", [(0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, float("nan"))])
def test_cells_without_size_are_refused(length) -> None:
    with pytest.raises(RequirementError, match="cell_m"):
        one_per_cell(np.zeros((1, 3)), np.zeros(1, int), np.zeros(1), cell_m=length)


@pytest.mark.parametrize(("n", "apart"), [(-1, 0.0), (1, -1.0), (1, float("nan"))])
def test_a_negative_number_or_distance_is_refused(n, apart) -> None:
    with pytest.raises(RequirementError, match="best positions"):
        best_apart(np.zeros((1, 3)), np.zeros(1, int), np.zeros(1), n=n, least_distance_m=apart)

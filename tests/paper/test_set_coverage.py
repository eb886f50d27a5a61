"""F1 of sets on the device and on the host against set arithmetic."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.device import Device
from planner_core.errors import RequirementError
from planner_core.model import Visibility
from planner_core.paper import set_coverage
from planner_core.paper.set_coverage import SetCoverage


def rows_of(seed: int, n_patches: int, n_positions: int = 9) -> tuple[Visibility, list[set[int]], np.ndarray]:
    rng = np.random.default_rng(seed)
    rows = [
        np.flatnonzero(rng.random(n_patches) < rng.choice([0.0, 0.02, 0.3, 1.0], p=[0.1, 0.4, 0.4, 0.1]))
        for _ in range(n_positions)
    ]
    starts = np.cumsum([0, *(row.size for row in rows)]).astype(np.int64)
    visibility = Visibility(starts, np.concatenate(rows).astype(np.int32), n_patches)
    area_m2 = 10.0 ** rng.uniform(-9, 0, n_patches)
    return visibility, [set(row.tolist()) for row in rows], area_m2


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    n_patches=st.sampled_from([1, 31, 32, 33, 1000, 16384, 16385, 40000]),
    sets=st.lists(st.lists(st.integers(0, 8), max_size=6), min_size=1, max_size=5),
)
def test_figures_of_sets_are_those_of_set_arithmetic(device, seed, n_patches, sets):
    visibility, rows, area_m2 = rows_of(seed, n_patches)
    count, area = SetCoverage(visibility, area_m2, device=device).of(sets)
    for index, chosen in enumerate(sets):
        union = set().union(*(rows[row] for row in chosen))
        assert count[index] == len(union), (seed, n_patches)
        assert area[index] == pytest.approx(sum(area_m2[p] for p in sorted(union)), rel=1e-12), (seed, n_patches)
    on_host = SetCoverage(visibility, area_m2).of(sets)
    assert on_host[0].tobytes() == count.tobytes()
    assert on_host[1].tobytes() == area.tobytes()


def test_figures_depend_neither_on_slices_nor_on_launches(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    visibility, _, area_m2 = rows_of(3, 5000)
    sets = [[0, 4], [], [1, 2, 3, 8], [7], [7, 7, 7]]
    count, area = SetCoverage(visibility, area_m2, device=device).of(sets)
    monkeypatch.setattr(set_coverage, "_WORDS", {})
    monkeypatch.setattr(set_coverage, "_SETS_AT_ONCE", 2)
    other_count, other_area = SetCoverage(visibility, area_m2, device=device).of(sets)
    assert count.tobytes() == other_count.tobytes()
    assert area.tobytes() == other_area.tobytes()
    assert count[1] == 0
    assert count[3] == count[4]
    assert count[0] > 0


def test_area_of_everything_is_exact_over_eighteen_orders_of_magnitude(device: Device) -> None:
    area_m2 = np.array([2.0**-40, 2.0**15, 2.0**-40, 1.0])
    visibility = Visibility(np.array([0, 4], dtype=np.int64), np.arange(4, dtype=np.int32), 4)
    assert SetCoverage(visibility, area_m2, device=device).of([[0]])[1][0] == 2.0**15 + 1.0 + 2.0**-39


def test_no_sets_and_no_area_give_nothing(device: Device) -> None:
    visibility = Visibility(np.array([0, 2], dtype=np.int64), np.arange(2, dtype=np.int32), 2)
    count, area = SetCoverage(visibility, np.zeros(2), device=device).of([])
    assert count.size == area.size == 0
    count, area = SetCoverage(visibility, np.zeros(2), device=device).of([[0]])
    assert (count[0], area[0]) == (2, 0.0)


@pytest.mark.parametrize("rows", [[-1], [0, 9]])
def test_row_that_does_not_exist_is_refused(device: Device, rows: list[int]) -> None:
    visibility, _, area_m2 = rows_of(1, 50)
    with pytest.raises(RequirementError, match=r"set 1: got rows"):
        SetCoverage(visibility, area_m2, device=device).of([[0], rows])


@pytest.mark.parametrize("area_m2", [np.ones(4), np.array([1.0, -1.0, 1.0]), np.array([1.0, np.nan, 1.0])])
def test_areas_that_make_no_sense_are_refused(area_m2: np.ndarray) -> None:
    visibility = Visibility(np.array([0, 2], dtype=np.int64), np.arange(2, dtype=np.int32), 3)
    with pytest.raises(RequirementError, match="patch_area_m2"):
        SetCoverage(visibility, area_m2)

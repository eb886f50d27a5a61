"""Coverage figures against set arithmetic on random rows."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.coverage import coverage as c
from planner_core.model import Patches, Visibility

N_PATCHES = 60


def rows_of(seed, n=7):
    rng = np.random.default_rng(seed)
    rows = [np.sort(rng.choice(N_PATCHES, rng.integers(0, 25), replace=False)) for _ in range(n)]
    starts = np.concatenate([[0], np.cumsum([row.size for row in rows])]).astype(np.int64)
    visibility = Visibility(starts, np.concatenate(rows).astype(np.int32), N_PATCHES)
    return visibility, [set(row.tolist()) for row in rows], rng.random(N_PATCHES)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), seen_from=st.integers(1, 3))
def test_figures_are_those_of_set_arithmetic(seed, seen_from):
    visibility, sets, area_m2 = rows_of(seed)
    scope = np.random.default_rng(seed).random(N_PATCHES) < 0.6

    def asked_and_covered_m2(rows):
        return sum(area_m2[p] for p in range(N_PATCHES) if scope[p] and sum(p in row for row in rows) >= seen_from)

    assert c.times_seen(visibility).tolist() == [sum(p in row for row in sets) for p in range(N_PATCHES)]
    covered, own = c.covered_and_own_area_m2(visibility, area_m2, scope=scope, seen_from=seen_from)
    for i, row in enumerate(sets):
        assert covered[i] == pytest.approx(sum(area_m2[p] for p in row)), seed
        lost_m2 = asked_and_covered_m2(sets) - asked_and_covered_m2(sets[:i] + sets[i + 1 :])
        assert own[i] == pytest.approx(lost_m2, abs=1e-9), seed


def test_rows_are_taken_in_the_order_given(monkeypatch):
    visibility, sets, _ = rows_of(1)
    taken = c.take_rows(visibility, [4, 0, 4])
    assert [set(taken.row(i).tolist()) for i in range(3)] == [sets[4], sets[0], sets[4]]
    assert c.take_rows(visibility, []).n_positions == 0
    monkeypatch.setattr(c, "_ENTRIES_A_PIECE", 2)
    in_pieces = c.take_rows(visibility, [4, 0, 4])
    assert (in_pieces.starts.tolist(), in_pieces.patch.tolist()) == (taken.starts.tolist(), taken.patch.tolist())


def test_coverage_of_a_part_leaves_the_unachievable_out():
    area = np.array([1.0, 2.0, 4.0, 8.0])
    achievable = np.array([True, True, False, True])
    seen = np.array([True, False, False, True])
    part = np.array([True, True, True, False])
    got = c.coverage_of(area, achievable, seen, part)
    assert (got.achievable_area_m2, got.total_area_m2, got.covered_area_m2) == (3.0, 7.0, 1.0)
    by_floor = c.coverage_by_floor(area, achievable, seen, np.array([0, 0, 0, 1], dtype=np.int32), 3)
    assert [f.covered_area_m2 for f in by_floor] == [1.0, 8.0, 0.0]
    assert by_floor[2].fraction_of_achievable == 1.0


def test_patches_count_for_the_floor_of_their_triangle():
    patches = Patches(1.0, np.array([1, 0, 2], np.uint8), np.array([0, 2, 3, 7], np.int32), np.ones(3))
    got = c.floor_of_patch(patches, np.array([1, -1, 0], dtype=np.int32))
    assert got.tolist() == [1, 1, -1, 0, 0, 0, 0]

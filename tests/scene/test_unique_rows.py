"""Equal rows, found by sorting keys: against a dictionary, and where keys collide."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from planner_core.scene.unique_rows import first_of_equal_rows, groups_of_equal_rows


@pytest.mark.slow
@given(arrays(np.float64, st.tuples(st.integers(0, 40), st.just(3)), elements=st.sampled_from([0.0, 1.0, -1.5, 1e300])))
@settings(max_examples=100, deadline=None)
def test_first_of_equal_rows_agrees_with_a_dictionary(rows):
    seen: dict[bytes, int] = {}
    expected = [seen.setdefault(row.tobytes(), i) for i, row in enumerate(rows)]
    assert first_of_equal_rows(rows).tolist() == expected


def test_rows_whose_keys_collide_are_still_told_apart(monkeypatch):
    monkeypatch.setattr("planner_core.scene.unique_rows._MIX", np.zeros(3, dtype=np.uint64))  # every key is 0
    rows = np.array([[1.0, 2, 3], [3.0, 2, 1], [1.0, 2, 3], [0.0, 0, 0], [3.0, 2, 1]])
    assert first_of_equal_rows(rows).tolist() == [0, 1, 0, 3, 1]


@given(arrays(np.int64, st.tuples(st.integers(0, 30), st.integers(1, 4)), elements=st.integers(-2, 2)))
@settings(max_examples=100, deadline=None)
def test_groups_of_equal_rows_are_those_of_numpy(rows):
    first, group = groups_of_equal_rows(rows)
    _, expected, inverse = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    assert first.tolist() == expected.tolist()
    assert group.tolist() == inverse.ravel().tolist()

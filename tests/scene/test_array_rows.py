"""Equal rows, found by sorting keys: against a dictionary, and where keys collide.

Work a chunk at a time gives what work on all triangles at once does.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from planner_core.scene import array_rows
from planner_core.scene.array_rows import chunks, first_of_equal_rows, groups_of_equal_rows
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.columns import sample_columns, sample_scene
from planner_core.scene.floors import find_floors
from planner_core.scene.patches import make_patches
from scenes_synthetic import house


@pytest.mark.slow
@given(arrays(np.float64, st.tuples(st.integers(0, 40), st.just(3)), elements=st.sampled_from([0.0, 1.0, -1.5, 1e300])))
@settings(max_examples=100, deadline=None)
def test_first_of_equal_rows_agrees_with_a_dictionary(rows):
    seen: dict[bytes, int] = {}
    expected = [seen.setdefault(row.tobytes(), i) for i, row in enumerate(rows)]
    assert first_of_equal_rows(rows).tolist() == expected


def test_rows_whose_keys_collide_are_still_told_apart(monkeypatch):
    monkeypatch.setattr("planner_core.scene.array_rows._MIX", np.zeros(3, dtype=np.uint64))  # every key is 0
    rows = np.array([[1.0, 2, 3], [3.0, 2, 1], [1.0, 2, 3], [0.0, 0, 0], [3.0, 2, 1]])
    assert first_of_equal_rows(rows).tolist() == [0, 1, 0, 3, 1]


@given(arrays(np.int64, st.tuples(st.integers(0, 30), st.integers(1, 4)), elements=st.integers(-2, 2)))
@settings(max_examples=100, deadline=None)
def test_groups_of_equal_rows_are_those_of_numpy(rows):
    first, group = groups_of_equal_rows(rows)
    _, expected, inverse = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    assert first.tolist() == expected.tolist()
    assert group.tolist() == inverse.ravel().tolist()


def test_portions_follow_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(array_rows, "_CHUNK", 4)
    assert [(some.start, some.stop) for some in chunks(10)] == [(0, 4), (4, 8), (8, 10)]
    assert list(chunks(0)) == []


@pytest.mark.slow
def test_floors_and_patches_do_not_depend_on_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = house.build().scene

    def found() -> tuple[str, bytes, bytes]:
        report, patches = find_floors(scene), make_patches(scene, max_area_m2=0.04)
        areas = patches.triangle_area_m2.tobytes() + patches.first_patch.tobytes()
        floors = repr([(f.elevation_m, f.ground_area_m2, f.ground_triangles.tolist()) for f in report.floors])
        return floors + repr(report.warnings), report.floor_of_triangle.tobytes(), areas

    at_once = found()
    monkeypatch.setattr(array_rows, "_CHUNK", 37)
    assert found() == at_once
    assert len(at_once[0]) > 100


def test_plumb_lines_do_not_depend_on_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(1)
    corners = rng.uniform(0, 4, (50, 3, 3))
    scene = scene_from_arrays(corners.reshape(-1, 3), np.arange(150).reshape(-1, 3))
    grid = {"low_m": np.zeros(2), "step_m": 0.2, "shape": (20, 20)}
    ids = np.arange(5, 45, dtype=np.int32)
    monkeypatch.setattr(array_rows, "_CHUNK", 7)
    got = sample_scene(scene, ids, **grid)
    expected = sample_columns(scene.vertices_m[scene.triangles[ids]], ids, **grid)
    assert got.triangle.size > 50
    for name in ("column", "z_m", "triangle"):
        np.testing.assert_array_equal(getattr(got, name), getattr(expected, name))

"""Work a chunk at a time gives what work on all triangles at once does."""

import numpy as np
import pytest

from planner_core.scene import chunks as chunk_module
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.chunks import chunks
from planner_core.scene.columns import sample_columns, sample_scene
from planner_core.scene.floors import find_floors
from planner_core.scene.patches import make_patches
from scenes_synthetic import house


def test_portions_follow_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chunk_module, "_CHUNK", 4)
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
    monkeypatch.setattr(chunk_module, "_CHUNK", 37)
    assert found() == at_once
    assert len(at_once[0]) > 100


def test_plumb_lines_do_not_depend_on_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(1)
    corners = rng.uniform(0, 4, (50, 3, 3))
    scene = scene_from_arrays(corners.reshape(-1, 3), np.arange(150).reshape(-1, 3))
    grid = {"low_m": np.zeros(2), "step_m": 0.2, "shape": (20, 20)}
    ids = np.arange(5, 45, dtype=np.int32)
    monkeypatch.setattr(chunk_module, "_CHUNK", 7)
    got = sample_scene(scene, ids, **grid)
    expected = sample_columns(scene.vertices_m[scene.triangles[ids]], ids, **grid)
    assert got.triangle.size > 50
    for name in ("column", "z_m", "triangle"):
        np.testing.assert_array_equal(getattr(got, name), getattr(expected, name))

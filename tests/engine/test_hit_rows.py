"""Compiled passes over hits: addresses against the rule in NumPy, sums on any number of threads."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core import compiled
from planner_core.engine.hit_rows import HitRows, Hits, patch_of_pixels
from planner_core.engine.open3d import Open3DEngine
from planner_core.engine.traced_surfaces import Traced, traced_surfaces
from planner_core.model import ReturnMoments
from planner_core.scene.patches import make_patches, patch_code, patch_of_points, squared_edges


def hits_on(traced: Traced, rng: np.random.Generator, n: int) -> Hits:
    """Random places on random triangles; many on the middle lines of the triangle, where a tie decides."""
    triangle = rng.integers(0, traced.scene.n_triangles, n).astype(np.uint32)
    uv = rng.dirichlet((1, 1, 1), n)[:, :2]
    exact = rng.random(n) < 0.5
    uv[exact] = (rng.integers(0, 9, (n, 2)) / 16)[exact]
    return Hits(rng.uniform(0.1, 9.0, n).astype(np.float32), triangle, uv.astype(np.float32))


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1), st.sampled_from([3.0, 0.3, 0.01, 0.0004]))
def test_compiled_addresses_are_those_of_numpy_bit_for_bit(shapes: SimpleNamespace, seed: int, area_m2: float) -> None:
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(30, 3, 3)) * rng.choice([0.1, 1.0, 5.0], (30, 1, 1))
    corners[::3] = np.round(corners[::3])  # isosceles and right-angled ones, whose edges tie
    scene = shapes.scene_of(corners.reshape(-1, 3), np.arange(90).reshape(-1, 3))
    patches = make_patches(scene, max_area_m2=area_m2)
    traced = traced_surfaces(scene, patches)
    hits = hits_on(traced, rng, 500)
    rows = HitRows(traced, patches.n_patches)
    marks = rows.no_marks()
    found = rows.patches(hits, 0.0, np.inf, marks)
    of, (u, v) = hits.triangle.astype(np.int64), hits.uv.T
    weights = np.stack([np.float32(1) - u - v, u, v], axis=1)
    edges = squared_edges(scene.vertices_m[scene.triangles])
    expected = patches.first_patch[of] + patch_code(weights, edges[of], patches.depth[of])
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_array_equal(np.flatnonzero(marks), np.unique(expected))
    points_m, triangle = rng.normal(size=(500, 3)), rng.integers(-1, 30, 500).astype(np.int32)
    at = {"points_m": points_m, "triangle": triangle}
    np.testing.assert_array_equal(patch_of_pixels(scene, patches, **at), patch_of_points(scene, patches, **at))


def test_misses_and_what_is_out_of_range_are_no_returns(shapes: SimpleNamespace) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(3, seed=1))
    patches = make_patches(scene, max_area_m2=0.1)
    rows = HitRows(traced_surfaces(scene, patches), patches.n_patches)
    range_m = np.array([0.5, 2.0, np.inf, 1.0, np.nextafter(np.float32(2.0), np.float32(3.0))], dtype=np.float32)
    triangle = np.array([0, 0, 2**32 - 1, 0, 0], dtype=np.uint32)
    hits = Hits(range_m, triangle, np.full((5, 2), 0.25, dtype=np.float32))
    assert (rows.patches(hits, 1.0, 2.0, rows.no_marks()) >= 0).tolist() == [False, True, False, True, False]
    assert (rows.patches(hits, 0.0, np.inf, rows.no_marks()) >= 0).tolist() == [True, True, False, True, True]


@pytest.mark.parametrize("n_threads", [1, 3, 7])
def test_nothing_depends_on_the_number_of_threads(
    shapes: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, n_threads: int
) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(40, seed=4))
    engine = Open3DEngine(scene, make_patches(scene, max_area_m2=0.05))
    template = shapes.template_of(40, 200)
    positions = np.array([[0.3, 0.2, 1.0], [-1.0, 0.5, 1.5]])
    before = engine.patch_returns(template, positions, moments=True)
    monkeypatch.setattr(compiled, "n_usable_cores", lambda: n_threads)
    after = engine.patch_returns(template, positions, moments=True)
    for name in ("starts", "patch", "n_returns"):
        assert getattr(before, name).tobytes() == getattr(after, name).tobytes()
    for name in ReturnMoments.__dataclass_fields__:
        assert getattr(before.moments, name).tobytes() == getattr(after.moments, name).tobytes()

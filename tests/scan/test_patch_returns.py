"""Returns by patch: counts and moments of both engines against sums in float64 over the returns of `scan`."""

from collections.abc import Callable
from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest

from planner_core.model import BeamTemplate, Patches, PatchReturns, ReturnMoments, ScanBatch, Scene
from planner_core.scan.template import directions
from planner_core.scene.patches import patch_triangles

MOMENTS = tuple(field.name for field in fields(ReturnMoments))
BOTH = pytest.mark.parametrize("which", [0, 1], ids=["opencl", "open3d"])


@pytest.fixture(scope="module")
def positions() -> np.ndarray:
    return np.random.default_rng(1).uniform((-3.9, -2.9, 0.1), (3.9, 2.9, 2.9), (9, 3))


def brute_force(
    scene: Scene, patches: Patches, template: BeamTemplate, batch: ScanBatch, positions: np.ndarray, index: int
) -> dict[str, np.ndarray]:
    """Sums over a scan's returns, patch by patch and in float64; patches in order."""
    rounded = replace(scene, vertices_m=scene.vertices_m.astype(np.float32).astype(np.float64))
    first_vertex = patch_triangles(rounded, patches)[:, 0]
    patch = batch.patch[index]
    on = patch >= 0
    beams = directions(template).astype(np.float32).astype(np.float64)[on]
    ranges, cosine, patch = (x[index][on].astype(np.float64) for x in (batch.range_m, batch.cos_incidence, batch.patch))
    patch = patch.astype(np.int64)
    p = positions[index].astype(np.float32) + beams * ranges[:, None] - first_vertex[patch]
    w, square = 2 - cosine, (p**2).sum(axis=1)
    seen = np.unique(patch)
    rows: dict[str, list] = {name: [] for name in ("n_returns", *MOMENTS)}
    for one in seen:
        mine = patch == one
        rows["n_returns"].append(mine.sum())
        rows["point_sum_m"].append(p[mine].sum(axis=0))
        rows["square_sum_m2"].append(square[mine].sum())
        rows["weight_sum"].append(w[mine].sum())
        rows["weighted_point_sum_m"].append((w[mine, None] * p[mine]).sum(axis=0))
        rows["weighted_square_sum_m2"].append((w[mine] * square[mine]).sum())
        rows["range_sum_m"].append(ranges[mine].sum())
        rows["least_range_m"].append(ranges[mine].min())
        rows["greatest_cos_incidence"].append(cosine[mine].max())
    return {"patch": seen, **{name: np.array(values) for name, values in rows.items()}}


def assert_same(a: PatchReturns, b: PatchReturns) -> None:
    """The same bits."""
    for name in ("starts", "patch", "n_returns"):
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes(), name
    for name in MOMENTS:
        assert getattr(a.moments, name).tobytes() == getattr(b.moments, name).tobytes(), name


def assert_sums_are(returns: PatchReturns, index: int, expected: dict[str, np.ndarray], size_m: np.ndarray) -> None:
    """Sums within rounding: 1e-6 of the patch's longest edge and 3e-6 m a return."""
    row = returns.row(index)
    np.testing.assert_array_equal(returns.patch[row], expected["patch"])
    np.testing.assert_array_equal(returns.n_returns[row], expected["n_returns"])
    assert returns.moments is not None
    n, size = expected["n_returns"], size_m[expected["patch"]]
    point = n * (1e-6 * size + 3e-6)
    square = n * (4e-6 * size**2 + 8e-6 * size + 1e-10)
    bounds = {
        "point_sum_m": point[:, None],
        "square_sum_m2": square,
        "weight_sum": n * 1e-6,
        "weighted_point_sum_m": 2 * point[:, None],
        "weighted_square_sum_m2": 2 * square,
        "range_sum_m": n * 1e-6,
    }
    for name, bound in bounds.items():
        off = np.abs(getattr(returns.moments, name)[row] - expected[name])
        assert (off <= bound).all(), f"{name}: {(off / bound).max()} of the bound"
    np.testing.assert_array_equal(returns.moments.least_range_m[row], expected["least_range_m"].astype(np.float32))
    np.testing.assert_array_equal(
        returns.moments.greatest_cos_incidence[row], expected["greatest_cos_incidence"].astype(np.float32)
    )


def longest_edge_m(scene: Scene, patches: Patches) -> np.ndarray:
    corners = patch_triangles(scene, patches)
    return np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max(axis=1)


@BOTH
def test_returns_are_the_sums_over_the_scan(
    open_both: Callable, shapes: SimpleNamespace, positions: np.ndarray, which: int
) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(60, seed=2))
    *engines, patches = open_both(scene)
    template = shapes.template_of(45, 333, range_min_m=0.3, range_max_m=5.0)  # no multiple of a tile
    batch = engines[which].scan(template, positions)
    returns = engines[which].patch_returns(template, positions, moments=True)
    size_m = longest_edge_m(scene, patches)
    for index in range(len(positions)):
        expected = brute_force(scene, patches, template, batch, positions, index)
        assert_sums_are(returns, index, expected, size_m)
        row = returns.row(index)
        np.testing.assert_allclose(
            returns.mean_range_m[row], expected["range_sum_m"] / expected["n_returns"], atol=1e-6
        )

"""Patches against an independent recursion in exact-ish Python, and against their own geometry."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.errors import RequirementError
from planner_core.model import LoadReport, Scene, SceneSource
from planner_core.scene.patches import (
    barycentric_of_points,
    make_patches,
    patch_code,
    patch_of_points,
    patch_triangles,
    squared_edges,
)


def scene_of(corners: np.ndarray) -> Scene:
    corners = np.asarray(corners, dtype=np.float64).reshape(-1, 3, 3)
    count = len(corners)
    return Scene(
        source=SceneSource(Path("memory"), "", "memory", "metre", 1.0, "Z"),
        vertices_m=corners.reshape(-1, 3),
        triangles=np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
        element_of_triangle=np.zeros(count, dtype=np.int32),
        elements=(),
        storeys=(),
        offset_m=np.zeros(3),
        report=LoadReport(count),
    )


def random_corners(count: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(count, 3, 3)) * 2


def area_of(corners: np.ndarray) -> np.ndarray:
    return 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)


def leaves_by_recursion(corners: np.ndarray, depth: int) -> list[np.ndarray]:
    """The rule as a recursion over real geometry in float64: the independent oracle."""
    if depth == 0:
        return [corners]
    length = [np.sum((corners[k] - corners[(k + 1) % 3]) ** 2) for k in range(3)]
    longest = int(np.argmax(length))  # the first of equals, as the rule says
    a, b, c = (corners[(longest + k) % 3] for k in range(3))
    m = (a + b) / 2
    return leaves_by_recursion(np.array([a, m, c]), depth - 1) + leaves_by_recursion(np.array([m, b, c]), depth - 1)


def test_patches_are_those_of_a_plain_recursion() -> None:
    corners = random_corners(30, seed=1)
    scene = scene_of(corners)
    patches = make_patches(scene, max_area_m2=0.1)
    expected = [leaf for c, d in zip(corners, patches.depth, strict=True) for leaf in leaves_by_recursion(c, int(d))]
    np.testing.assert_allclose(patch_triangles(scene, patches), np.array(expected), rtol=0, atol=1e-12)


def test_patch_areas_sum_to_the_triangle_and_none_exceeds_the_limit() -> None:
    scene = scene_of(random_corners(200, seed=2))
    patches = make_patches(scene, max_area_m2=0.05)
    geometry = patch_triangles(scene, patches)
    assert geometry.shape[0] == patches.n_patches == patches.area_m2.size
    np.testing.assert_allclose(area_of(geometry), patches.area_m2, rtol=1e-9)
    assert patches.area_m2.max() <= 0.05
    # Fewest halvings: one less would leave a divided triangle's patches too large.
    assert np.all(2 * patches.area_m2[patches.depth[patches.triangle_of_patch] > 0] > 0.05)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), limit=st.floats(0.002, 5.0))
def test_the_centroid_of_every_patch_has_its_address(seed: int, limit: float) -> None:
    scene = scene_of(random_corners(4, seed))
    patches = make_patches(scene, max_area_m2=limit)
    centroids = patch_triangles(scene, patches).mean(axis=1)
    got = patch_of_points(scene, patches, points_m=centroids, triangle=patches.triangle_of_patch)
    np.testing.assert_array_equal(got, np.arange(patches.n_patches))


@pytest.mark.parametrize(
    "corners",
    [[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 0], [4, 0, 0], [4, 4, 0]], [[0, 0, 0], [8, 0, 0], [4, 1, 0]]],
    ids=["right", "right, turned", "isosceles"],
)
def test_equal_edges_are_told_apart_by_their_order(corners: list[list[float]]) -> None:
    scene = scene_of(np.array(corners, dtype=np.float64))
    patches = make_patches(scene, max_area_m2=0.02)
    expected = leaves_by_recursion(np.array(corners, dtype=np.float64), int(patches.depth[0]))
    np.testing.assert_array_equal(patch_triangles(scene, patches), np.array(expected))
    centroids = np.mean(expected, axis=1)
    got = patch_of_points(scene, patches, points_m=centroids, triangle=np.zeros(len(centroids), dtype=np.int32))
    np.testing.assert_array_equal(got, np.arange(len(centroids)))


def test_code_of_a_single_step_follows_the_rule_by_hand() -> None:
    # Edge 12 is the longest: a = 1, b = 2, c = 0. la = 0.5 >= lb = 0.2: child 0.
    edges = [[1.0, 4.0, 2.0]]
    assert patch_code([[0.3, 0.5, 0.2]], edges, [1]).tolist() == [0]
    assert patch_code([[0.3, 0.2, 0.5]], edges, [1]).tolist() == [1]
    # On the dividing line itself: child 0.
    assert patch_code([[0.4, 0.3, 0.3]], edges, [1]).tolist() == [0]


def test_a_miss_and_a_depth_of_zero_have_the_plain_addresses() -> None:
    scene = scene_of(random_corners(3, seed=3))
    patches = make_patches(scene, max_area_m2=1e6)
    points = scene.vertices_m[scene.triangles].mean(axis=1)
    got = patch_of_points(scene, patches, points_m=points, triangle=np.array([2, -1, 0], dtype=np.int32))
    assert got.tolist() == [2, -1, 0]


def test_barycentric_weights_rebuild_the_point() -> None:
    rng = np.random.default_rng(4)
    corners = random_corners(100, seed=5)
    weights = rng.dirichlet([1, 1, 1], size=100)
    points = np.einsum("nk,nkd->nd", weights, corners)
    np.testing.assert_allclose(
        barycentric_of_points(corners, points, np.arange(100, dtype=np.int32)), weights, atol=1e-9
    )


def test_a_triangle_without_area_has_one_patch() -> None:
    patches = make_patches(scene_of(np.zeros((2, 3, 3))), max_area_m2=0.04)
    assert patches.n_patches == 2
    assert patches.area_m2.tolist() == [0.0, 0.0]


@pytest.mark.parametrize("limit", [0.0, -1.0, float("nan"), float("inf")])
def test_an_area_that_is_none_is_refused(limit: float) -> None:
    with pytest.raises(RequirementError, match="max_area_m2"):
        make_patches(scene_of(random_corners(1, seed=6)), max_area_m2=limit)


def test_more_patches_than_numbers_are_refused_with_an_area_that_works() -> None:
    scene = scene_of(1e3 * random_corners(20, seed=7))
    with pytest.raises(RequirementError, match="use at least") as caught:
        make_patches(scene, max_area_m2=1e-6)
    advised = float(str(caught.value).split("use at least ")[1].split()[0])
    assert make_patches(scene, max_area_m2=advised * 1.05).n_patches <= 2**31 - 1


def test_squared_edges_are_float32_of_the_float64_lengths() -> None:
    corners = random_corners(10, seed=8)
    expected = [[np.sum((c[k] - c[(k + 1) % 3]) ** 2) for k in range(3)] for c in corners]
    np.testing.assert_allclose(squared_edges(corners), np.array(expected, dtype=np.float32), rtol=1.2e-7)


def test_corners_rounded_to_float32_have_the_same_squared_edges_so_that_the_viewer_breaks_ties_as_we_do() -> None:
    # Walls of BIM models: right-angled, with equal edges, off the float32 grid.
    rng = np.random.default_rng(7)
    size_m = rng.choice([0.1, 0.3, 0.365, 2.7], (500, 1))
    origin_m = rng.uniform(-30, 30, (500, 3))
    corners = origin_m[:, None, :] + size_m[:, None, :] * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=float)
    assert (squared_edges(corners) == squared_edges(corners.astype(np.float32).astype(np.float64))).all()

"""The tree holds every triangle once, inside all boxes above it."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.device import Device
from planner_core.scan.surfaces import round_surfaces
from planner_core.scan.tree import Tree, build_tree


def check_tree(tree: Tree, corners: np.ndarray) -> None:
    """Walk the tree as a stranger would."""
    seen = np.zeros(len(corners), dtype=int)
    visited = np.zeros(len(tree.children), dtype=int)
    stack = [(0, np.full(3, -np.inf), np.full(3, np.inf))]
    while stack:
        node, low, high = stack.pop()
        visited[node] += 1
        for lane in range(8):
            box_low, box_high = tree.boxes[node, :3, lane], tree.boxes[node, 3:, lane]
            if (box_low > box_high).all():
                continue
            assert (box_low >= low).all()
            assert (box_high <= high).all()
            child = int(tree.children[node, lane])
            if child >= 0:
                stack.append((child, box_low, box_high))
                continue
            held = tree.triangle[~child]
            for j in np.flatnonzero(held >= 0):
                t = held[j]
                seen[t] += 1
                assert tree.slot[t] == (~child) * 8 + j
                np.testing.assert_array_equal(tree.geometry[~child, :9, j].reshape(3, 3), corners[t])
                assert (corners[t] >= box_low).all()
                assert (corners[t] <= box_high).all()
    assert (seen == 1).all()
    assert (visited == 1).all()


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 300), flat=st.booleans())
def test_tree_holds_every_triangle_once(
    device: Device, shapes: SimpleNamespace, seed: int, count: int, flat: bool
) -> None:
    corners = np.random.default_rng(seed).normal(size=(count, 3, 3))
    if flat:
        corners[..., 2] = 0.0
    scene = shapes.scene_of(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
    surfaces = round_surfaces(scene)
    check_tree(build_tree(scene, device), surfaces.corners_m)


@pytest.mark.parametrize("count", [8, 9, 500])
def test_tree_of_triangles_in_one_place_is_built(device: Device, shapes: SimpleNamespace, count: int) -> None:
    one = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    scene = shapes.scene_of(one, np.tile([[0, 1, 2]], (count, 1)))
    surfaces = round_surfaces(scene)
    check_tree(build_tree(scene, device), surfaces.corners_m)


def test_tree_is_the_same_every_time_and_small(device: Device, shapes: SimpleNamespace) -> None:
    scene = shapes.scene_of(*shapes.sphere_of(1.0, 60, 120))
    surfaces = round_surfaces(scene)
    a, b = build_tree(scene, device), build_tree(scene, device)
    for name in ("boxes", "children", "geometry", "triangle", "slot"):
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes(), name
    n_triangles = len(surfaces.corners_m)
    assert a.n_bytes < 150 * n_triangles
    # Quality: splits by area leave far fewer nodes and blocks on a line's way than there are.
    assert a.sah_cost < 0.05 * n_triangles


def test_normals_are_those_of_the_rounded_triangles(shapes: SimpleNamespace) -> None:
    scene = shapes.scene_of(*shapes.sphere_of(2.0, 10, 20))
    surfaces = round_surfaces(scene)
    corners = surfaces.corners_m.astype(np.float64)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    np.testing.assert_allclose(surfaces.normal, cross / np.linalg.norm(cross, axis=1, keepdims=True), atol=1e-7)
    none = round_surfaces(shapes.scene_of(np.zeros((3, 3)), np.array([[0, 1, 2]])))
    assert (none.normal == 0).all()

"""Samples of patches: where they lie, what they stand for, and the groups that patches are cast in."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import scenes_synthetic
from planner_core.engine import patch_samples
from planner_core.engine.patch_samples import (
    GROUP_BITS,
    N_FINE,
    N_RIM,
    KeptPlaces,
    PatchGroups,
    make_groups,
    patch_corner_weights,
    places_of,
    sample_pattern,
)
from planner_core.model import Int32Array, Patches, Scene
from planner_core.scene.patches import make_patches, patch_code, patch_triangles, squared_edges

SCENE = scenes_synthetic.build("l-room").scene
PATCHES = make_patches(SCENE, max_area_m2=0.3)


def random_scene(shapes: SimpleNamespace, rng: np.random.Generator, n: int) -> Scene:
    """Separate triangles from a centimetre to metres in size, some of them needles."""
    corners = rng.normal(size=(n, 3, 3)) * 10.0 ** rng.uniform(-2, 0.5, (n, 1, 1)) + rng.normal(size=(n, 1, 3)) * 3
    return shapes.scene_of(corners.reshape(-1, 3), np.arange(3 * n, dtype=np.int32).reshape(n, 3))


def test_the_samples_lie_strictly_inside_their_patch_and_have_its_address(shapes: SimpleNamespace) -> None:
    weights = sample_pattern()[:, :2]
    assert weights.shape == (N_RIM + N_FINE, 2)
    assert (weights > 0).all()
    assert (weights.sum(axis=1) < 1).all()
    rng = np.random.default_rng(1)
    scene = random_scene(shapes, rng, 40)
    patches = make_patches(scene, max_area_m2=0.02)
    triangle = patches.triangle_of_patch
    corner = patch_corner_weights(
        squared_edges(scene.vertices_m[scene.triangles])[triangle],
        patches.depth[triangle],
        np.arange(patches.n_patches, dtype=np.int32) - patches.first_patch[triangle],
    )
    at = (
        corner[:, None, 0]
        + weights[:, 0, None] * (corner[:, None, 1] - corner[:, None, 0])
        + weights[:, 1, None] * (corner[:, None, 2] - corner[:, None, 0])
    )
    barycentric = np.concatenate([1 - at.sum(axis=2, keepdims=True), at], axis=2).reshape(-1, 3)
    of = np.repeat(triangle, len(weights))
    code = patch_code(barycentric, squared_edges(scene.vertices_m[scene.triangles])[of], patches.depth[of])
    np.testing.assert_array_equal(patches.first_patch[of] + code, np.repeat(np.arange(patches.n_patches), len(weights)))


def test_the_samples_seen_estimate_the_share_that_a_straight_edge_leaves() -> None:
    pattern = sample_pattern()
    assert pattern[:, 2].sum() == pytest.approx(1.0)
    rng = np.random.default_rng(2)
    fine = rng.dirichlet((1, 1, 1), 20_000)[:, 1:]
    gap = []
    for angle, offset in zip(rng.uniform(0, 2 * np.pi, 60), rng.uniform(-0.3, 0.3, 60), strict=True):
        cut = np.array([np.cos(angle), np.sin(angle)])
        truth = ((fine - 1 / 3) @ cut > offset).mean()
        gap.append(pattern[(pattern[:, :2] - 1 / 3) @ cut > offset, 2].sum() - truth)
    assert np.abs(gap).max() < 0.15
    assert np.abs(gap).mean() < 0.05


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 60), area=st.floats(1e-3, 10.0))
def test_groups_hold_every_patch_once_and_bound_it(shapes: SimpleNamespace, seed: int, n: int, area: float) -> None:
    rng = np.random.default_rng(seed)
    scene = random_scene(shapes, rng, n)
    patches = make_patches(scene, max_area_m2=area)
    order = rng.permutation(n).astype(np.int32)
    corners = patch_triangles(scene, patches)
    check_groups(make_groups(scene, patches, order), patches, corners, np.ones(patches.n_patches, dtype=bool))
    only = rng.random(patches.n_patches) < rng.random()
    few = make_groups(scene, patches, order, only=only)
    check_groups(few, patches, corners, only)
    if not only.any():
        assert len(few.groups) == 0


def check_groups(grouped: PatchGroups, patches: Patches, corners: np.ndarray, only: np.ndarray) -> None:
    """Every patch of `only` is in a group, none is in two, and no group nor small triangle has none of them."""
    found: list[int] = []
    for number, (rank, code, count) in enumerate(grouped.groups):
        members = []
        while len(members) < count:
            triangle = grouped.order[rank]
            members.append(patches.first_patch[triangle] + code)
            code += 1
            if code == 1 << patches.depth[triangle]:
                rank, code = rank + 1, 0
        assert 1 <= count <= 1 << GROUP_BITS
        box = grouped.box[number].astype(np.float64)
        assert (corners[members] >= box[:3] - 1e-5).all()
        assert (corners[members] <= box[3:] + 1e-5).all()
        assert only[members].any()
        found += members
    assert len(set(found)) == len(found)
    assert set(np.flatnonzero(only)) <= set(found)
    if only.all():
        assert len(found) == patches.n_patches
        np.testing.assert_array_equal(np.sort(grouped.order), np.arange(patches.depth.size))


def test_patch_places_are_those_of_the_bisection(shapes: SimpleNamespace) -> None:
    scene = random_scene(shapes, np.random.default_rng(3), 30)
    patches = make_patches(scene, max_area_m2=0.01)
    places = places_of(scene, patches, np.arange(patches.n_patches, dtype=np.int32))
    np.testing.assert_allclose(places.corners_m, patch_triangles(scene, patches), atol=3e-6)
    np.testing.assert_allclose(places.area_m2, patches.area_m2, rtol=1e-3, atol=1e-7)


@pytest.mark.parametrize("most_kept", [0, 60, 150, patch_samples.MOST_KEPT])
def test_places_are_those_that_are_worked_out_anew_in_any_order_and_more_than_once(most_kept: int) -> None:
    kept = KeptPlaces(SCENE, PATCHES, most_kept=most_kept)
    random = np.random.default_rng(3)
    for size in (5, 40, 200):
        patch = random.integers(0, PATCHES.n_patches, size).astype(np.int32)
        found, right = kept.of(patch), places_of(SCENE, PATCHES, patch)
        for name in ("corners_m", "normal", "area_m2"):
            assert getattr(found, name).tobytes() == getattr(right, name).tobytes(), (size, name)


def test_no_place_is_worked_out_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Int32Array] = []

    def counting(scene: object, patches: object, patch: Int32Array) -> object:
        asked.append(patch)
        return places_of(SCENE, PATCHES, patch)

    monkeypatch.setattr(patch_samples, "places_of", counting)
    kept = KeptPlaces(SCENE, PATCHES)
    for first in (0, 10, 10, 30):
        kept.of(np.arange(first, first + 40, dtype=np.int32))
    assert np.array_equal(np.concatenate(asked), np.arange(70))

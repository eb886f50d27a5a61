"""Overlap and link strength against set arithmetic and geometry whose free motions are known."""

from itertools import combinations

import numpy as np
import pytest

from planner_core.model import Visibility
from planner_core.network.links import SharedSurface, overlap_links, surface_of_patches
from planner_core.scene.patches import make_patches, patch_triangles
from scenes_synthetic import rooms


def random_rows(seed, n=6, n_patches=50):
    rng = np.random.default_rng(seed)
    rows = [np.sort(rng.choice(n_patches, rng.integers(1, 30), replace=False)) for _ in range(n)]
    starts = np.concatenate([[0], np.cumsum([row.size for row in rows])])
    return Visibility(starts.astype(np.int64), np.concatenate(rows).astype(np.int32), n_patches), rng.random(n_patches)


def plane(normal_axis, offset_m, n=8, spread_m=2.0):
    """Grid of points on a plane at right angles to an axis, and their normals."""
    u, v = np.meshgrid(np.linspace(-spread_m, spread_m, n), np.linspace(-spread_m, spread_m, n))
    others = [axis for axis in range(3) if axis != normal_axis]
    points = np.zeros((n * n, 3))
    points[:, others[0]], points[:, others[1]], points[:, normal_axis] = u.ravel(), v.ravel(), offset_m
    return points, np.tile(np.eye(3)[normal_axis], (n * n, 1))


def strength_of(*planes):
    points, normals = (np.concatenate(parts) for parts in zip(*planes, strict=True))
    return strength_of_surface(points, normals)


def strength_of_surface(points, normals):
    """Of the link of two stations that both see all patches, of one size."""
    n = points.shape[0]
    both = Visibility(np.array([0, n, 2 * n]), np.tile(np.arange(n, dtype=np.int32), 2), n)
    (link,) = overlap_links(both, np.full(n, 0.04), ("A", "B"), SharedSurface(points, normals), np.zeros((2, 3)))
    return link.strength


@pytest.mark.parametrize("seed", range(5))
def test_overlap_is_the_smaller_share_of_common_area(seed):
    visibility, area_m2 = random_rows(seed)
    links = overlap_links(visibility, area_m2, tuple("ABCDEF"), min_overlap=0.0)
    got = {(link.a, link.b): link.overlap for link in links}
    expected = {}
    sets = {name: set(visibility.row(i).tolist()) for i, name in enumerate("ABCDEF")}
    for a, b in combinations("ABCDEF", 2):
        if common := sum(area_m2[p] for p in sets[a] & sets[b]):
            expected[a, b] = min(common / sum(area_m2[p] for p in sets[one]) for one in (a, b))
    assert got == pytest.approx(expected), seed
    assert len(got) > 5, "hardly any two have anything in common"


def test_links_are_listed_from_the_smallest_overlap_on():
    visibility = Visibility(np.array([0, 10, 20, 30]), np.r_[0:10, 8:18, 17:27].astype(np.int32), 27)
    links = overlap_links(visibility, np.full(27, 0.04), ("A", "B", "C"), min_overlap=0.15)
    assert [(link.a, link.b) for link in links] == [("A", "B")]
    assert links[0].overlap == pytest.approx(0.2)
    assert np.isnan(links[0].strength)


def test_strength_is_zero_where_a_motion_is_free():
    assert strength_of(plane(2, 0.0)) == pytest.approx(0.0, abs=1e-9)
    # A straight corridor: two walls, floor and ceiling hold everything but sliding along it.
    corridor = [plane(1, -1.0), plane(1, 1.0), plane(2, -1.0), plane(2, 1.0)]
    assert strength_of(*corridor) == pytest.approx(0.0, abs=1e-9)
    assert strength_of(*corridor, plane(0, 4.0)) > 0.02


def test_strength_is_a_figure_of_shape_alone():
    room = [plane(0, -2.0), plane(0, 2.0), plane(1, -2.0), plane(1, 2.0), plane(2, -2.0), plane(2, 2.0)]
    strength = strength_of(*room)
    assert 0.1 < strength <= 1.0
    larger = [(points * 10 + np.array([500.0, 3.0, -7.0]), normals) for points, normals in room]
    assert strength_of(*larger) == pytest.approx(strength, abs=1e-9)
    angle = 0.7
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])
    assert strength_of(*[(p @ turn.T, n @ turn.T) for p, n in room]) == pytest.approx(strength, abs=1e-9)


def test_strength_of_too_little_surface_is_zero():
    points, normals = np.random.default_rng(0).random((7, 3)), np.eye(3)[[0, 1, 2, 0, 1, 2, 0]]
    assert strength_of_surface(points[:5], normals[:5]) == pytest.approx(0.0, abs=1e-9)
    assert strength_of_surface(points, normals) > 1e-4


def test_geometry_of_patches_is_that_of_their_triangles():
    scene = rooms.box().scene
    patches = make_patches(scene, max_area_m2=0.5)
    seen = np.zeros(patches.n_patches, dtype=bool)
    seen[::7] = True
    surface = surface_of_patches(scene, patches, seen)
    corners = patch_triangles(scene, patches)
    np.testing.assert_allclose(surface.centroid_m[seen], corners[seen].mean(axis=1))
    edge = corners[seen][:, 1] - corners[seen][:, 0]
    np.testing.assert_allclose((surface.normal[seen] * edge).sum(axis=1), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(surface.normal[seen], axis=1), 1.0)

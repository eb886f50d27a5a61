"""No beam passes between two triangles that share an edge or a vertex: rays aimed at them, zero leaks."""

from types import SimpleNamespace

import numpy as np
import pytest

from planner_core.device import Device
from planner_core.engine.opencl import OpenCLEngine
from planner_core.model import BeamTemplate
from planner_core.scene.patches import make_patches

CENTRES = ([0.0, 0.0, 0.0], [517.3, -288.1, 31.7])


def edge_points(vertices: np.ndarray, triangles: np.ndarray, per_edge: int, seed: int) -> np.ndarray:
    """All vertices, and random points on all edges."""
    edges = np.unique(
        np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1), axis=0
    )
    at = np.random.default_rng(seed).uniform(size=(len(edges), per_edge, 1))
    a, b = vertices[edges[:, 0]][:, None], vertices[edges[:, 1]][:, None]
    return np.concatenate([vertices, (a + at * (b - a)).reshape(-1, 3)])


@pytest.mark.parametrize("centre", CENTRES, ids=["near", "far"])
@pytest.mark.parametrize("radius_m", [0.05, 2.0, 300.0])
@pytest.mark.parametrize("rings", [pytest.param(5, id="coarse"), pytest.param(60, id="fine", marks=pytest.mark.slow)])
def test_no_ray_from_inside_leaves_a_closed_mesh(
    device: Device, shapes: SimpleNamespace, centre: list[float], radius_m: float, rings: int
) -> None:
    vertices, triangles = shapes.sphere_of(radius_m, rings, 2 * rings)
    scene = shapes.scene_of(vertices + centre, triangles)
    engine = OpenCLEngine(scene, make_patches(scene, max_area_m2=1e9), device)
    # What the kernels see: vertices rounded to float32.
    seen = scene.vertices_m.astype(np.float32).astype(np.float64)
    targets = edge_points(seen, triangles, 8, seed=1)
    for inside in ([0.0, 0.0, 0.0], [0.31, 0.17, -0.22], [0.0, 0.0, 0.9]):
        origin = np.float32(np.array(centre) + np.array(inside) * radius_m).astype(np.float64)
        aims = targets - origin
        hits = engine.cast_rays(np.broadcast_to(origin, aims.shape), aims, range_max_m=np.inf)
        leaks = int((hits.triangle < 0).sum())
        assert leaks == 0, f"{leaks} of {len(aims)} rays left the mesh from {inside}"
        # Nor did any pass through to the far side: the hit is where the ray was aimed at.
        distance = np.linalg.norm(aims, axis=1)
        np.testing.assert_allclose(hits.range_m, distance, rtol=1e-4, atol=1e-6 * np.abs(seen).max())


@pytest.mark.parametrize("distance", [1.5, 30.0, 1000.0])
def test_no_ray_from_outside_enters_between_front_faces(
    device: Device, shapes: SimpleNamespace, distance: float
) -> None:
    vertices, triangles = shapes.sphere_of(1.0, 30, 60)
    scene = shapes.scene_of(vertices, triangles)
    engine = OpenCLEngine(scene, make_patches(scene, max_area_m2=1e9), device)
    seen = vertices.astype(np.float32).astype(np.float64)
    origin = np.float32(distance * np.array([0.6, 0.64, 0.48])).astype(np.float64)
    targets = edge_points(seen, triangles, 10, seed=2)
    # Well on the near side: the outward direction looks at the origin, so both triangles of the edge do.
    targets = targets[(targets * (origin - targets)).sum(axis=1) > 0.3 * np.linalg.norm(origin - targets, axis=1)]
    aims = targets - origin
    hits = engine.cast_rays(np.broadcast_to(origin, aims.shape), aims, range_max_m=np.inf)
    assert len(aims) > 3000
    np.testing.assert_allclose(hits.range_m, np.linalg.norm(aims, axis=1), rtol=5e-5, atol=1e-5)


@pytest.mark.parametrize("centre", CENTRES, ids=["near", "far"])
def test_no_beam_of_a_scan_leaves_a_mesh_whose_vertices_lie_on_beams(
    device: Device, shapes: SimpleNamespace, centre: list[float]
) -> None:
    """Beams at the very azimuths and elevations of the vertices: whole columns run along edges."""
    rings, sides = 64, 128
    vertices, triangles = shapes.sphere_of(3.0, rings, sides)
    scene = shapes.scene_of(vertices + centre, triangles)
    engine = OpenCLEngine(scene, make_patches(scene, max_area_m2=1e9), device)
    template = BeamTemplate(
        azimuth_rad=np.arange(4 * sides) * 2 * np.pi / (4 * sides),
        elevation_rad=np.pi / 2 - np.linspace(0, np.pi, 2 * rings + 1),
        range_min_m=0.0,
        range_max_m=np.inf,
    )
    batch = engine.scan(template, np.array([centre]))
    assert int((batch.triangle < 0).sum()) == 0
    assert np.abs(batch.range_m - 3.0).max() < 3.0 * (1 - np.cos(np.deg2rad(2.9))) + 1e-3


def test_needles_and_edge_on_walls_do_not_leak(device: Device, shapes: SimpleNamespace) -> None:
    """A room whose walls are cut into needles a hundredth of a millimetre wide, with the origin IN a plane of them."""
    cuts = np.concatenate([np.linspace(0, 1, 9), 0.5 + 1e-5 * np.arange(1, 40)])
    grid = np.unique(cuts) * 4 - 2
    vertices: list[np.ndarray] = []
    triangles: list[tuple[int, int, int]] = []
    for axis in range(3):
        for side in (-2.0, 2.0):
            first = len(vertices)
            for u in grid:
                for v in (-2.0, 2.0):
                    vertices.append(np.insert(np.array([u, v]), axis, side))
            for k in range(len(grid) - 1):
                a, b, c, d = (first + 2 * k + j for j in range(4))
                triangles += [(a, b, c), (b, d, c)]
    # Plates inside the room whose planes go through the origin exactly.
    first = len(vertices)
    vertices += [np.array(p) for p in ([1.0, 0.0, -1.0], [1.5, 0.0, -1.0], [1.0, 0.0, 1.0])]
    triangles.append((first, first + 1, first + 2))
    unique, index = np.unique(np.array(vertices), axis=0, return_inverse=True)
    cells = index.reshape(-1)[np.array(triangles)].astype(np.int32)
    scene = shapes.scene_of(unique, cells)
    engine = OpenCLEngine(scene, make_patches(scene, max_area_m2=1e9), device)
    seen = unique.astype(np.float32).astype(np.float64)
    # Edges of the walls: the sides of the room are not shared vertex by vertex, so aim inside them.
    rng = np.random.default_rng(3)
    targets = edge_points(seen, cells[:-1], 30, seed=4)
    targets = targets[(np.abs(targets) < 1.999).sum(axis=1) == 2]
    targets = np.concatenate([targets, rng.uniform(-1.9, 1.9, (2000, 3)) * [1, 1, 0] + [0, 0, 2.0]])
    hits = engine.cast_rays(np.zeros_like(targets), targets, range_max_m=np.inf)
    assert int((hits.triangle < 0).sum()) == 0
    away = np.abs(targets[:, 1]) > 1e-4  # beams in the plate's plane may end on its edge or pass
    np.testing.assert_allclose(hits.range_m[away], np.linalg.norm(targets[away], axis=1), rtol=1e-5)

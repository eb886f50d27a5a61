"""Pieces against a search over all pairs of edges, by geometry."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from planner_core.coverage.pieces import connected_pieces
from planner_core.scene.patches import make_patches, patch_triangles


def overlap_m(a, b, tolerance_m=1e-9):
    """Length that two segments (2, 3) have in common; 0 where they are not on one line."""
    along = a[1] - a[0]
    length_m = np.linalg.norm(along)
    along = along / length_m
    off = b - a[0]
    away_m = np.linalg.norm(off - np.outer(off @ along, along), axis=1)
    if away_m.max() > tolerance_m:
        return 0.0
    low, high = np.sort(off @ along)
    return min(length_m, high) - max(0.0, low)


def pieces_by_geometry(corners, group):
    pairs = []
    for i in range(len(corners)):
        for j in range(i):
            if group[i] != group[j]:
                continue
            edges = [[(corners[k][e], corners[k][(e + 1) % 3]) for e in range(3)] for k in (i, j)]
            if any(overlap_m(np.array(a), np.array(b)) > 1e-6 for a in edges[0] for b in edges[1]):
                pairs.append((i, j))
    rows = np.array(pairs).reshape(-1, 2)
    shape = (len(corners), len(corners))
    return connected_components(coo_array((np.ones(len(rows)), (rows[:, 0], rows[:, 1])), shape=shape), directed=False)[
        1
    ]


def same_partition(a, b):
    pairs = np.unique(np.column_stack([a, b]), axis=0)
    return len(pairs) == len(np.unique(a)) == len(np.unique(b))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(8))
def test_pieces_are_those_of_geometry(build, seed):
    """Triangles of very different sizes around one vertex and along one edge, so that edges hang on each other."""
    rng = np.random.default_rng(seed)
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0.2, 1, 0], [0.6, -0.05, 0], [0.1, -0.8, 0.3], [0.9, 0.9, 0.4]])
    vertices = vertices.astype(np.float32).astype(np.float64)
    scene = build.scene_of(vertices, [[0, 1, 2], [1, 0, 3], [0, 4, 3], [1, 5, 2]])
    patches = make_patches(scene, max_area_m2=0.02)
    ids = np.sort(rng.choice(patches.n_patches, size=int(0.6 * patches.n_patches), replace=False)).astype(np.int32)
    group = rng.integers(0, 2, ids.size)
    expected = pieces_by_geometry(patch_triangles(scene, patches)[ids], group)
    assert same_partition(connected_pieces(scene, patches, ids, group), expected)


def test_whole_surface_of_a_box_is_one_piece(build):
    scene = build.scene_of(build.box((0, 0, 0), (1, 2, 3)), build.faces)
    patches = make_patches(scene, max_area_m2=0.05)
    every = np.arange(patches.n_patches, dtype=np.int32)
    assert (connected_pieces(scene, patches, every, np.zeros(every.size, dtype=np.int64)) == 0).all()


def test_patches_that_meet_in_a_corner_are_two_pieces(build):
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], dtype=np.float64)
    scene = build.scene_of(vertices, [[0, 1, 2], [0, 3, 4]])
    patches = make_patches(scene, max_area_m2=1.0)
    piece = connected_pieces(scene, patches, np.array([0, 1], dtype=np.int32), np.zeros(2, dtype=np.int64))
    assert piece.tolist() == [0, 1]


def test_no_patches_make_no_pieces(build):
    scene = build.scene_of(np.eye(3), [[0, 1, 2]])
    patches = make_patches(scene, max_area_m2=1.0)
    assert connected_pieces(scene, patches, np.zeros(0, dtype=np.int32), np.zeros(0, dtype=np.int64)).size == 0

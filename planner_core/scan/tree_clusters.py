"""The binary tree over a scene's triangles, built bottom up: kernels/tree_leaves.cl, kernels/tree_merge.cl.

Float32, metres, local frame. Deterministic: places follow from prefix sums, and ties from places.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.device import Buffer, Device
from planner_core.device.sort import chunk_count, sort_pairs

#: Bits a coordinate of the Morton code: cells of 4 mm in a building of a kilometre. 7 passes of the sort.
_MORTON_BITS = 18
#: Neighbours to either side that a cluster looks at: few while there are many clusters, since what they form first is
#: taken apart again as treelets; more later, when it costs nothing.
_RADIUS, _LATE_RADIUS, _LATE_SHARE = 8, 16, 8
#: Clusters that look for neighbours side by side.
_LANES = {"cpu": 8}
_PAD = 32
#: Last bits of a distance that do not count: 1/64 of it.
_COARSE = 17
#: A round that merges less than this share of the clusters is followed by one with coarser distances, up to none at
#: all, when neighbours merge in pairs: the number of rounds and the depth of the tree stay bounded.
_SLOW_SHARE = 32
_COARSER_BY, _COARSEST = 3, 31
#: Triangles of a treelet, kernels/tree_treelet.h.
_TREELET = 64


@dataclass(frozen=True)
class Binary:
    """A binary tree on the device. Leaf i is triangle order[i]; inner node k is number n_triangles + k, the root last.

    order : (T,) int32. halves : (T - 1, 2) int32, numbers. choices : (T - 1,) uint32, how wide nodes are cut out of it,
    kernels/tree_cost.h. spare : buffers of 4, 4 and 8 bytes a triangle whose content is of no more use.
    """

    order: Buffer
    halves: Buffer
    choices: Buffer
    n_triangles: int
    spare: tuple[Buffer, Buffer, Buffer]


@dataclass
class _Clusters:
    """Buffers of one round, see kernels/tree_merge.cl."""

    boxes: Buffer
    number: Buffer
    size: Buffer
    cost: Buffer


def cluster_triangles(device: Device, vertices: Buffer, corners: Buffer, n_triangles: int) -> Binary:
    """Build the binary tree of `n_triangles` >= 1 triangles: corners (T, 3) int32 of vertices (V, 3) float32."""
    keys, order, spare_keys, spare_order = (
        device.allocate("order of triangles", size * n_triangles) for size in (8, 4, 8, 4)
    )
    leaves = device.program("tree_leaves.cl", {"LANES": 1, "MORTON_BITS": _MORTON_BITS, "PAD": _PAD})
    n_chunks = chunk_count(device, n_triangles)
    mesh = (vertices, corners, np.int32(n_triangles))
    bounds, grid = device.allocate("bounds of chunks", 32 * n_chunks), device.allocate("grid", 16)
    leaves.run("bound_centroids", (n_chunks,), *mesh, bounds)
    leaves.run("join_bounds", (1,), bounds, np.int32(n_chunks), grid)
    leaves.run("make_keys", (n_chunks,), *mesh, grid, keys, order)
    keys, order = sort_pairs(device, keys, order, spare_keys, spare_order, n=n_triangles, n_bits=3 * _MORTON_BITS)
    stride = n_triangles + 2 * _PAD
    now, then = (
        _Clusters(
            *(
                device.allocate("clusters", size)
                for size in (24 * stride, 4 * n_triangles, 4 * n_triangles, 32 * n_triangles)
            )
        )
        for _ in range(2)
    )
    leaves.run("make_leaves", (n_chunks,), *mesh, order, now.boxes, np.int32(stride), now.number, now.size)
    binary = Binary(
        order=order,
        halves=device.allocate("binary tree", 8 * n_triangles),
        choices=device.allocate("binary tree", 4 * n_triangles),
        n_triangles=n_triangles,
        spare=(now.number, then.number, keys),
    )
    _merge_all(device, vertices, corners, binary, now, then, stride)
    return binary


def _merge_all(
    device: Device, vertices: Buffer, corners: Buffer, binary: Binary, now: _Clusters, then: _Clusters, stride: int
) -> None:
    """Merge clusters round by round, until one is left."""
    n_triangles = binary.n_triangles
    program = device.program("tree_merge.cl", {"LANES": _LANES.get(device.kind, 1), "PAD": _PAD, "TREELET": _TREELET})
    tree = (vertices, corners, binary.order, np.int32(n_triangles), binary.halves, binary.choices)
    nearest = device.allocate("nearest clusters", 4 * n_triangles)
    counts = device.allocate("counts of chunks", 8 * (chunk_count(device, n_triangles) + 1))
    totals = np.empty(2, dtype=np.int32)
    n, n_nodes, coarse = n_triangles, 0, _COARSE
    while n > 1:
        n_chunks = chunk_count(device, n)
        radius = _RADIUS if n * _LATE_SHARE > n_triangles else _LATE_RADIUS
        row = (np.int32(stride), np.int32(n))
        program.run("find_nearest", (n_chunks,), now.boxes, *row, np.int32(radius), np.int32(coarse), nearest)
        program.run("count_merges", (n_chunks,), nearest, np.int32(n), counts)
        program.run("sum_counts", (1,), counts, np.int32(n_chunks))
        clusters = (now.boxes, now.number, now.size, now.cost)
        target = (then.boxes, then.number, then.size, then.cost)
        program.run("merge_clusters", (n_chunks,), *tree, *clusters, *row, nearest, counts, np.int32(n_nodes), *target)
        device.read(counts, totals)
        n, merged = int(totals[0]), int(totals[1])
        n_nodes += merged
        coarse = min(coarse + _COARSER_BY, _COARSEST) if merged * _SLOW_SHARE < n else _COARSE
        now, then = then, now
    if 1 < n_triangles <= _TREELET:
        program.run("finish_treelet", (1,), *tree)

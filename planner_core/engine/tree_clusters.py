"""The binary tree over a scene's triangles, built bottom up: kernels/tree_leaves.cl, kernels/tree_merge.cl.

Float32, metres, local frame. Deterministic: places follow from prefix sums, and ties from places.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner_core.device import Buffer, Device, Program
from planner_core.device.sort import chunk_count, sort_pairs

#: Bits a coordinate of the Morton code: cells of 4 mm in a scene of a kilometre, in 6 passes of the sort on a CPU.
_MORTON_BITS = 18
#: Neighbours to either side that a cluster looks at: few while there are many clusters, since what they form first is
#: taken apart again as treelets; more later, when it costs nothing.
_RADIUS, _LATE_RADIUS, _LATE_SHARE = 8, 16, 8
#: Clusters that look for neighbours side by side.
_LANES = {"cpu": 8}
_PAD = 32
#: No more clusters than this are merged by one work-item, in one launch: dozens of rounds of little work.
_FEW = {"cpu": 16384}
_DEFAULT_FEW = 64
#: Last bits of a distance that do not count: 1/64 of it.
_COARSE = 17
#: A round that merges less than this share of the clusters is followed by one with coarser distances, up to none at
#: all, when neighbours merge in pairs: the number of rounds and the depth of the tree stay bounded.
_SLOW_SHARE = 32
_COARSER_BY, _COARSEST = 3, 31


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


def cluster_triangles(device: Device, triangles: Mapping[str, NDArray[Any]], n_triangles: int) -> Binary:
    """Build the binary tree of `n_triangles` >= 1 triangles: vertices (V, 3) float32, corners (T, 3) int32."""
    leaves = device.program("tree_leaves.cl", {"LANES": 1, "MORTON_BITS": _MORTON_BITS, "PAD": _PAD})
    n_chunks = chunk_count(device, n_triangles)
    stride = n_triangles + 2 * _PAD
    sizes = (24 * stride, 4 * n_triangles, 4 * n_triangles)
    # The mesh goes before the other half of the clusters comes: together they would be the most memory of all.
    with device.inputs("triangles", triangles) as there:
        mesh = (there["vertices"], there["corners"], np.int32(n_triangles))
        order, free_order, free_keys, free_keys_too = _sort_along_curve(device, leaves, mesh, n_chunks)
        now = tuple(device.allocate("clusters", size, is_filled=True) for size in sizes)
        units = device.allocate("units of treelets", 32 * n_triangles, is_filled=True)
        leaves.run("make_leaves", (n_chunks,), *mesh, order, now[0], np.int32(stride), *now[1:], units)
        device.finish("sorting triangles")
    then = tuple(device.allocate("clusters", size, is_filled=True) for size in sizes)
    binary = Binary(
        order=order,
        halves=free_keys,
        choices=free_order,
        n_triangles=n_triangles,
        spare=(now[1], then[1], free_keys_too),
    )
    _merge_all(device, binary, units, now, then, np.int32(stride))
    for buffer in (units, now[0], then[0], now[2], then[2]):
        buffer.release()
    return binary


def _sort_along_curve(
    device: Device, leaves: Program, mesh: tuple[Buffer, Buffer, np.int32], n_chunks: int
) -> tuple[Buffer, Buffer, Buffer, Buffer]:
    """Order of the triangles, (T,) int32; then buffers of 4, 8 and 8 bytes a triangle that are free again."""
    n = int(mesh[2])
    keys, spare_keys = (device.allocate("Morton codes", 8 * n, is_filled=True) for _ in range(2))
    order, spare_order = (device.allocate("order of triangles", 4 * n, is_filled=True) for _ in range(2))
    bounds, grid = device.allocate("bounds of chunks", 32 * n_chunks), device.allocate("grid", 16)
    leaves.run("bound_centroids", (n_chunks,), *mesh, bounds)
    leaves.run("join_bounds", (1,), bounds, np.int32(n_chunks), grid)
    leaves.run("make_keys", (n_chunks,), *mesh, grid, keys, order)
    _, by_key = sort_pairs(device, keys, order, spare_keys, spare_order, n=n, n_bits=3 * _MORTON_BITS)
    return by_key, spare_order if by_key is order else order, keys, spare_keys


def _merge_all(
    device: Device,
    binary: Binary,
    units: Buffer,
    now: tuple[Buffer, ...],
    then: tuple[Buffer, ...],
    stride: np.int32,
) -> None:
    """Merge clusters round by round, until one is left. `now`, `then`: boxes, number, size; kernels/tree_merge.cl."""
    n_triangles = binary.n_triangles
    program = device.program("tree_merge.cl", {"LANES": _LANES.get(device.kind, 1), "PAD": _PAD})
    tree = (np.int32(n_triangles), binary.halves, binary.choices, units)
    nearest = binary.spare[2]
    counts = device.allocate("counts of chunks", 8 * (chunk_count(device, n_triangles) + 1))
    totals = np.empty(2, dtype=np.int32)
    n, n_nodes, coarse, late = n_triangles, 0, _COARSE, n_triangles // _LATE_SHARE
    while n > _FEW.get(device.kind, _DEFAULT_FEW):
        n_chunks, size = chunk_count(device, n), np.int32(n)
        radius = _RADIUS if n > late else _LATE_RADIUS
        program.run("find_nearest", (n_chunks,), now[0], stride, size, np.int32(radius), np.int32(coarse), nearest)
        program.run("count_merges", (n_chunks,), nearest, size, counts)
        program.run("sum_counts", (1,), counts, np.int32(n_chunks))
        links = (nearest, counts, np.int32(n_nodes))
        program.run("merge_clusters", (n_chunks,), *tree, *now, stride, size, *links, *then)
        device.read(counts, totals)
        n, merged = int(totals[0]), int(totals[1])
        n_nodes += merged
        coarse = min(coarse + _COARSER_BY, _COARSEST) if merged * _SLOW_SHARE < n else _COARSE
        now, then = then, now
    radii = tuple(np.int32(value) for value in (_RADIUS, _LATE_RADIUS, late))
    distances = tuple(np.int32(value) for value in (coarse, _COARSE, _COARSER_BY, _COARSEST, _SLOW_SHARE))
    clusters = (*now, stride, np.int32(n), nearest, np.int32(n_nodes), *then)
    program.run("merge_rest", (1,), *tree, *clusters, *radii, *distances, counts)
    device.read(counts, totals)
    n_chunks = chunk_count(device, n_triangles)
    level_of = nearest  # its memory: all clusters are merged
    program.run("list_treelets", (n_chunks,), np.int32(n_triangles - 1), binary.choices, level_of)
    for level in range(int(totals[0])):
        program.run("build_treelets", (n_chunks,), *tree, level_of, np.int32(level))

"""The tree over the scene's triangles: blocks of eight triangles, nodes of eight children; layout in kernels/tree.h.

Built on the device by locally-ordered clustering, docs/method/tree.md. Float32, metres, local frame. Deterministic: the
same scene gives the same bytes, on any number of cores.

1. A binary tree is built bottom up: kernels/tree_leaves.cl, kernels/tree_merge.cl. Places follow from prefix sums, and
   ties from places.
2. Wide nodes and blocks are cut out of it: kernels/tree_widen.cl; layout of blocks in kernels/block.h.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from planner_core.device import Buffer, Device, Program
from planner_core.device.runtime import has_float64
from planner_core.device.sort import chunk_count, sort_pairs
from planner_core.engine.traced_surfaces import round_surfaces
from planner_core.model import Float32Array, FloatArray, Int32Array, Scene
from planner_core.scene.patches import squared_edges

_Scalar = TypeVar("_Scalar", bound=np.generic)
#: Trees larger than this don't fit into a processor's caches: the walk then asks for memory ahead.
_CACHED_BYTES = 16 * 2**20
WIDTH = 8
"""Children of a node and triangles of a block, fixed in the kernels."""
#: Bits a coordinate of the Morton code: cells of 4 mm in a scene of a kilometre, in 6 passes of the sort on a CPU.
_MORTON_BITS = 18
#: Neighbours to either side that a cluster looks at: few while there are many clusters, since what they form first is
#: taken apart again as treelets; more later, when it costs nothing.
_RADIUS, _LATE_RADIUS, _LATE_SHARE = 8, 16, 8
#: Clusters that look for neighbours side by side.
_LANES = {"cpu": 8}
_PAD = 32
#: No more clusters than this are merged by one work-item, in one launch: dozens of rounds of little work.
_FEW_CLUSTERS = {"cpu": 16384}
_DEFAULT_FEW_CLUSTERS = 64
#: Last bits of a distance that do not count: 1/64 of it.
_COARSE = 17
#: A round that merges less than this share of the clusters is followed by one with coarser distances, up to none at
#: all, when neighbours merge in pairs: the number of rounds and the depth of the tree stay bounded.
_SLOW_SHARE = 32
_COARSER_BY, _COARSEST = 3, 31
#: Levels of no more nodes than this are walked by one work-item, in one launch.
_FEW_NODES = {"cpu": 1024}
_DEFAULT_FEW_NODES = 32
#: Numbers of the table that `list_levels` writes.
_TABLE = 64


@dataclass(frozen=True)
class Tree:
    """Arrays for the kernels, on the device; properties of the same names copy them to the host when first used.

    on_device : `boxes`, `children`, `geometry`, `triangle`, `slot`, `edges`, in the order of the kernels' arguments.
    """

    device: Device
    on_device: Mapping[str, Buffer]
    n_triangles: int
    n_nodes: int
    n_blocks: int
    n_levels: int
    """Levels of wide nodes."""

    @property
    def n_bytes(self) -> int:
        """Memory of all arrays."""
        return sum(buffer.n_bytes for buffer in self.on_device.values())

    @cached_property
    def boxes(self) -> Float32Array:
        """(N, 6, 8) float32 of every child of every node; an unused child's box is inside out."""
        return self._copy("boxes", np.empty((self.n_nodes, 6, WIDTH), dtype=np.float32))

    @cached_property
    def children(self) -> Int32Array:
        """(N, 8) int32: a node, or ~block."""
        return self._copy("children", np.empty((self.n_nodes, WIDTH), dtype=np.int32))

    @cached_property
    def geometry(self) -> Float32Array:
        """(B, 12, 8) float32: corners and normal of the triangles of every block."""
        return self._copy("geometry", np.empty((self.n_blocks, 12, WIDTH), dtype=np.float32))

    @cached_property
    def triangle(self) -> Int32Array:
        """(B, 8) int32, -1 in an empty lane."""
        return self._copy("triangle", np.empty((self.n_blocks, WIDTH), dtype=np.int32))

    @cached_property
    def slot(self) -> Int32Array:
        """(T,) int32, block * 8 + lane of every triangle."""
        return self._copy("slot", np.empty(self.n_triangles, dtype=np.int32))

    @cached_property
    def edges(self) -> Float32Array:
        """(T, 3) float32, squared edge lengths in m2, see `planner_core.scene.patches.squared_edges`."""
        return self._copy("edges", np.empty((self.n_triangles, 3), dtype=np.float32))

    @cached_property
    def bounds_m(self) -> Float32Array:
        """(2, 3) float32: lowest and highest corner of all triangles."""
        root = np.empty((6, WIDTH), dtype=np.float32)
        self.device.read(self.on_device["boxes"], root)
        return np.stack([root[:3].min(axis=1), root[3:].max(axis=1)])

    @cached_property
    def sphere(self) -> Float32Array:
        """(4,) float32, centre and radius of a sphere round all triangles."""
        return sphere_of(self.bounds_m)

    @cached_property
    def sah_cost(self) -> float:
        """Expected nodes plus blocks that a random line through the tree's box meets: smaller is better.

        Surface area heuristic: a convex box inside another one is met by a line that meets the other with the
        probability of the areas' ratio. One where all triangles lie on one line.
        """
        low, high = self.bounds_m.astype(np.float64)
        used = (self.boxes[:, :3] <= self.boxes[:, 3:]).all(axis=1)
        boxes = self.boxes.astype(np.float64)
        met = float(_half_area(boxes[:, :3], boxes[:, 3:])[used].sum())
        return 1.0 + met / max(float(_half_area(low, high, axis=0)), 1e-30)

    def _copy(self, name: str, into: NDArray[_Scalar]) -> NDArray[_Scalar]:
        self.device.read(self.on_device[name], into)
        return into


def build_tree(scene: Scene, device: Device) -> Tree:
    """Build the tree of a scene of at least one triangle on `device`.

    Raises
    ------
    DeviceError
        The device's memory does not suffice: some 130 bytes a triangle while building.
    """
    triangles = {"vertices": scene.vertices_m.astype(np.float32), "corners": scene.triangles}
    binary = _cluster_triangles(device, triangles, scene.n_triangles)
    outline, arrays = widen(device, scene, triangles, binary)
    return Tree(
        device=device,
        on_device=arrays,
        n_triangles=scene.n_triangles,
        n_nodes=outline.n_nodes,
        n_blocks=outline.n_blocks,
        n_levels=len(outline.levels),
    )


def walk_defines(device: Device, n_levels: int, n_bytes: int) -> dict[str, int]:
    """Build options of kernels that walk trees of so many levels and bytes at most."""
    # One node leaves at most 7 siblings on the stack, and the root needs an entry. In steps of 64, so that scenes of
    # different depths share their built programs.
    stack = -(-(7 * n_levels + 1) // 64) * 64
    return {"STACK": stack, "PREFETCH": int(device.kind == "cpu" and n_bytes > _CACHED_BYTES)}


def sphere_of(bounds_m: Float32Array) -> Float32Array:
    """(4,) float32, centre and radius of a sphere round bounds (2, 3)."""
    low, high = bounds_m
    radius = np.float32(1.001 * np.linalg.norm((high.astype(np.float64) - low) / 2))
    return np.array([*(low + (high - low) / 2), radius], dtype=np.float32)


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


def _cluster_triangles(device: Device, triangles: Mapping[str, NDArray[Any]], n_triangles: int) -> Binary:
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


@dataclass(frozen=True)
class Outline:
    """Which binary nodes become wide nodes and blocks.

    levels : (first, count) of the nodes of each level. nodes (N,), blocks (B,), first_child (N, 2) int32: see
    kernels/tree_widen.cl.
    """

    levels: tuple[tuple[int, int], ...]
    n_blocks: int
    nodes: Buffer
    blocks: Buffer
    first_child: Buffer

    @property
    def n_nodes(self) -> int:
        """Number of wide nodes."""
        return sum(count for _, count in self.levels)


def widen(
    device: Device, scene: Scene, triangles: Mapping[str, NDArray[Any]], binary: Binary
) -> tuple[Outline, dict[str, Buffer]]:
    """Make the arrays that kernels walk.

    Returns
    -------
    outline, arrays
        boxes (N, 6, 8), children (N, 8), geometry (B, 12, 8), triangle (B, 8), slot (T,), edges (T, 3) m2.
    """
    float64 = has_float64(device)
    program = device.program("tree_widen.cl", {"LANES": 1, "FLOAT64": int(float64)})
    outline = _outline(device, program, binary)
    sizes = {
        "boxes": 192 * outline.n_nodes,
        "children": 32 * outline.n_nodes,
        "geometry": 384 * outline.n_blocks,
        "triangle": 32 * outline.n_blocks,
        "slot": 4 * binary.n_triangles,
        "edges": 12 * binary.n_triangles,
    }
    device.reserve("tree", sizes)
    arrays = {name: device.allocate("tree", size, is_filled=True) for name, size in sizes.items()}
    normals = arrays["edges"]  # something to hand over where normals are not read
    if not float64:
        measured = {"normals": round_surfaces(scene).normal, "edges": squared_edges(scene.vertices_m[scene.triangles])}
        uploaded = device.upload("normals and edges of triangles", measured)
        arrays["edges"], normals = uploaded["edges"], uploaded["normals"]
    block_box = device.allocate("boxes of blocks", 32 * outline.n_blocks)
    with device.inputs("triangles", triangles) as mesh:
        program.run(
            "fill_blocks",
            (chunk_count(device, outline.n_blocks),),
            *(mesh["vertices"], mesh["corners"], binary.order, normals, *_binary_arguments(binary)),
            *(outline.blocks, np.int32(outline.n_blocks)),
            *(arrays[name] for name in ("geometry", "triangle", "slot", "edges")),
            block_box,
        )
        _write_nodes(device, program, binary, outline, block_box, arrays)
        device.finish("building the tree")  # a kernel that failed leaves no tree, not one that fails later
    return outline, arrays


def _half_area(low: FloatArray, high: FloatArray, *, axis: int = 1) -> FloatArray:
    x, y, z = np.moveaxis(high - low, axis, 0)
    return np.asarray(x * y + y * z + z * x)


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
    while n > _FEW_CLUSTERS.get(device.kind, _DEFAULT_FEW_CLUSTERS):
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


def _write_nodes(
    device: Device, program: Program, binary: Binary, outline: Outline, block_box: Buffer, arrays: dict[str, Buffer]
) -> None:
    """From the lowest level up, since a node's box is the union of its children's; small levels several at once."""
    node_box = device.allocate("boxes of nodes", 32 * outline.n_nodes, is_filled=True)
    few = _FEW_NODES.get(device.kind, _DEFAULT_FEW_NODES)
    levels = list(outline.levels)
    while levels:
        first, count = levels.pop()
        n_chunks = chunk_count(device, count)
        while levels and count + levels[-1][1] <= few:
            first, count, n_chunks = levels[-1][0], count + levels.pop()[1], 1
        program.run(
            "write_nodes",
            (n_chunks,),
            *(*_binary_arguments(binary), outline.nodes, np.int32(first), np.int32(count)),
            *(outline.first_child, block_box, node_box, arrays["boxes"], arrays["children"]),
        )


def _binary_arguments(binary: Binary) -> tuple[Buffer, Buffer, np.int32]:
    return (binary.halves, binary.choices, np.int32(binary.n_triangles))


def _outline(device: Device, program: Program, binary: Binary) -> Outline:
    """Walk down from the root, level by level; small levels one after the other in one launch."""
    tree, few = _binary_arguments(binary), _FEW_NODES.get(device.kind, _DEFAULT_FEW_NODES)
    nodes, blocks, first_child = binary.spare
    counts = device.allocate("counts of chunks", 8 * (chunk_count(device, binary.n_triangles) + 1))
    found = device.allocate("levels", 4 * _TABLE)
    totals, table = np.empty(2, dtype=np.int32), np.empty(_TABLE, dtype=np.int32)
    levels: list[tuple[int, int]] = []
    first, count, n_blocks = 0, 1, 0
    while count:
        level = (np.int32(first), np.int32(count))
        program.run(
            "list_levels", (1,), *tree, nodes, *level, np.int32(n_blocks), np.int32(few), first_child, blocks, found
        )
        device.read(found, table)
        n_listed, n_blocks = int(table[0]), int(table[1])
        for following in table[2 : 2 + n_listed].tolist():
            levels.append((first, count))
            first, count = first + count, following
        if count <= few:
            continue
        levels.append((first, count))
        level, after = (np.int32(first), np.int32(count)), (np.int32(first + count), np.int32(n_blocks))
        n_chunks = chunk_count(device, count)
        program.run("count_children", (n_chunks,), *tree, nodes, *level, counts)
        program.run("sum_counts", (1,), counts, np.int32(n_chunks))
        program.run("list_children", (n_chunks,), *tree, nodes, *level, counts, *after, first_child, blocks)
        device.read(counts, totals)
        first, count = first + count, int(totals[0])
        n_blocks += int(totals[1])
    # There are far fewer nodes and blocks than triangles.
    return Outline(
        tuple(levels),
        n_blocks,
        device.shrink(nodes, 4 * first),
        device.shrink(blocks, 4 * n_blocks),
        device.shrink(first_child, 8 * first),
    )

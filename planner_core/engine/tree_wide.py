"""Wide nodes and blocks, cut out of a binary tree on the device: kernels/tree_widen.cl.

Float32, metres, local frame; layout in kernels/tree.h and kernels/block.h.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner_core.device import Buffer, Device, Program
from planner_core.device.precision import has_float64
from planner_core.device.sort import chunk_count
from planner_core.engine.surfaces import round_surfaces
from planner_core.engine.tree_clusters import Binary
from planner_core.model import Scene
from planner_core.scene.patches import squared_edges

#: Levels of no more nodes than this are walked by one work-item, in one launch.
_FEW = {"cpu": 1024}
_DEFAULT_FEW = 32
#: Numbers of the table that `list_levels` writes.
_TABLE = 64


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


def _write_nodes(
    device: Device, program: Program, binary: Binary, outline: Outline, block_box: Buffer, arrays: dict[str, Buffer]
) -> None:
    """From the lowest level up, since a node's box is the union of its children's; small levels several at once."""
    node_box = device.allocate("boxes of nodes", 32 * outline.n_nodes, is_filled=True)
    few = _FEW.get(device.kind, _DEFAULT_FEW)
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
    tree, few = _binary_arguments(binary), _FEW.get(device.kind, _DEFAULT_FEW)
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

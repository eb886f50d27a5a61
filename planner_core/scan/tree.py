"""The tree over the scene's triangles: blocks of eight triangles, nodes of eight children; layout in kernels/tree.h.

Binary splits come from the device, level by level (kernels/tree_split.cl); this module merges them into wide nodes.
Deterministic: every split depends on the triangles alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.device import Device
from planner_core.model import BoolArray, Float32Array, Int32Array, Int64Array
from planner_core.scan.surfaces import Surfaces

WIDTH = 8
"""Children of a node and triangles of a block, fixed in the kernels."""
_BINS = 16
#: Inside out: no test passes it.
_NO_BOX = np.array([1e30, 1e30, 1e30, -1e30, -1e30, -1e30], dtype=np.float32)


@dataclass(frozen=True)
class Tree:
    """Arrays for the kernels, metres, local frame.

    boxes : (N, 6, 8) float32. children : (N, 8) int32. geometry : (B, 12, 8) float32. triangle : (B, 8) int32, -1 in
    an empty lane. slot : (T,) int32, block * 8 + lane of every triangle.
    """

    boxes: Float32Array
    children: Int32Array
    geometry: Float32Array
    triangle: Int32Array
    slot: Int32Array
    n_levels: int
    """Levels of wide nodes."""
    sah_cost: float
    """Expected nodes plus blocks that a random line meets, an estimate of the tree's quality (smaller is better)."""

    @property
    def n_bytes(self) -> int:
        """Memory of all arrays."""
        return sum(x.nbytes for x in (self.boxes, self.children, self.geometry, self.triangle, self.slot))


@dataclass(frozen=True)
class _Binary:
    """Binary nodes: box (M, 6), triangles order[start : start + count], left child (right = left + 1; -1: leaf)."""

    box: Float32Array
    start: Int32Array
    count: Int32Array
    left: Int32Array
    order: Int32Array


def build_tree(surfaces: Surfaces, device: Device) -> Tree:
    """Build the tree of `surfaces`, with the splits computed on `device`."""
    return _widen(_split(surfaces, device), surfaces)


def _split(surfaces: Surfaces, device: Device) -> _Binary:
    corners = surfaces.corners_m
    n_triangles = corners.shape[0]
    program = device.program("tree_split.cl", {"BINS": _BINS})
    boxes = np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1)
    order = np.arange(n_triangles, dtype=np.int32)
    fixed = device.upload("tree", {"boxes": boxes, "order": order})
    start, count = np.zeros(1, dtype=np.int32), np.full(1, n_triangles, dtype=np.int32)
    levels: list[tuple[Float32Array, Int32Array, Int32Array, Int32Array]] = []
    n_nodes = 1
    while start.size:
        level = device.upload("tree", {"start": start, "count": count})
        box = np.empty((start.size, 6), dtype=np.float32)
        left_count = np.empty(start.size, dtype=np.int32)
        with device.outputs("tree", {"box": box, "left_count": left_count}) as out:
            program.run(
                "split_nodes",
                (start.size,),
                fixed["boxes"],
                fixed["order"],
                level["start"],
                level["count"],
                out["box"],
                out["left_count"],
            )
        inner = left_count > 0
        left = np.full(start.size, -1, dtype=np.int32)
        left[inner] = n_nodes + 2 * np.arange(int(inner.sum()), dtype=np.int32)
        levels.append((box, start, count, left))
        cut = left_count[inner]
        start = np.stack([start[inner], start[inner] + cut], axis=1).reshape(-1)
        count = np.stack([cut, count[inner] - cut], axis=1).reshape(-1)
        n_nodes += start.size
    device.read(fixed["order"], order)
    box, start, count, left = (np.concatenate([level[k] for level in levels]) for k in range(4))
    return _Binary(box=box, start=start, count=count, left=left, order=order)


def _widen(binary: _Binary, surfaces: Surfaces) -> Tree:
    leaf = binary.left < 0
    block_of = np.cumsum(leaf, dtype=np.int64) - 1
    area = _half_area(binary.box)
    boxes: list[Float32Array] = []
    children: list[Int32Array] = []
    cost = 0.0
    n_nodes, level = 1, np.zeros(1, dtype=np.int64)
    while level.size:
        slots = _open_largest(level, binary.left, area)
        used = slots >= 0
        inner = used & ~leaf[slots]
        child = np.full(slots.shape, 0, dtype=np.int64)
        child[inner] = n_nodes + np.arange(int(inner.sum()))
        child[used & ~inner] = ~block_of[slots[used & ~inner]]
        box = np.where(used[..., None], binary.box[slots], _NO_BOX)
        boxes.append(np.ascontiguousarray(box.transpose(0, 2, 1), dtype=np.float32))
        children.append(child.astype(np.int32))
        cost += float(area[slots[used]].sum(dtype=np.float64)) + float(area[level].sum()) * (len(boxes) == 1)
        level = slots[inner]
        n_nodes += level.size
    geometry, triangle, slot = _fill_blocks(binary.start[leaf], binary.count[leaf], binary.order, surfaces)
    return Tree(
        boxes=np.concatenate(boxes),
        children=np.concatenate(children),
        geometry=geometry,
        triangle=triangle,
        slot=slot,
        n_levels=len(boxes),
        sah_cost=cost / float(max(area[0], np.float32(1e-30))),
    )


def _open_largest(level: Int64Array, left: Int32Array, area: Float32Array) -> Int64Array:
    """Children (n, 8) of wide nodes: the largest child is replaced by its two halves until 8 are there."""
    slots = np.full((level.size, WIDTH), -1, dtype=np.int64)
    slots[:, 0] = level
    rows = np.arange(level.size)
    for used in range(1, WIDTH):
        held = slots[:, :used]
        can_open: BoolArray = (held >= 0) & (left[held] >= 0)
        pick = np.where(can_open, area[held], np.float32(-1)).argmax(axis=1)
        row = rows[can_open.any(axis=1)]
        first = left[slots[row, pick[row]]]
        slots[row, pick[row]] = first
        slots[row, used] = first + 1
    return slots


def _fill_blocks(
    start: Int32Array, count: Int32Array, order: Int32Array, surfaces: Surfaces
) -> tuple[Float32Array, Int32Array, Int32Array]:
    lane = np.arange(WIDTH)
    full = lane < count[:, None]
    at = start[:, None] + np.minimum(lane, count[:, None] - 1)
    of = order[at]
    # (B, 8, 12): three corners and the normal of each triangle; an empty lane repeats the last one and is never asked.
    packed = np.concatenate([surfaces.corners_m[of].reshape(*of.shape, 9), surfaces.normal[of]], axis=2)
    slot = np.empty(order.size, dtype=np.int32)
    slot[of[full]] = np.flatnonzero(full).astype(np.int32)
    triangle = np.where(full, of, -1).astype(np.int32)
    return np.ascontiguousarray(packed.transpose(0, 2, 1), dtype=np.float32), triangle, slot


def _half_area(box: Float32Array) -> Float32Array:
    x, y, z = (box[:, 3 + k] - box[:, k] for k in range(3))
    return np.asarray(x * y + y * z + z * x, dtype=np.float32)

"""A yardstick for trees: top-down binned SAH, 32 bins, eight-wide, on the host in float64; as Embree builds by default.

Independent of the library's own builder and slow: half a minute for 130 000 triangles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

WIDTH = 8
BINS = 32
#: Cost of a binary node in units of a block's: an eight-wide node stands for up to seven of them.
NODE_COST = 0.25


@dataclass(frozen=True)
class ReferenceTree:
    """Arrays in the layout of kernels/tree.h and kernels/block.h, without the normals."""

    boxes: np.ndarray
    children: np.ndarray
    triangle: np.ndarray
    n_levels: int


def half_area(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    d = high - low
    return d[..., 0] * d[..., 1] + d[..., 1] * d[..., 2] + d[..., 2] * d[..., 0]


def _split(low: np.ndarray, high: np.ndarray) -> np.ndarray | None:
    """The cheapest split, (n,) bool, True goes left; None where a leaf is cheaper."""
    n = len(low)
    centre = low + high
    least, extent = centre.min(axis=0), np.ptp(centre, axis=0)
    blocks = -(-np.arange(1, n) // WIDTH)
    best, left = np.inf, None
    for axis in np.flatnonzero(extent > 0):
        bins = np.minimum(((centre[:, axis] - least[axis]) / extent[axis] * BINS).astype(int), BINS - 1)
        order = np.argsort(bins, kind="stable")
        lows, highs = low[order], high[order]
        before = half_area(np.minimum.accumulate(lows), np.maximum.accumulate(highs))[:-1]
        after = half_area(np.minimum.accumulate(lows[::-1]), np.maximum.accumulate(highs[::-1]))[:-1][::-1]
        cost = np.where(np.diff(bins[order]) > 0, before * blocks + after * blocks[::-1], np.inf)
        at = int(cost.argmin())
        if cost[at] < best:
            best, left = cost[at], np.isin(np.arange(n), order[: at + 1])
    area = half_area(low.min(axis=0), high.max(axis=0))
    if n <= WIDTH and best + NODE_COST * area >= area:
        return None
    return np.arange(n) < n // 2 if left is None else left


def build(corners: np.ndarray) -> ReferenceTree:
    """Build the tree of triangles (T, 3, 3): binary from the top, then largest children opened to have eight."""
    lows, highs = corners.min(axis=1).astype(np.float64), corners.max(axis=1).astype(np.float64)
    held: list[np.ndarray] = [np.arange(len(corners))]
    halves: list[tuple[int, int] | None] = []
    while len(halves) < len(held):
        own = held[len(halves)]
        left = _split(lows[own], highs[own]) if len(own) > 1 else None
        halves.append(None if left is None else (len(held), len(held) + 1))
        if left is not None:
            held += [own[left], own[~left]]
    low = np.array([lows[own].min(axis=0) for own in held])
    high = np.array([highs[own].max(axis=0) for own in held])
    area = half_area(low, high)
    roots, depth, rows, children, blocks = [0], [1], [], [], []
    for root in roots:
        found = [root]
        while len(found) < WIDTH:
            can_open = [k for k in found if halves[k] is not None]
            if not can_open:
                break
            largest = max(can_open, key=lambda k: area[k])
            found.remove(largest)
            found += halves[largest]
        box, child = np.tile([[1e30]] * 3 + [[-1e30]] * 3, (1, WIDTH)), np.zeros(WIDTH, dtype=np.int32)
        for lane, k in enumerate(found):
            box[:, lane] = [*low[k], *high[k]]
            if halves[k] is None:
                child[lane] = ~len(blocks)
                blocks.append(np.pad(held[k], (0, WIDTH - len(held[k])), constant_values=-1))
            else:
                child[lane] = len(roots)
                roots.append(k)
                depth.append(depth[len(rows)] + 1)
        rows.append(box)
        children.append(child)
    return ReferenceTree(
        boxes=np.array(rows, dtype=np.float32),
        children=np.array(children, dtype=np.int32),
        triangle=np.array(blocks, dtype=np.int32),
        n_levels=depth[-1],
    )


def sah_cost(boxes: np.ndarray) -> float:
    """Nodes plus blocks that a random line through the root's box meets: the root, and every child by its area."""
    used = boxes[:, 0] <= boxes[:, 3]
    boxes = boxes.astype(np.float64)
    areas = half_area(boxes[:, :3].transpose(0, 2, 1), boxes[:, 3:].transpose(0, 2, 1))
    root = half_area(boxes[0, :3][:, used[0]].min(axis=1), boxes[0, 3:][:, used[0]].max(axis=1))
    return float(1.0 + areas[used].sum() / root)

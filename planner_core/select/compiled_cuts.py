"""Cuts of a network, what lies on their sides, and sums for cuts of coverage, compiled.

Imported where it is used, see `planner_core.compiled`. Networks are CSR rows, `starts` (N + 1,) and `neighbour` (M,),
symmetric.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from planner_core.compiled import compiled
from planner_core.model import BoolArray, FloatArray, Int32Array, Int64Array, UInt8Array


@compiled
def least_cut(
    starts: Int64Array,
    neighbour: Int32Array,
    opposite: Int64Array,
    limit: Int64Array,
    source: BoolArray,
    far: BoolArray,
    enough: int,
    side: UInt8Array,
) -> int:
    """Part candidates `source` from those in `far` by others of the least sum of limits; Dinic's algorithm.

    opposite : (M,) for each entry of the rows the one the other way. limit : (N,) what may flow through each; sources
    and far ones may be in the cut themselves; less than 0: not there. enough : a sum for which nobody asks further.
    side : (N,) written: 2 where the sources are left, 1 in the cut, 0 beyond; of all least cuts the nearest to the
    sources, the same whichever flow is found. Returns the cut's sum; where that is `enough` or more, some sum that is,
    and then `side` has no meaning.

    Each candidate is two nodes: a way in, i, and a way out, N + i, with its limit between; links have none.
    """
    n = limit.size
    through, along = np.zeros(n, dtype=np.int64), np.zeros(neighbour.size, dtype=np.int64)
    level, queue = np.empty(2 * n, dtype=np.int32), np.empty(2 * n, dtype=np.int32)
    next_link = np.empty(2 * n, dtype=np.int64)
    total = 0
    while _set_levels(starts, neighbour, opposite, limit, source, far, through, along, level, queue):
        for i in range(n):
            next_link[i] = next_link[n + i] = starts[i] - 1  # before all links: between the two nodes
        for begin in range(n):
            if source[begin] and limit[begin] >= 0 and total < enough:
                queue[0] = begin
                total += _flow_down(
                    starts, neighbour, opposite, limit, far, through, along, level, next_link, queue, enough - total
                )
        if total >= enough:
            return total
    for i in range(n):
        side[i] = 2 if level[n + i] >= 0 else (1 if level[i] >= 0 else 0)
    return total


@compiled
def _set_levels(
    starts: Int64Array,
    neighbour: Int32Array,
    opposite: Int64Array,
    limit: Int64Array,
    source: BoolArray,
    far: BoolArray,
    through: Int64Array,
    along: Int64Array,
    level: Int32Array,
    queue: Int32Array,
) -> bool:
    """Steps from the sources to each node where more may flow, -1: none; whether a far one is reached, and no further.

    through, along : what flows through candidates and, one way, along links.
    """
    n = limit.size
    level[:] = -1
    first, end = 0, 0
    for i in range(n):
        if source[i] and limit[i] >= 0:
            level[i] = 0
            queue[end] = i
            end += 1
    last = 2 * n
    while first < end and level[queue[first]] < last:
        node = queue[first]
        first += 1
        i = node if node < n else node - n
        across = n + i if node < n else i
        if level[across] < 0 and (through[i] < limit[i] if node < n else through[i] > 0):
            level[across] = level[node] + 1
            queue[end] = across
            end += 1
            if node < n and far[i]:
                last = level[across]
        for entry in range(starts[i], starts[i + 1]):
            j = neighbour[entry]
            other = n + j if node < n else j
            if level[other] < 0 and (along[opposite[entry]] > 0 if node < n else limit[j] >= 0):
                level[other] = level[node] + 1
                queue[end] = other
                end += 1
                if node < n and far[j]:
                    last = level[other]
    return last < 2 * n


@compiled
def _flow_down(
    starts: Int64Array,
    neighbour: Int32Array,
    opposite: Int64Array,
    limit: Int64Array,
    far: BoolArray,
    through: Int64Array,
    along: Int64Array,
    level: Int32Array,
    next_link: Int64Array,
    path: Int32Array,
    enough: int,
) -> int:
    """Let flow from path[0] all that can level by level, `enough` or a little more at most; returns how much.

    next_link : (2N,) where each node goes on: what it left behind leads nowhere.
    """
    n = limit.size
    total, depth = 0, 0
    while depth >= 0:
        node = path[depth]
        i = node if node < n else node - n
        if node >= n and far[i]:
            most = np.int64(2**62)
            for at in range(depth):
                here, entry = path[at], next_link[path[at]]
                if entry < starts[here if here < n else here - n]:
                    most = min(most, limit[here] - through[here] if here < n else through[here - n])
                elif here < n:
                    most = min(most, along[opposite[entry]])
            total += int(most)
            for at in range(depth - 1, -1, -1):
                here, entry, left = path[at], next_link[path[at]], np.int64(1)
                if entry < starts[here if here < n else here - n]:
                    if here < n:
                        through[here] += most
                        left = limit[here] - through[here]
                    else:
                        through[here - n] -= most
                        left = through[here - n]
                elif here < n:
                    along[opposite[entry]] -= most
                    left = along[opposite[entry]]
                else:
                    along[entry] += most
                if left == 0:
                    depth = at
            if total >= enough:
                return total
            continue
        step = -1
        while next_link[node] < starts[i + 1]:
            entry = next_link[node]
            if entry < starts[i]:
                other = n + i if node < n else i
                is_open = through[i] < limit[i] if node < n else through[i] > 0
            elif node < n:
                other, is_open = n + neighbour[entry], along[opposite[entry]] > 0
            else:
                other = neighbour[entry]
                is_open = limit[other] >= 0
            if is_open and level[other] == level[node] + 1:
                step = other
                break
            next_link[node] += 1
        if step >= 0:
            depth += 1
            path[depth] = step
        else:
            depth -= 1
            if depth >= 0:
                next_link[path[depth]] += 1
    return total


@compiled
def part_about(
    starts: Int64Array, neighbour: Int32Array, inside: BoolArray, piece: BoolArray, x: FloatArray, side: UInt8Array
) -> tuple[int, int]:
    """Part a piece of the candidates `inside` from the best of those that it does not touch, by few.

    side : (N,) written: 2 the piece's side, 1 between, as few as will do, 0 the rest, and who is not inside. Returns
    the candidates of most x of the piece, and of what it does not touch: -1 where it touches all.
    """
    n = x.size
    near = np.zeros(n, dtype=np.bool_)
    for i in range(n):
        if piece[i]:
            near[i] = True
            for entry in range(starts[i], starts[i + 1]):
                near[neighbour[entry]] = True
    mine = other = -1
    for i in range(n):
        if piece[i] and (mine < 0 or x[i] > x[mine]):
            mine = i
        elif inside[i] and not near[i] and (other < 0 or x[i] > x[other]):
            other = i
    side[:] = 0
    if other < 0:
        return mine, other
    queue = np.empty(n, dtype=np.int32)
    # What is connected with the other one without touching the piece, and whom that touches: `kept` from the piece.
    kept = np.zeros(n, dtype=np.bool_)
    there = np.zeros(n, dtype=np.bool_)
    first, end = 0, 1
    queue[0], there[other] = other, True
    while first < end:
        i = queue[first]
        first += 1
        kept[i] = True
        for entry in range(starts[i], starts[i + 1]):
            j = neighbour[entry]
            kept[j] = True
            if inside[j] and not near[j] and not there[j]:
                there[j] = True
                queue[end] = j
                end += 1
    # All that is connected with the piece's best without those: its side, and whom that touches is between.
    first, end = 0, 1
    queue[0], side[mine] = mine, 2
    while first < end:
        i = queue[first]
        first += 1
        for entry in range(starts[i], starts[i + 1]):
            j = neighbour[entry]
            if not inside[j] or side[j] == 2:
                continue
            if kept[j]:
                side[j] = 1
            else:
                side[j] = 2
                queue[end] = j
                end += 1
    return mine, other


@compiled
def add_up(starts: Int64Array, entry: Int32Array, weight: Any, total: Any) -> None:
    """(M,) total, added to: the sum of weights, (N,), of the rows that hold each entry. starts, entry : CSR rows."""
    for i in range(weight.size):
        if weight[i] != 0:
            for at in range(starts[i], starts[i + 1]):
                total[entry[at]] += weight[i]

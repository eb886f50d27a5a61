"""Cuts that join: what every set of stations satisfies whose stations of one part are linked with each other.

Input a `Network` and points x in [0, 1]^N, output `Cut`s that they violate.

Let a set Z of candidates be taken away from a part of the graph, so that what is left of the part falls into two sides
D and E without a link between them. A joined set without any candidate of Z has its stations of this part all in D or
all in E. A side is `enough` where it and all other parts together reach every target. So, with x(Z) the sum of x over
Z, for every joined set that reaches the targets:

    neither side is enough          x(Z) >= 1
    i in a side that is not         x(Z) >= x_i
    i in D and j in E               x(Z) >= x_i + x_j - 1

Where links have to form loops all this holds too: such sets are joined. There, a link a - b is no bridge if any other
candidate i of its part is chosen, unless it is one of the candidates' graph. So a and b are joined without it, and with
Z between them in the graph without it:

    Z parts a from b but for their link                         x(Z) >= x_a + x_b + x_i - 2
    Z are the neighbours of a, b is none, no bridge at a        x(Z) >= 2 (x_a + x_b - 1)
    a and all its neighbours are not enough, no bridge at a     x(Z) >= 2 x_a

Z comes from neighbours of a piece of the graph that x holds together, and from least cuts: of the candidates between
two that x favours, with x_i for their capacity. Of Z only what touches i's piece as well as j's is kept.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int32Array, Int64Array
from planner_core.select.network import Network
from planner_core.select.relaxation import CUT_UNIT, Cut

#: A cut is worth while from such a violation on; solutions of the linear program are good to 1e-7.
_VIOLATION = 1e-4
#: Candidates of more than this in x are tested for whether they are connected: one threshold after the other.
_THRESHOLDS = (1e-6, 0.1, 0.4)
#: So many pieces of a part are cut off from the rest, and so many flows are computed, between candidates worth it.
_PIECES, _FLOWS, _WORTH = 12, 12, 0.05
#: Flows are whole numbers of this.
FLOW_UNIT = 2**20
NO_LIMIT = 2**30


class NetworkCuts:
    """Separation for one network.

    reaches : whether the allowed candidates, (N,) bool, together reach every target. n_looks, n_flows : how often it
    was tested, and flows computed.
    """

    def __init__(self, network: Network, reaches: Callable[[BoolArray], bool]) -> None:
        n = network.n_candidates
        self.n_looks = self.n_flows = 0
        self._network = network
        self._linked = [_mask_of(network.neighbours(i), n) for i in range(n)]
        self._part = network.part.astype(np.int64)
        self._parts = np.unique(self._part).tolist()
        self._reaches = reaches
        self._known: dict[bytes, bool] = {}

    def violated(self, x: FloatArray) -> list[Cut]:
        """Cuts that x violates; at least one where x is whole and is not connected."""
        found: dict[bytes, Cut] = {}
        for part in self._parts:
            inside = self._part == part
            if int((inside & (x > _WORTH)).sum()) >= 2:
                cuts = self._around_pieces(x, inside) or self._by_flow(x, inside)
                if self._network.loops:
                    cuts = cuts + self._of_ends(x, inside) + self._of_bridges(x, inside)
                found.update({cut.coefficient.tobytes(): cut for cut in cuts})
        return list(found.values())

    def reachable(self, lower: Int64Array, upper: Int64Array) -> BoolArray | None:
        """(N,) bool: allowed ones that can be joined with those that are in; None where these cannot be joined."""
        at = np.flatnonzero(upper > 0)
        _, label = self._pieces(at)
        part, inside = self._part[at], lower[at] > 0
        home = np.full(int(self._part.max(initial=-1)) + 1, -1, dtype=np.int64)
        home[part[inside]] = label[inside]
        if (home[part[inside]] != label[inside]).any():
            return None
        keep: BoolArray = np.zeros(upper.size, dtype=bool)
        keep[at] = (home[part] < 0) | (home[part] == label)
        return keep

    # ------------------------------------------------------------------------------------------ where to cut
    def _around_pieces(self, x: FloatArray, inside: BoolArray) -> list[Cut]:
        """Cuts around the pieces that x holds together, at the first threshold that gives any."""
        for threshold in _THRESHOLDS:
            at = np.flatnonzero(inside & (x > threshold))
            n_pieces, label = self._pieces(at)
            if n_pieces < 2:
                continue
            heaviest = np.argsort(-np.bincount(label, weights=x[at]), kind="stable")[:_PIECES]
            cuts = [cut for piece in heaviest for cut in self._cuts_around(x, inside, at[label == piece])]
            if cuts:
                return cuts
        return []

    def _by_flow(self, x: FloatArray, inside: BoolArray) -> list[Cut]:
        """Cuts between the candidate that x favours most and others that it favours."""
        there = inside & (x * FLOW_UNIT >= 1)
        at = np.flatnonzero(there)
        order = at[np.argsort(-x[at], kind="stable")]
        cuts, n_flows = [], 0
        source, far = (np.zeros(x.size, dtype=bool) for _ in range(2))
        source[order[0]] = True
        done = self._neighbours(order[:1])  # there is nothing between neighbours
        for sink in order[1:].tolist():
            if n_flows == _FLOWS or x[sink] <= _WORTH:
                break
            if done[sink]:
                continue
            n_flows += 1
            far[:] = False
            far[sink] = True
            cut = least_cut(self._network, x, there, source, far, whole=True)
            if cut is None:
                continue
            near = np.flatnonzero(cut[0])
            found = self._cuts_around(x, inside, near)
            if found:  # the others on the far side would mostly give the same
                cuts += found
                done[at] = True
                done[near] = False
        self.n_flows += n_flows
        return cuts

    # ------------------------------------------------------------------------------------------ which cuts
    def _cuts_around(self, x: FloatArray, inside: BoolArray, piece: Int64Array) -> list[Cut]:
        """Cuts between `piece` and what it does not touch, for the best candidates of both, if x violates any."""
        from planner_core.select import compiled_cuts

        side, in_piece = np.zeros(x.size, dtype=np.uint8), np.zeros(x.size, dtype=bool)
        in_piece[piece] = True
        network = self._network
        mine, other = compiled_cuts.part_about(network.starts, network.neighbour, inside, in_piece, x, side)
        if other < 0:
            return []
        here, between = side == 2, side == 1
        rest = inside & (side == 0)  # what is connected with `other`, and what hangs on neither
        value = float(x[between].sum())
        if value > 1.0 - _VIOLATION:
            return []
        weak = [i for i, side in ((mine, here), (other, rest)) if not self._enough(side, inside)]
        if len(weak) == 2:
            return [self._cut(between, [], CUT_UNIT)]
        if weak:
            return [self._cut(between, weak, 0)] if x[weak[0]] > value + _VIOLATION else []
        if x[mine] + x[other] - 1.0 > value + _VIOLATION:
            return [self._cut(between, [mine, other], -CUT_UNIT)]
        return []

    def _enough(self, side: BoolArray, inside: BoolArray) -> bool:
        key = np.packbits(side).tobytes()
        if key not in self._known:
            self.n_looks += 1
            self._known[key] = self._reaches(side | ~inside)
        return self._known[key]

    # ------------------------------------------------------------------------------------------ loops
    def _of_ends(self, x: FloatArray, inside: BoolArray) -> list[Cut]:
        """Cuts around single candidates that hang by less than two others."""
        around = self._network.graph @ x
        ends = np.flatnonzero(inside & (x > _WORTH) & (around < 2.0 * x - _VIOLATION))
        ends = ends[np.argsort(around[ends] - 2.0 * x[ends], kind="stable")]
        at_bridge = {i for bridge in self._network.bridges for i in bridge}
        cuts = []
        for end in [i for i in ends.tolist() if i not in at_bridge][:_PIECES]:
            between = self._neighbours(np.array([end]))
            near = between.copy()
            near[end] = True
            if not self._enough(near, inside):
                cuts.append(self._half(between, [end], 0))
                continue
            away = int(np.argmax(np.where(inside & ~near, x, -1.0)))
            if inside[away] and not near[away] and 2.0 * (x[end] + x[away] - 1.0) > around[end] + _VIOLATION:
                cuts.append(self._half(between, [end, away], -CUT_UNIT))
        return cuts

    def _of_bridges(self, x: FloatArray, inside: BoolArray) -> list[Cut]:
        """Cuts for bridges between candidates of which x is nearly 1."""
        at = np.flatnonzero(inside & (x > 0.9)).tolist()
        cuts = []
        for a, b in self._network.avoidable_bridges(at):
            third = max((i for i in at if i not in (a, b)), key=lambda i: float(x[i]))
            between = self._between(a, b, x, inside)
            if x[a] + x[b] + x[third] - 2.0 > float(x[between].sum()) + _VIOLATION and not between[third]:
                cuts.append(self._cut(between, [a, b, third], -2 * CUT_UNIT))
        return cuts

    def _between(self, a: int, b: int, x: FloatArray, inside: BoolArray) -> BoolArray:
        """Candidates that part a from b but for their link: neighbours of what x joins to a, as few as will do."""
        strong = inside & (x > 0.9)
        strong[b] = False
        here = self._piece_of(a, strong)
        between = inside & ~here & self._neighbours(np.flatnonzero(here))
        between[b] = False
        there = self._piece_of(b, inside & ~here & ~between)
        near_b: BoolArray = between & self._neighbours(np.flatnonzero(there))
        return near_b

    @staticmethod
    def _half(between: BoolArray, paid: list[int], right: int) -> Cut:
        """Like `_cut`, with x(Z) / 2."""
        coefficient = np.where(between, CUT_UNIT // 2, 0).astype(np.int64)
        coefficient[paid] = -CUT_UNIT
        return Cut(coefficient, right)

    @staticmethod
    def _cut(between: BoolArray, paid: list[int], right: int) -> Cut:
        coefficient = np.where(between, CUT_UNIT, 0).astype(np.int64)
        coefficient[paid] = -CUT_UNIT
        return Cut(coefficient, right)

    # ------------------------------------------------------------------------------------------ the graph
    # Sets of candidates are bits of one whole number here: on graphs of hundreds that beats matrices tenfold.
    def _pieces(self, at: Int64Array) -> tuple[int, Int64Array]:
        """Components of the graph of candidates `at`: how many, and that of each, numbered by their first ones."""
        left, n = _mask_of(at, self._part.size), 0
        label = np.empty(self._part.size, dtype=np.int64)
        while left:
            piece = self._flood(left & -left, left)
            label[_members(piece, self._part.size)] = n
            left &= ~piece
            n += 1
        return n, label[at]

    def _piece_of(self, one: int, allowed: BoolArray) -> BoolArray:
        return _members(self._flood(1 << one, _mask(allowed)), allowed.size)

    def _flood(self, start: int, allowed: int) -> int:
        reached = new = start
        while new:
            touched = 0
            while new:
                lowest = new & -new
                touched |= self._linked[lowest.bit_length() - 1]
                new ^= lowest
            new = touched & allowed & ~reached
            reached |= new
        return reached

    def _neighbours(self, at: Int64Array) -> BoolArray:
        touched = 0
        for i in at.tolist():
            touched |= self._linked[i]
        return _members(touched, self._part.size)


def _mask(members: BoolArray) -> int:
    return int.from_bytes(np.packbits(members, bitorder="little").tobytes(), "little")


def _mask_of(at: Int64Array | Int32Array, n: int) -> int:
    members: BoolArray = np.zeros(n, dtype=bool)
    members[at] = True
    return _mask(members)


def _members(mask: int, n: int) -> BoolArray:
    packed = np.frombuffer(mask.to_bytes(-(-n // 8), "little"), dtype=np.uint8)
    members: BoolArray = np.unpackbits(packed, count=n, bitorder="little").astype(bool)
    return members


def least_cut(
    network: Network, x: FloatArray, inside: BoolArray, source: BoolArray, far: BoolArray, *, whole: bool
) -> tuple[BoolArray, BoolArray] | None:
    """(side, between), (N,) bool each: a least cut, of x, between candidates `source` and `far`, nearest to `source`.

    inside : those that there are. whole : `source` and `far` are not cut themselves. None where the cut has 1 or more.
    """
    from planner_core.select import compiled_cuts

    limit = np.where(inside, np.floor(x * FLOW_UNIT), -1).astype(np.int64)
    if whole:
        limit[source | far] = NO_LIMIT
    side = np.zeros(limit.size, dtype=np.uint8)
    sum_of = compiled_cuts.least_cut(
        network.starts, network.neighbour, network.opposite, limit, source, far, FLOW_UNIT, side
    )
    return None if sum_of >= FLOW_UNIT else (side == 2, side == 1)

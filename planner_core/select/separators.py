"""Separators of a network: what parts a side of it from the rest bounds what that side alone can cover.

Input a `CutMaker` of a problem, and its `Network`; output the separators of points x, and `Cut`s of some that x
violates.

Let a set Z of candidates be taken away from a part of the graph, so that a side D of it has no link to the rest E of
the part, and let every plan have a station in Z or in E (all other candidates miss a target). The stations of a part
are connected: a plan with a station in D has one in Z, too. So for every row r that nobody sees but from D and Z

    [r is seen] <= x(Z),  the sum of x over Z

and x(Z) >= 1 where no plan does without both D and Z. x takes a little of everybody, so that many rows are seen in
full and little is in Z: cuts of coverage (relaxation.py) then count such rows by Z, not by who sees them.

Z is a least cut, with x_i for the capacity of i, between all who see a row and whoever is some links away from them;
then farther out from there.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.select.network import Network
from planner_core.select.network_cuts import least_cut
from planner_core.select.relaxation import CUT_UNIT, Cut, CutMaker, SeparatorUse

#: The far side of a cut begins so many links away from those who see a row: one sweep over the rows for each.
_HOPS = (2, 3, 5)
#: Rows that a sweep begins at, and flows about each: every one begins from where the last one cut.
_SEEDS, _OUTWARD = 60, 3
#: More than this in Z is not worth while.
_MOST_BETWEEN = 0.95
#: Rows of which less is covered are no seeds.
_LEAST_COVER = 0.3
#: An order of rows without any pattern: multiples of 2^32 / golden ratio.
_STRIDE = 2654435769
#: So many of them further, the next sweep begins.
_SHIFT = 1009


class Separators:
    """Those of one network that were found so far.

    between : of each that bounds rows the candidates, (M,) int64. n_looks, n_flows : how often it was tested whether
    candidates reach all targets, and flows computed.
    """

    def __init__(self, maker: CutMaker, network: Network) -> None:
        self.n_looks = self.n_flows = self._n_orders = 0
        self.between: list[Int64Array] = []
        self._rows: list[Int64Array] = []
        self._maker, self._network = maker, network
        self._counts = maker.problem.counts_for.any(axis=0)
        self._n_viewers = np.diff(maker.first_seer)
        self._known: set[bytes] = set()

    @cached_property
    def _order(self) -> Int64Array:
        order: Int64Array = np.argsort(np.arange(self._counts.size) * _STRIDE % 2**32, kind="stable")
        return order

    def through(self, x: FloatArray) -> SeparatorUse:
        """What x has in them."""
        number, part = np.full(self._counts.size, -1, dtype=np.int64), np.ones(self._counts.size)
        value = np.array([float(x[between].sum()) for between in self.between])
        for at in np.argsort(-value, kind="stable").tolist():  # the least comes last, and stays
            if value[at] < 1.0:
                part[self._rows[at]], number[self._rows[at]] = value[at], at
        return SeparatorUse(part, number, tuple(self.between))

    def sweep(self, x: FloatArray) -> list[Cut]:
        """Look for separators that hold little of x, keep those that bound rows, and return cuts of the others."""
        cuts = []
        for hops in _HOPS:
            order = np.roll(self._order, -_SHIFT * self._n_orders)  # others come first every time
            self._n_orders += 1
            left = self._counts & (self._maker.cover(x) >= _LEAST_COVER)
            for _ in range(_SEEDS):
                if not left.any():
                    break
                seed = int(order[np.argmax(left[order])])
                viewers = self._viewers(seed)
                left[self._only_from(viewers)] = False
                for side, between in self._outward(viewers, hops, x):
                    rows = self._only_from(np.concatenate([side, between]))
                    left[rows] = False
                    if float(x[between].sum()) > _MOST_BETWEEN:
                        break
                    cuts += self._keep(side, between, rows)
        return cuts

    # ------------------------------------------------------------------------------------------ where to cut
    def _outward(self, source: Int64Array, hops: int, x: FloatArray) -> Iterator[tuple[Int64Array, Int64Array]]:
        """Sides and what parts each from the rest, from near to far."""
        for _ in range(_OUTWARD):
            found = self._least_cut(source, hops, x)
            if found is None:
                return
            yield found
            source = np.concatenate(found)

    def _least_cut(self, source: Int64Array, hops: int, x: FloatArray) -> tuple[Int64Array, Int64Array] | None:
        """(side, between) for `source` and all who are more than `hops` links away.

        None where there is nobody, or a whole station is between.
        """
        near, out = self._near(source, hops)
        if not out.any():
            return None
        self.n_flows += 1
        sources = np.zeros(x.size, dtype=bool)
        sources[source] = True
        cut = least_cut(self._network, x, near, sources, out, whole=False)
        return None if cut is None else (np.flatnonzero(cut[0]), np.flatnonzero(cut[1]))

    def _near(self, source: Int64Array, hops: int) -> tuple[BoolArray, BoolArray]:
        """(N,) bool: candidates at most `hops` links away, and which of them are linked to others."""
        reached: BoolArray = np.zeros(self._network.n_candidates, dtype=bool)
        reached[source] = True
        for _ in range(hops):
            reached |= self._network.graph @ reached > 0
        out: BoolArray = reached & (self._network.graph @ ~reached > 0)
        return reached, out

    def _viewers(self, row: int) -> Int64Array:
        """Those who see a row, of the part that the first of them is in."""
        begin, end = self._maker.first_seer[row : row + 2]
        seen_by = self._maker.seer[begin:end].astype(np.int64)
        viewers: Int64Array = seen_by[self._network.part[seen_by] == self._network.part[seen_by[0]]]
        return viewers

    # ------------------------------------------------------------------------------------------ what they bound
    def _only_from(self, candidates: Int64Array) -> Int64Array:
        """Rows that nobody else sees."""
        among = np.zeros(self._network.n_candidates)
        among[candidates] = 1.0
        rows: Int64Array = np.flatnonzero((self._maker.cover(among) == self._n_viewers) & self._counts)
        return rows

    def _keep(self, side: Int64Array, between: Int64Array, rows: Int64Array) -> list[Cut]:
        """Keep a new separator where every plan has somebody beyond; its cut where every plan has somebody in it."""
        key = np.sort(between).tobytes()
        if key in self._known or not rows.size:
            return []
        self._known.add(key)
        beyond: BoolArray = self._network.part == self._network.part[between[0]]
        beyond[side] = False
        if self._can_do_without(beyond):
            return []
        within = np.zeros(self._network.n_candidates, dtype=bool)
        within[side] = within[between] = True
        if self._can_do_without(within):
            self.between.append(between)
            self._rows.append(rows)
            return []
        coefficient = np.zeros(self._network.n_candidates, dtype=np.int64)
        coefficient[between] = CUT_UNIT
        return [Cut(coefficient)]

    def _can_do_without(self, candidates: BoolArray) -> bool:
        self.n_looks += 1
        return self._maker.reaches(~candidates)

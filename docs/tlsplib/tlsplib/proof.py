"""Certificates: a plan, and a proof that a checker of a page can follow, that no plan has fewer stations than a bound.

Input an `Instance` and a plan of it, output the certificate as JSON holds it. The proof is a tree of branches. It is
made by linear programs of cuts as in `planner_core.select.relaxation`, with what a checker needs kept: a cut of
coverage is named by a constraint and shares of stations in 1/256, a cut of rows by a constraint and shares of its rows,
a cut of links by the candidates in between. CONTROL FLOW, `certify`: for large instances begin with cuts of rows, whose
shares are prices of the linear relaxation; solve the root by rounds of cuts; prove by a tree that no plan is smaller
than the one at hand; where that takes too long, than by one station less; else the root's bound is the bound.

A node is closed where its prices, as they are written, reach the bound in whole numbers: `exact_bound` checks that. Its
coefficients are those of the cuts or a little larger, so that the checker, which rounds up exactly, finds no less.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from planner_core.model import FloatArray, Int64Array
from planner_core.select.branching import groups_of
from planner_core.select.large_bound import large_bound
from planner_core.select.network_cuts import NetworkCuts
from planner_core.select.relaxation import (
    BOUND_UNIT,
    NO_MOST,
    TARGET_UNIT,
    Bound,
    Branch,
    Cut,
    CutMaker,
    CutProgram,
    exact_bound,
    independent_constraints,
)

from . import checker
from .instance import Instance

SHARE = checker.SHARE
#: Prices are whole numbers of 1 / 2^bits: the coarsest that still proves a node is written.
_BITS = (8, 11, 14, 20)
_ROOT_ROUNDS, _ROOT_WINDOW, _ROOT_GAIN = 600, 25, 0.005
_ROUNDS, _ROUND_GAIN = 40, 0.002
#: Of the point that follows the solution, for which cuts are made as well.
_ROOT_STEP, _STEP = 0.1, 0.2
_VIOLATION = 1e-4
_PROBES = 8
_WHOLE = 1e-6
#: No tree of a large instance is tried where the plan has more stations than that above the root.
_MOST_ABOVE_ROOT = 3
_NO_PRICES: tuple[int, list[int]] = (0, [])


class GivenUpError(Exception):
    """The tree got too large, or took too long."""


class SmallerPlanError(Exception):
    """A plan with fewer stations turned up: `chosen`."""

    def __init__(self, chosen: list[int]) -> None:
        super().__init__(f"a plan of {len(chosen)} stations")
        self.chosen = chosen


@dataclass
class _Node:
    """lower, upper : range of each candidate. counts : of groups, (least, most). path : branches down to here."""

    lower: Int64Array
    upper: Int64Array
    counts: dict[int, tuple[int, int]] = field(default_factory=dict)
    path: tuple[tuple[int, int], ...] = ()
    """(group, side) of each branch, -1 for a candidate's."""


class Prover:
    """Linear programs of one instance, and the trees made of them."""

    def __init__(self, instance: Instance, plan: Sequence[int], rows: Sequence[tuple[Cut, list[Any]]] = ()) -> None:
        self.instance = instance
        self._maker = CutMaker(instance.problem)
        network = instance.network
        self._joins = None if network is None else NetworkCuts(network, self._maker.reaches)
        self._groups = groups_of(instance.problem)
        n = instance.n_candidates
        self._program = CutProgram(n, slack_price=float(len(plan) + 1), groups=self._groups)
        self._constraints = independent_constraints(instance.problem)
        self._known: dict[bytes, list[Any]] = {_key(cut.coefficient, cut.right): name for cut, name in rows}
        self._program.add([cut for cut, _ in rows])
        self._centre = np.full(n, 0.5)
        self._end_s = 0.0
        self._nodes_left = 0
        self._used: dict[bytes, int] = {}

    # ------------------------------------------------------------------------------------------ bounds
    def root(self, *, time_limit_s: float) -> int:
        """Solve the relaxation of the whole, in half the time without cuts of links; return its bound."""
        none = np.zeros(self.instance.n_candidates, dtype=np.int64)
        node = _Node(none, none + 1)
        self._program.set_range(node.lower, node.upper)
        best = 0
        for joining in (False, True):
            values: list[int] = []
            end_s = time.process_time() + time_limit_s / 2
            for _ in range(_ROOT_ROUNDS):
                x, price = self._program.solve()
                values.append(self._bound(price, node).scaled)
                self._centre = self._centre + _ROOT_STEP * (x - self._centre)
                self._program.drop_idle()
                slow = len(values) > _ROOT_WINDOW and (
                    max(values[-_ROOT_WINDOW:]) - max(values[:-_ROOT_WINDOW]) < _ROOT_GAIN * BOUND_UNIT
                )
                late = time.process_time() > end_s
                if late or slow or not self._add_cuts(x, self._centre, joining=joining):
                    break
            best = max(best, *values)
            if self._joins is None:
                break
        return -(-best // BOUND_UNIT)

    def tree(self, bound: int, *, most_nodes: int, time_limit_s: float) -> list[list[Any]]:
        """Nodes in preorder that prove the bound; cuts are named by their place in `self.cuts()`.

        Raises GivenUpError, or SmallerPlanError where the bound does not hold.
        """
        self._nodes_left, self._end_s, self._used = most_nodes, time.process_time() + time_limit_s, {}
        n = self.instance.n_candidates
        none = np.zeros(n, dtype=np.int64)
        nodes: list[list[Any]] = []
        self._prove(_Node(none, none + 1), self._centre, bound, nodes)
        for node in nodes:  # rows of the path come after all cuts, whose number is known only now
            node[1] = [v if place % 2 or v >= 0 else len(self._used) - 1 - v for place, v in enumerate(node[1])]
        return nodes

    def cuts(self) -> list[list[Any]]:
        """Those that the last tree names."""
        return [self._known[key] for key in self._used]

    # ------------------------------------------------------------------------------------------ the tree
    def _prove(self, node: _Node, centre: FloatArray, bound: int, nodes: list[list[Any]]) -> None:
        """Append the node and all below it."""
        self._nodes_left -= 1
        if self._nodes_left < 0 or time.process_time() > self._end_s:
            raise GivenUpError
        entry: list[Any] = [*_NO_PRICES, None]
        nodes.append(entry)
        if (node.lower > node.upper).any() or not self._possible(node):
            return
        entry[:2], x, centre, closed = self._tightened(node, centre, bound)
        if closed or not self._possible(node):
            if not closed:
                # What prices fix leaves nothing: they are written, and the checker sees it, too.
                assert entry[1]
            return
        self._note_plan(x, bound)
        branch = self._branch_at(x, node)
        if branch is None:
            raise SmallerPlanError(np.flatnonzero(node.lower).tolist())
        group = [branch.candidate] if branch.group < 0 else np.flatnonzero(self._groups[branch.group]).tolist()
        entry[2] = [branch.below, *group]
        for side in (0, 1):
            self._prove(self._side(node, branch, side), centre, bound, nodes)

    def _side(self, node: _Node, branch: Branch, side: int) -> _Node:
        lower, upper, counts = node.lower.copy(), node.upper.copy(), dict(node.counts)
        if branch.group < 0:
            lower[branch.candidate] = upper[branch.candidate] = side
        else:
            low, high = counts.get(branch.group, (0, int(self._groups[branch.group].sum())))
            counts[branch.group] = (low, branch.below) if side == 0 else (branch.below + 1, high)
        return _Node(lower, upper, counts, (*node.path, (branch.group, side)))

    def _tightened(
        self, node: _Node, centre: FloatArray, bound: int
    ) -> tuple[tuple[int, list[int]], FloatArray, FloatArray, bool]:
        """Prices to write, the solution, the point that follows it, and whether the node is closed."""
        self._program.set_range(node.lower, node.upper)
        self._program.set_counts(node.counts)
        goal, best, x = (bound - 1) * BOUND_UNIT, 0, centre
        for _ in range(_ROUNDS):
            x, price = self._program.solve()
            value = self._bound(price, node).scaled
            if value > goal:
                break
            gain, best = value - best, max(best, value)
            centre = centre + _STEP * (x - centre)
            whole = not (np.minimum(x, 1 - x) > _WHOLE).any()
            if gain < _ROUND_GAIN * BOUND_UNIT and not whole:
                break
            self._program.drop_idle()
            if not self._add_cuts(x, centre, joining=True):
                break
        x, price = self._program.solve()
        price = self._of_path(price)
        for bits in _BITS:
            coarse = np.rint(price * 2**bits) / 2**bits
            found = self._bound(coarse, node)
            if found.scaled > goal:
                return self._written(coarse, bits, node), x, centre, True
        fixes = self._fix(found, node, goal)
        return self._written(coarse, _BITS[-1], node) if fixes else _NO_PRICES, x, centre, False

    def _fix(self, bound: Bound, node: _Node, goal: int) -> bool:
        """Fix what a smaller plan cannot have, or has to have; whether any, as the checker does it."""
        free = node.lower < node.upper
        beyond = np.array([bound.scaled + abs(m) > goal for m in bound.margin.tolist()])
        out, inside = free & beyond & (bound.margin > 0), free & beyond & (bound.margin <= 0)
        node.upper[out] = 0
        node.lower[inside] = 1
        return bool(out.any() or inside.any())

    def _written(self, price: FloatArray, bits: int, node: _Node) -> tuple[int, list[int]]:
        """Bits and prices in 1 / 2^bits, each after the number of its row; rows of the path are negative here."""
        program, found = self._program, []
        for at in np.flatnonzero(price).tolist():
            whole = round(float(price[at]) * 2**bits)
            if program.most[at] < NO_MOST:
                found += [-1 - self._on_path(program.cuts[at], node, int(whole > 0)), abs(whole)]
                continue
            if whole > 0:
                key = _key(program.cuts[at], int(program.right[at]))
                found += [self._used.setdefault(key, len(self._used)), whole]
        return bits, found

    def _on_path(self, row: Int64Array, node: _Node, side: int) -> int:
        """Place of the last branch on the path that bounds the row's group on this side; it is the tightest."""
        places = [
            place
            for place, (group, taken) in enumerate(node.path)
            if group >= 0 and taken == side and bool(((row > 0) == self._groups[group]).all())
        ]
        return places[-1]

    def _bound(self, price: FloatArray, node: _Node) -> Bound:
        program = self._program
        return exact_bound(program.cuts, program.right, self._of_path(price), node.lower, node.upper, program.most)

    def _of_path(self, price: FloatArray) -> FloatArray:
        """Prices without those of sides of groups that no branch has bounded: nothing in the tree has them."""
        program = self._program
        bounded = program.most < NO_MOST
        free_above = bounded & (program.most >= program.cuts.sum(axis=1)) & (price < 0)
        free_below = bounded & (program.right <= 0) & (price > 0)
        return np.where(free_above | free_below, 0.0, price)

    # ------------------------------------------------------------------------------------------ plans
    def _possible(self, node: _Node) -> bool:
        """Whether the candidates that are left hold a plan with those that are in, as the checker looks at it."""
        allowed = node.upper > 0
        if self.instance.links is None:
            return self._maker.reaches(allowed)
        links, left = self.instance.links, allowed.copy()
        while left.any():
            piece = np.zeros(left.size, dtype=bool)
            piece[np.argmax(left)] = True
            while (new := links[piece].any(axis=0) & left & ~piece).any():
                piece |= new
            left &= ~piece
            if not (node.lower[~piece] > 0).any() and self._maker.reaches(piece):
                return True
        return False

    def _note_plan(self, x: FloatArray, bound: int) -> None:
        if (np.minimum(x, 1 - x) <= _WHOLE).all():
            chosen = np.flatnonzero(x > 0.5).tolist()
            if len(chosen) < bound and self.instance.is_solved_by(chosen):
                raise SmallerPlanError(chosen)

    def _branch_at(self, x: FloatArray, node: _Node) -> Branch | None:
        """Of likely branches the one whose sides promise most; None where all is fixed."""
        if (node.lower == node.upper).all():
            return None
        distance = np.where(node.lower < node.upper, np.abs(x - 0.5), 1.0)
        likely = np.argsort(distance, kind="stable")[:_PROBES]
        likely = likely[distance[likely] < 0.5 - _WHOLE]
        branches = [Branch(candidate=int(i)) for i in likely] + self._group_branches(x)
        if not branches:
            return Branch(candidate=int(np.argmin(distance)))
        if len(branches) == 1:
            return branches[0]
        values, _ = self._program.probe(branches, node.lower, node.upper, enough=np.inf)
        gain = np.maximum(values - float(x.sum()), 1e-4)
        return branches[int(np.argmax(gain[:, 0] * gain[:, 1]))]

    def _group_branches(self, x: FloatArray) -> list[Branch]:
        taken = self._groups @ x
        distance = np.abs(taken - np.floor(taken) - 0.5)
        order = np.lexsort((-self._groups.sum(axis=1), distance))
        order = order[distance[order] < 0.4][:_PROBES]
        return [Branch(group=int(g), below=int(np.floor(taken[g]))) for g in order]

    # ------------------------------------------------------------------------------------------ cuts
    def _add_cuts(self, x: FloatArray, centre: FloatArray, *, joining: bool) -> bool:
        """Add what the solution violates, and the point that follows it; whether the solution violates any."""
        own, more = self._cuts_for(x, x, joining=joining), self._cuts_for(centre, centre, joining=joining)
        self._program.add(own + more)
        return bool(own)

    def _cuts_for(self, point: FloatArray, x: FloatArray, *, joining: bool) -> list[Cut]:
        shares = np.rint(point * SHARE).astype(np.int64)
        found = []
        for k in self._constraints:
            share = self._maker.shares(shares / SHARE, int(self.instance.problem.seen_from[k]))
            cut = self._maker.cut(k, share.part >= 1.0 - 1e-9, share)
            if cut is not None and float(cut.coefficient @ x) < cut.right * (1.0 - _VIOLATION):
                at = np.flatnonzero(shares)
                pairs = np.stack([at, shares[at]], axis=1).ravel().tolist()
                self._known.setdefault(_key(cut.coefficient, cut.right), ["cover", k, pairs])
                found.append(cut)
        if self._joins is not None and joining:
            for cut in self._joins.violated(x):
                between, paid = np.flatnonzero(cut.coefficient > 0), np.flatnonzero(cut.coefficient < 0)
                self._known.setdefault(_key(cut.coefficient, cut.right), ["links", between.tolist(), paid.tolist()])
                found.append(cut)
        return found


def _key(coefficient: Int64Array, right: int) -> bytes:
    return coefficient.tobytes() + right.to_bytes(8, "little", signed=True)


def rows_cuts(instance: Instance, *, n_stations: int, work_limit: float) -> list[tuple[Cut, list[Any]]]:
    """Cuts of rows for prices of the linear relaxation, one a constraint that has a price, and what names them.

    With the prices of constraints they say what `planner_core.select.large_bound` does, but for rounding of shares.
    """
    problem, needs = instance.problem, instance.needs
    found = large_bound(problem, n_stations=n_stations, network=instance.network, n_parts=1, work_limit=work_limit)
    times = np.unique(problem.seen_from).tolist()
    reader = checker.Instance(instance.raw)
    cuts: list[tuple[Cut, list[Any]]] = []
    for k, need in enumerate(needs):
        if not found.constraint_price[k]:
            continue
        alike = [(o.rows, float(p)) for o, p in zip(needs, found.constraint_price, strict=True)]
        alike = [pair for pair, o in zip(alike, needs, strict=True) if o.seen_from == need.seen_from]
        worth = sum(np.where(rows, price, 0.0) for rows, price in alike) / TARGET_UNIT * instance.ticks
        price = need.seen_from * found.row_price[times.index(need.seen_from)].astype(np.float64)
        share = np.rint(np.clip(price[need.rows] / worth[need.rows], 0.0, 1.0) * SHARE).astype(np.int64)
        name = ["rows", k, share.tolist()]
        try:
            terms, right = reader.cut(*name)
        except checker.RefusedError:
            continue  # it asks for nothing, less what the first station is spared
        coefficient = np.zeros(instance.n_candidates, dtype=np.int64)
        coefficient[list(terms)] = list(terms.values())
        cuts.append((Cut(coefficient, right), name))
    return cuts


def certify(
    instance: Instance,
    plan: Sequence[int],
    *,
    most_nodes: int = 3000,
    time_limit_s: float = 60.0,
    root_limit_s: float = float("inf"),
    work_limit: float = 0.0,
) -> dict[str, Any]:
    """Make the certificate of a plan with the best bound that the limits allow; a smaller plan takes its place.

    Parameters
    ----------
    most_nodes, time_limit_s
        Of the tree of each bound that is tried.
    root_limit_s
        CPU time of the cuts before.
    work_limit
        Of prices of rows to begin with, which serve large instances; 0: none.
    """
    chosen = [int(i) for i in plan]
    rows = rows_cuts(instance, n_stations=len(chosen), work_limit=work_limit) if work_limit else []
    while True:
        prover = Prover(instance, chosen, rows)
        root = max(1, min(prover.root(time_limit_s=root_limit_s), len(chosen)))
        try:
            most = len(chosen) if not rows or len(chosen) <= root + _MOST_ABOVE_ROOT else root
            bound, tree = _best_tree(prover, root, most, most_nodes, time_limit_s)
        except SmallerPlanError as better:
            chosen = better.chosen
            continue
        return {
            "format": "tlsplib certificate 1",
            "instance": instance.name,
            "sha256": instance.sha256,
            "plan": sorted(chosen),
            "bound": bound,
            "cuts": prover.cuts(),
            "tree": tree,
        }


def _best_tree(
    prover: Prover, root: int, most: int, most_nodes: int, time_limit_s: float
) -> tuple[int, list[list[Any]]]:
    """The highest bound from `most` down to the root's that a tree proves, and the tree."""
    for bound in range(most, root, -1):
        try:
            return bound, prover.tree(bound, most_nodes=most_nodes, time_limit_s=time_limit_s)
        except GivenUpError:
            continue
    return root, prover.tree(root, most_nodes=10, time_limit_s=float("inf"))

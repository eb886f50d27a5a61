"""Whether a set of stations really meets its targets: checked by other means than those that found it.

Input a `CoverProblem`, or `Visibility` with patch areas (m^2), and the chosen candidates; nothing is returned, a set
that falls short raises. Selection runs the first on every set before it hands it on. Neither uses anything of the
search: rows are counted one by one, areas summed in Python's own whole numbers, or by `math.fsum`.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np

from planner_core.errors import PlannerError
from planner_core.model import FloatArray, Int64Array, Visibility
from planner_core.select.network import Network
from planner_core.select.problem import Constraint, CoverProblem

#: Shares are compared in float64: sums are exact to the last place, the product with a fraction is not.
_SHARE_SLACK = 1e-9


class SelectionCheckError(PlannerError, RuntimeError):
    """A set of stations is not what its search claims: a fault of ours, never of the user's."""


def check_selection(
    problem: CoverProblem, chosen: Sequence[int], *, given: Sequence[int] = (), network: Network | None = None
) -> None:
    """Look whether `chosen` are different candidates, hold all of `given`, meet every target, and are connected.

    Raises
    ------
    SelectionCheckError
        They are not, or do not.
    """
    _check_candidates(chosen, problem.n_candidates)
    lost = set(given) - set(chosen)
    if lost:
        raise SelectionCheckError(
            f"selection: got a set without given candidates {sorted(lost)}, expected all of them; please report this"
        )
    starts, row = problem.starts.tolist(), problem.row
    looks: Counter[int] = Counter()
    for candidate in chosen:
        looks.update(row[starts[candidate] : starts[candidate + 1]].tolist())
    ticks = problem.ticks.tolist()
    for number, (counted, required) in enumerate(zip(problem.counts_for, problem.required.tolist(), strict=True)):
        enough = int(problem.seen_from[number])
        covered = sum(ticks[r] for r, n in looks.items() if counted[r] and n >= enough)
        if covered < required:
            raise SelectionCheckError(
                f"selection: got {covered} ticks of constraint {number} with {len(chosen)} stations, expected at least "
                f"{required}; please report this"
            )
    if network is not None:
        _check_network(network, chosen)


def _check_network(network: Network, chosen: Sequence[int]) -> None:
    """Every part's candidates reach each other over links between them; with `loops` also when any one link fails."""
    of_part: dict[int, list[int]] = {}
    for candidate in chosen:
        of_part.setdefault(int(network.part[candidate]), []).append(candidate)
    for part, members in of_part.items():
        linked = {a: set(network.neighbours(a).tolist()) & set(members) for a in members}
        reached = _reached(linked, members[0])
        if len(reached) < len(members):
            raise SelectionCheckError(
                f"selection: got {len(reached)} of {len(members)} stations of component {part} connected by links, "
                "expected all; please report this"
            )
        if not network.loops or len(members) < 3:
            continue
        links = [(min(a, b), max(a, b)) for a in members for b in linked[a]]
        for a, b in sorted(set(links)):
            if b not in _reached(linked, a, without=(a, b)) and b in _reached_in_graph(network, a, without=(a, b)):
                raise SelectionCheckError(
                    f"selection: got stations {a} and {b} connected by one link only, expected a second connection; "
                    "please report this"
                )


def _reached(linked: dict[int, set[int]], start: int, *, without: tuple[int, int] | None = None) -> set[int]:
    """Nodes that links lead to from `start`, but for one link."""
    reached, left = {start}, [start]
    while left:
        node = left.pop()
        for other in linked[node] - reached:
            if without is None or {node, other} != set(without):
                reached.add(other)
                left.append(other)
    return reached


def _reached_in_graph(network: Network, start: int, *, without: tuple[int, int]) -> set[int]:
    return _reached(
        {c: set(network.neighbours(c).tolist()) for c in range(network.n_candidates)}, start, without=without
    )


def check_coverage(
    visibility: Visibility, patch_area_m2: FloatArray, constraints: Sequence[Constraint], chosen: Sequence[int]
) -> None:
    """Look at the same before patches were merged and areas rounded: what `cover_problem` made is checked too.

    Raises
    ------
    SelectionCheckError
        A target is missed by more than rounding in the last places.
    """
    _check_candidates(chosen, visibility.n_positions)
    possible = _times_seen(visibility, range(visibility.n_positions))
    looks = _times_seen(visibility, chosen)
    for number, constraint in enumerate(constraints):
        achievable = constraint.part & (possible >= constraint.seen_from)
        whole_m2 = math.fsum(patch_area_m2[achievable])
        covered_m2 = math.fsum(patch_area_m2[achievable & (looks >= constraint.seen_from)])
        if covered_m2 < (constraint.fraction - _SHARE_SLACK) * whole_m2:
            raise SelectionCheckError(
                f"selection: got {covered_m2:.6f} m2 of constraint {number}, expected {constraint.fraction:g} of "
                f"{whole_m2:.6f} m2; please report this"
            )


def _times_seen(visibility: Visibility, candidates: Iterable[int]) -> Int64Array:
    """(P,) from how many of the candidates each patch is seen, row by row: all rows at once are millions of numbers."""
    times = np.zeros(visibility.n_patches, dtype=np.int64)
    for candidate in candidates:
        times[visibility.row(candidate)] += 1  # a patch that a row has twice is seen once
    return times


def _check_candidates(chosen: Sequence[int], n_candidates: int) -> None:
    if len(set(chosen)) != len(chosen):
        raise SelectionCheckError(f"selection: got a candidate twice in {sorted(chosen)}; please report this")
    wrong = [c for c in chosen if not 0 <= c < n_candidates]
    if wrong:
        raise SelectionCheckError(
            f"selection: got candidates {wrong}, expected numbers below {n_candidates}; please report this"
        )

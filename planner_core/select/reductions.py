"""A smaller selection problem with the same answer: what cannot matter is left out before anybody searches.

Input a `CoverProblem`, output a `Reduced` one and the way back. Each rule leaves the least number of stations as it is,
whatever R between `least` and `required` the targets stand for; each rule has its reason beside it. They are repeated
until none finds anything, since each makes work for the others.

Two rules hold only where one look at a row is enough and stations need not be connected: what forced candidates see is
not always done with, and of two candidates that see the same both may be needed, or the lesser one as a link. Otherwise
candidates stay what they are, forced ones are pinned, and rows alone are left out or merged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import BoolArray, Int64Array, UInt8Array
from planner_core.select.problem import CoverProblem

#: Candidates seen by more than these times words of bits are compared in pieces, to keep memory flat.
_BYTES_AT_A_TIME = 2**26


@dataclass(frozen=True)
class Reduced:
    """problem : what is left. candidate : (N',) int64, its candidates' numbers in the whole problem.

    forced : candidates of the whole problem that every solution can be taken to hold, `given` ones first; a solution of
    what is left, mapped back, and these together are one of the whole. pinned : candidates of what is left that a
    solution of it has to hold, `given` ones first; where there are any, none are forced. n_dominated : for the record.
    """

    problem: CoverProblem
    candidate: Int64Array
    forced: tuple[int, ...]
    n_dominated: int
    pinned: tuple[int, ...] = ()

    def whole(self, chosen: Sequence[int]) -> tuple[int, ...]:
        """Forced candidates, then the chosen ones, by their numbers in the whole problem."""
        return (*self.forced, *(int(self.candidate[c]) for c in chosen))


def reduce_problem(problem: CoverProblem, *, given: Sequence[int] = (), rows_only: bool = False) -> Reduced:
    """Apply all rules until none finds anything.

    Parameters
    ----------
    given
        Candidates that are in every solution, such as stations already scanned from.
    rows_only
        Keep all candidates, with their numbers: for where they need each other. So it is, too, where a target asks for
        more than one look.

    Raises
    ------
    RequirementError
        `given` names a candidate twice, or one that there is not.
    """
    _check_given(given, problem.n_candidates)
    if rows_only or (problem.seen_from > 1).any():
        return _without_idle_rows(problem, given)
    left = np.arange(problem.n_candidates, dtype=np.int64)
    forced = [int(c) for c in given]
    now, left = _take(problem, left, np.array(forced, dtype=np.int64))
    n_dominated = 0
    while True:
        before = (now.n_candidates, now.n_rows)
        now = _drop_met_constraints(now)
        now = _merge_rows(_drop_rows(now))
        need = _needed(now)
        forced += [int(left[c]) for c in need]
        now, left = _take(now, left, need)
        keep = ~_dominated(now)
        n_dominated += int((~keep).sum())
        now, left = _restrict(now, keep), left[keep]
        if (now.n_candidates, now.n_rows) == before:
            return Reduced(now, left, tuple(forced), n_dominated)


def _without_idle_rows(problem: CoverProblem, given: Sequence[int]) -> Reduced:
    """Apply the rules that leave candidates alone: once is enough, none makes work for another one."""
    now = _merge_rows(_drop_rows(_drop_met_constraints(problem)))
    pinned = tuple(dict.fromkeys([*(int(c) for c in given), *(int(c) for c in _needed(now))]))
    return Reduced(now, np.arange(problem.n_candidates), (), 0, pinned)


def _check_given(given: Sequence[int], n_candidates: int) -> None:
    wrong = [c for c in given if not 0 <= c < n_candidates]
    if wrong or len(set(given)) != len(given):
        raise RequirementError(
            f"given candidates: got {list(given)}, expected different numbers from 0 to {n_candidates - 1}"
        )


def _take(problem: CoverProblem, left: Int64Array, taken: Int64Array) -> tuple[CoverProblem, Int64Array]:
    """Candidates that are in the solution anyway: what they cover is no longer required, nor worth anything."""
    if taken.size == 0:
        return problem, left
    seen = np.zeros(problem.n_rows, dtype=bool)
    for candidate in taken:
        seen[problem.rows_of(int(candidate))] = True
    covered = (problem.counts_for * np.where(seen, problem.ticks, 0)).sum(axis=1)
    keep = np.ones(problem.n_candidates, dtype=bool)
    keep[taken] = False
    rest = replace(
        problem,
        counts_for=problem.counts_for & ~seen,
        required=np.maximum(problem.required - covered, 0),
        least=np.maximum(problem.least - covered, 0),
    )
    return _restrict(rest, keep), left[keep]


def _drop_met_constraints(problem: CoverProblem) -> CoverProblem:
    """Targets that require nothing any more count nothing; their places stay, so that numbers do."""
    return replace(problem, counts_for=problem.counts_for & (problem.required > 0)[:, None])


def _drop_rows(problem: CoverProblem) -> CoverProblem:
    """Rows without area, that no target counts, or that no candidate sees: covering them changes no sum."""
    seen = np.bincount(problem.row, minlength=problem.n_rows) > 0
    return _keep_rows(problem, seen & problem.counts_for.any(axis=0) & (problem.ticks > 0))


def _keep_rows(problem: CoverProblem, keep: BoolArray) -> CoverProblem:
    if keep.all():
        return problem
    number = np.cumsum(keep) - 1
    kept = keep[problem.row]
    before = np.concatenate([[0], np.cumsum(kept)])
    return replace(
        problem,
        starts=before[problem.starts].astype(np.int64),
        row=number[problem.row[kept]].astype(np.int32),
        ticks=problem.ticks[keep],
        counts_for=problem.counts_for[:, keep],
    )


def _merge_rows(problem: CoverProblem) -> CoverProblem:
    """Rows that the same candidates see and the same targets count are covered together: one row of their sum.

    `cover_problem` did so; taking candidates out makes more of them the same. The comparison is exact.
    """
    if problem.n_rows == 0:
        return problem
    starts, seer = problem.seers()
    groups: dict[bytes, int] = {}
    group = np.empty(problem.n_rows, dtype=np.int64)
    for row, (begin, end) in enumerate(pairwise(starts.tolist())):
        key = problem.counts_for[:, row].tobytes() + seer[begin:end].tobytes()
        group[row] = groups.setdefault(key, len(groups))
    first = np.unique(group, return_index=True)[1]
    if first.size == problem.n_rows:
        return problem
    ticks = np.zeros(first.size, dtype=np.int64)
    np.add.at(ticks, group, problem.ticks)
    stands_for = problem.ticks.copy()
    stands_for[first] = ticks
    keep = np.zeros(problem.n_rows, dtype=bool)
    keep[first] = True
    return _keep_rows(replace(problem, ticks=stands_for), keep)


def _needed(problem: CoverProblem) -> Int64Array:
    """Candidates without whom all others together miss a target's `least`: they are in every solution."""
    if problem.n_rows == 0:
        return np.zeros(0, dtype=np.int64)
    n_seers = np.bincount(problem.row, minlength=problem.n_rows)
    owner = np.repeat(np.arange(problem.n_candidates), np.diff(problem.starts))
    needed = np.zeros(problem.n_candidates, dtype=bool)
    for counted, least, enough in zip(problem.counts_for, problem.least, problem.seen_from, strict=True):
        entry = (n_seers == enough)[problem.row]
        own = np.zeros(problem.n_candidates, dtype=np.int64)
        np.add.at(own, owner[entry], np.where(counted, problem.ticks, 0)[problem.row[entry]])
        needed |= int(problem.ticks[counted].sum()) - own < least
    return np.flatnonzero(needed)


def _dominated(problem: CoverProblem) -> BoolArray:
    """(N,) bool: candidates whose rows another one sees too.

    If j's rows are among i's, then i in place of j covers no row less, so of no target less, in part or in whole: some
    best solution does without j. Of equals the lowest number stays. Who dominates j sees j's rarest row.
    """
    n = problem.n_candidates
    size = np.diff(problem.starts)
    dominated: BoolArray = size == 0
    if problem.n_rows == 0:
        return np.ones(n, dtype=bool)
    bits = _bits(problem)
    starts, seer = problem.seers()
    n_seers = np.diff(starts)
    for j in np.flatnonzero(~dominated):
        rows = problem.rows_of(int(j))
        rare = int(rows[np.argmin(n_seers[rows])])
        others = seer[starts[rare] : starts[rare + 1]]
        others = others[(size[others] > size[j]) | ((size[others] == size[j]) & (others < j))]
        dominated[j] = _any_holds(bits, others, int(j))
    return dominated


def _any_holds(bits: UInt8Array, others: Int64Array, j: int) -> bool:
    step = max(1, _BYTES_AT_A_TIME // max(bits.shape[1], 1))
    for begin in range(0, others.size, step):
        if (~(bits[j] & ~bits[others[begin : begin + step]]).any(axis=1)).any():
            return True
    return False


def _bits(problem: CoverProblem) -> UInt8Array:
    """(N, ceil(R / 8)) uint8: rows of each candidate."""
    bits = np.zeros((problem.n_candidates, -(-problem.n_rows // 8)), dtype=np.uint8)
    sees = np.zeros(problem.n_rows, dtype=bool)
    for candidate in range(problem.n_candidates):
        sees[:] = False
        sees[problem.rows_of(candidate)] = True
        bits[candidate] = np.packbits(sees)
    return bits


def _restrict(problem: CoverProblem, keep: BoolArray) -> CoverProblem:
    """Only the candidates to keep; targets' areas stay as they are."""
    if keep.all():
        return problem
    size = np.diff(problem.starts)
    return replace(
        problem,
        starts=np.concatenate([[0], np.cumsum(size[keep])]).astype(np.int64),
        row=problem.row[np.repeat(keep, size)],
    )

"""Annealing against row weighting, as published, and against what OR-Tools offers for set covering.

    python tests/benchmarks/bench_row_weighting.py [--write docs/method/selection.md] [--quick] [--work LIMIT]

On the problems of `bench_selection`: what they require, 95 %, and all that candidates see. No links, no proof; each has
the processor time that annealing took for its work. The table goes between the marks of the page. Not a test.

Gao, Weise, Li 2015, "An efficient local search heuristic with row weighting for the unicost set covering problem",
European Journal of Operational Research 246: once a set covers all, one goes. Then one goes, the least missed by
weight, and one comes that covers a random row left open, the most wanted by weight; rows left open gain weight. One
that has just come does not go, and one that went does not come before a neighbour has changed; of equals the one that
has waited longest. Ours, not theirs: where only an area is required, a set that covers so much is whole, and rows weigh
and gain their area.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from typing import Any

import numba
import numpy as np
from bench_selection import tasks
from numpy.typing import NDArray
from selection_report import machine, options_of, timed

from planner_core.device import open_device
from planner_core.model import FloatArray, Int64Array, Proven
from planner_core.select.problem import CoverProblem
from planner_core.select.proven import select

_STEPS = 2_000  # from one look at the clock to the next


# ---------------------------------------------------------------------------------------------- row weighting
def row_weighting(problem: CoverProblem, *, limit_s: float) -> list[int]:
    """Return the smallest set found within so much processor time."""
    counted = problem.counts_for.any(axis=0)
    is_all = bool((problem.required == problem.counts_for @ problem.ticks).all())
    gains = counted * (np.ones(problem.n_rows) if is_all else problem.ticks / problem.ticks[counted].mean())
    of = (problem.starts, problem.row, *problem.seers(), problem.ticks, counted, problem.counts_for, gains)
    n = problem.n_candidates
    state = (
        np.zeros(n, dtype=np.bool_),  # chosen
        np.zeros(
            n
        ),  # score: the weight that one who comes would cover; less that which would be lost with one who goes
        np.ones(n, dtype=np.bool_),  # may come
        np.zeros(n, dtype=np.int64),  # since when
        np.zeros(problem.n_rows, dtype=np.int64),  # how often each row is seen
        gains.copy(),  # weight of each row
        problem.required.copy(),  # what lacks
    )
    _begin(of, state)
    best, began_s, number = np.flatnonzero(state[0]), time.process_time(), 0
    while not number or time.process_time() - began_s < limit_s:
        best = _search(of, state, best, number, _STEPS)
        number += _STEPS
    return [int(candidate) for candidate in best]


@numba.njit
def _begin(of: Any, state: Any) -> None:
    """Take a greedy set."""
    starts, row = of[0], of[1]
    chosen, score, weight, lacks = state[0], state[1], state[5], state[6]
    for c in range(chosen.size):
        score[c] = weight[row[starts[c] : starts[c + 1]]].sum()
    while (lacks > 0).any():
        _turn(np.argmax(np.where(chosen, -1.0, score)), of, state)


@numba.njit
def _search(of: Any, state: Any, best: Int64Array, number: int, n_steps: int) -> Int64Array:
    _, _, seers_from, seer, _, counted, _, gains = of
    chosen, score, may_come, since, times, weight, lacks = state
    np.random.seed(number + 1)  # noqa: NPY002 - numba has no other
    came = -1
    for step in range(number + 1, number + n_steps + 1):
        while (lacks <= 0).all():
            if chosen.sum() < best.size:
                best = np.flatnonzero(chosen)
            _go(_best(score, since, chosen, -1), of, state, step)
        _go(_best(score, since, chosen, came), of, state, step)
        left = np.flatnonzero(counted & (times == 0))
        wanted = left[np.random.randint(left.size)]  # noqa: NPY002
        those, some = seer[seers_from[wanted] : seers_from[wanted + 1]], np.zeros(chosen.size, dtype=np.bool_)
        some[those] = may_come[those]
        if not some.any():  # all of them have just gone
            some[those] = True
        came = _best(score, since, some, -1)
        _turn(came, of, state)
        since[came] = step
        for r in left:
            if times[r] == 0:
                weight[r] += gains[r]
                for at in range(seers_from[r], seers_from[r + 1]):
                    score[seer[at]] += gains[r]
    return best


@numba.njit
def _best(score: FloatArray, since: Int64Array, some: NDArray[np.bool_], but: int) -> int:
    found = -1
    for c in range(score.size):
        if some[c] and c != but:
            is_equal = found >= 0 and score[c] == score[found]
            if found < 0 or score[c] > score[found] or (is_equal and since[c] < since[found]):
                found = c
    return found


@numba.njit
def _go(c: int, of: Any, state: Any, step: int) -> None:
    _turn(c, of, state)
    state[2][c], state[3][c] = False, step


@numba.njit
def _turn(c: int, of: Any, state: Any) -> None:
    """Let one come or go, and bring scores, looks and what lacks up to date."""
    starts, row, seers_from, seer, ticks, _, counts_for, _ = of
    chosen, score, may_come, _, times, weight, lacks = state
    step = -1 if chosen[c] else 1
    chosen[c], score[c] = not chosen[c], -score[c]
    for r in row[starts[c] : starts[c + 1]]:
        both = 2 * times[r] + step  # 1: from none to one or back, 3: from one to two or back
        times[r] += step
        for k in range(lacks.size):
            if both == 1 and counts_for[k, r]:
                lacks[k] -= step * ticks[r]
        for at in range(seers_from[r], seers_from[r + 1]):
            other = seer[at]
            may_come[other] = True
            if other != c and both == 1 and not chosen[other]:
                score[other] -= step * weight[r]
            elif other != c and both == 3 and chosen[other]:
                score[other] += step * weight[r]


# ----------------------------------------------------------------------------------------------- OR-Tools
def or_tools(problem: CoverProblem, *, limit_s: float) -> list[int]:
    """Return the smallest set that covers all rows: greedy, steepest descent, and again without a fifth of the best."""
    from ortools.set_cover.python import set_cover  # requirements/tlsplib.lock

    counted = problem.counts_for.any(axis=0)
    number = np.cumsum(counted) - 1
    model = set_cover.SetCoverModel()
    for candidate in range(problem.n_candidates):
        model.add_empty_subset(1.0)
        for r in problem.rows_of(candidate):
            if counted[r]:
                model.add_element_to_last_subset(int(number[r]))
    model.create_sparse_row_view()
    found, best = set_cover.SetCoverInvariant(model), np.ones(problem.n_candidates, dtype=bool)
    greedy, steepest = set_cover.GreedySolutionGenerator(found), set_cover.SteepestSearch(found)
    level, began_s = set_cover.consistency_level.REDUNDANCY, time.process_time()
    while True:
        if not (greedy.next_solution() and steepest.next_solution()):
            raise RuntimeError("OR-Tools found no set that covers all")
        selected = np.array(found.is_selected())
        if selected.sum() < best.sum():
            best = selected
        if time.process_time() - began_s > limit_s:
            return [int(candidate) for candidate in np.flatnonzero(best)]
        for candidate in np.flatnonzero(selected != best).tolist():
            (found.select if best[candidate] else found.deselect)(candidate, level)
        set_cover.clear_random_subsets(max(2, int(best.sum()) // 5), found)


# ------------------------------------------------------------------------------------------------ the table
def numbers_of(problem: CoverProblem, *, work: float, is_all: bool) -> tuple[list[int], float]:
    """Stations by each, and the processor time that each had."""
    ours, limit_s = timed(lambda: select(problem, Proven(prove=False, work_limit=work)).chosen)
    sets = [list(ours), row_weighting(problem, limit_s=limit_s)]
    if is_all:
        sets.append(or_tools(problem, limit_s=limit_s))
    if any((problem.covered(chosen) < problem.required).any() for chosen in sets):
        raise RuntimeError("a set lacks something")
    return [len(chosen) for chosen in sets], limit_s


def main() -> None:
    """Print the table, and write it where told."""
    options, device = options_of(__doc__, work=10.0), open_device()
    lines = [
        f"{machine(device)}.",
        "",
        "| scene, grid | candidates | 95 %: annealing | row weighting | all: annealing | row weighting | OR-Tools |",
        "|---|---|---|---|---|---|---|",
    ]
    for on in tasks(device, quick=options.quick):
        every = on.problem.counts_for @ on.problem.ticks
        some, some_s = numbers_of(on.problem, work=options.work, is_all=False)
        whole, whole_s = numbers_of(replace(on.problem, required=every, least=every), work=options.work, is_all=True)
        numbers = " | ".join(map(str, (on.problem.n_candidates, *some, *whole)))
        lines.append(f"| {on.name} | {numbers} |")
        print(lines[-1], f"{some_s:.1f} and {whole_s:.1f} s", file=sys.stderr, flush=True)
    text = "\n".join([*lines, ""])
    print(text)
    if options.write is not None:
        begin, end = "<!-- row weighting -->\n", "<!-- end of row weighting -->"
        before, _, rest = options.write.read_text(encoding="utf-8").partition(begin)
        options.write.write_text(before + begin + text + end + rest.partition(end)[2], encoding="utf-8")


if __name__ == "__main__":
    main()

"""Eq. 9, coverage over the number of stations: what it selects. Basement -> a chart and one station."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from planner_core.model import FloatArray
from planner_core.paper.genetic import GeneticSettings, select_genetic
from planner_core.select.problem import Constraint, CoverProblem, cover_problem

from .charts import COLOURS, chart, label
from .figure import Bench, Outcome, Verdict, at_native_columns
from .levels import open_level


def run(bench: Bench) -> Outcome:
    """Evolve with Eq. 9 from several seeds, and look at the ratio along the greedy order."""
    level = open_level(bench, "basement", grid_step_m=bench.at(1.0, 0.5))
    candidates = level.candidates()
    bench.tell(0, 3, "scan")
    visibility = level.engine.visible_patches(level.survey.template, candidates.position_m)
    area_m2 = level.survey.patches.area_m2
    seen = np.zeros(area_m2.size, dtype=bool)
    seen[visibility.patch] = True
    problem = cover_problem(visibility, area_m2, (Constraint(seen, 0.95),))
    single = np.array([problem.ticks[problem.rows_of(i)].sum() for i in range(problem.n_candidates)])
    bench.tell(1, 3, "evolve")
    ends = [
        select_genetic(problem, GeneticSettings(objective="eq9", seed=bench.seed + k)) for k in range(bench.at(5, 20))
    ]
    order, ratio = _greedy_ratio(problem)
    bench.tell(2, 3, "draw")
    with chart(bench, "eq9.png", "Eq. 9 against the number of stations", columns=2) as (_, axes, pictures):
        share = ratio / single.max()
        axes[0].plot(np.arange(1, len(order) + 1), share, color=COLOURS[0])
        axes[0].axhline(1.0, color="#888888", linewidth=0.6)
        label(axes[0], "Greedy order: the ratio only falls", "stations", "Eq. 9 / best single station")
        for k, end in enumerate(ends):
            axes[1].plot(end.active_by_iteration, color=COLOURS[k % len(COLOURS)], linewidth=1)
        axes[1].yaxis.get_major_locator().set_params(integer=True)
        axes[1].set_ylim(bottom=0)
        label(axes[1], "Genetic selection by Eq. 9, some seeds", "iteration", "stations of the best set")
    numbers = [end.chosen.size for end in ends]
    reached = [float(end.covered_by_iteration[-1] / end.active_by_iteration[-1] / single.max()) for end in ends]
    whole = float(single.max() / problem.ticks.sum())
    pairs = best_ratio_of_pairs(problem) / float(single.max())
    bench.tell(3, 3)
    facts = {
        "columns": level.columns,
        "n_candidates": problem.n_candidates,
        "stations_by_seed": numbers,
        "ratio_to_best_single": reached,
        "coverage_by_seed": [float(end.covered_by_iteration[-1] / problem.ticks.sum()) for end in ends],
        "best_single_coverage": whole,
        "best_pair_to_best_single": pairs,
        "greedy_order_to_best_single": [float(one) for one in share],
    }
    return Outcome(
        found=(
            f"left to itself, genetic selection by Eq. 9 ends with {_span(numbers)} of {problem.n_candidates} "
            f"stations ({len(ends)} seeds), at {min(reached):.3f} to {max(reached):.3f} of the best single station's "
            f"value; that station covers {100 * whole:.1f} % of what all cover. Of all pairs of stations the best has "
            f"{pairs:.3f} of that value, and along the greedy order the ratio only falls, to {share[-1]:.2f} at "
            f"{len(order)} stations. That has to be so: f(S) <= sum of f({{i}}) <= |S| max f({{i}}), so no set has a "
            "better ratio than the best single station."
        ),
        agrees=verdict(facts),
        pictures=tuple(pictures),
        numbers=facts,
    )


#: Of what all candidates cover: "the maximum number of polygons".
MOST_COVERED = 0.9


def verdict(numbers: Mapping[str, Any]) -> Verdict:
    """Whether Eq. 9 leads to few stations, more than one, that cover most; `partly` where it does for some seeds."""

    def judged() -> Verdict:
        ends = zip(numbers["stations_by_seed"], numbers["coverage_by_seed"], strict=True)
        good = [1 < n < numbers["n_candidates"] / 2 and covers >= MOST_COVERED for n, covers in ends]
        return "yes" if all(good) else "partly" if any(good) else "no"

    return at_native_columns(numbers, judged)


def best_ratio_of_pairs(problem: CoverProblem) -> float:
    """Return the greatest covered ticks over stations of all sets of two."""
    from scipy.sparse import csr_array

    shape = (problem.n_candidates, problem.n_rows)
    sees = csr_array((np.ones(problem.row.size), problem.row, problem.starts), shape)
    single = sees @ problem.ticks.astype(np.float64)
    shared = (sees.multiply(problem.ticks[None, :]).tocsr() @ sees.T).toarray()
    both = single[:, None] + single[None, :] - shared
    np.fill_diagonal(both, 0.0)
    return float(both.max() / 2.0)


def _span(numbers: list[int]) -> str:
    low, high = min(numbers), max(numbers)
    return f"{low}" if low == high else f"{low} to {high}"


def _greedy_ratio(problem: CoverProblem) -> tuple[list[int], FloatArray]:
    """Candidates in greedy order until nothing is gained, and covered ticks over stations after each."""
    from scipy.sparse import csr_array

    sees = csr_array((np.ones_like(problem.row), problem.row, problem.starts), (problem.n_candidates, problem.n_rows))
    seen_by = sees.T.tocsr()
    gain = sees @ problem.ticks
    left = problem.ticks.copy()
    order: list[int] = []
    covered: list[int] = []
    while gain.max() > 0:
        best = int(np.argmax(gain))
        order.append(best)
        covered.append((covered[-1] if covered else 0) + int(gain[best]))
        new = problem.rows_of(best)
        new = new[left[new] > 0]
        gain = gain - left[new] @ seen_by[new]
        left[new] = 0
    return order, np.array(covered) / np.arange(1, len(order) + 1)

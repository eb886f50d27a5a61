"""Fig. 12, local search, annealing and tabu search from one set of starts: F1 and F2 on the way, and where they end."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from planner_core.model import Int64Array
from planner_core.paper.search import SearchResult, SearchSettings
from planner_core.paper.search.thinning import one_per_cell

from .charts import COLOURS, chart, draw_nothing, draw_walls, label
from .fig11 import DENSE_WITHIN_M, triangles_near
from .figure import Bench, Outcome, Picture, Verdict, at_native_columns, by_share
from .levels import Level, open_level
from .searches import SEARCHES, best_so_far, gain, run_search, sees_nothing_m2


def run(bench: Bench) -> Outcome:
    """Search with all three methods and compare how far F2 comes down, how long agents move and how wide they roam."""
    level = open_level(bench, "basement", grid_step_m=bench.at(3.5, 0.5), heights_m=bench.at((1.3,), ()))
    starts_m = level.candidates(n_halvings=0).position_m
    nothing_m2 = sees_nothing_m2(level)
    settings = SearchSettings(seed=bench.seed, fixed_height=not bench.full)
    results: dict[str, SearchResult] = {}
    for done, name in enumerate(SEARCHES):
        bench.tell(done, 3, name)
        results[name], _ = run_search(bench, name, level, starts_m, settings)
    with chart(bench, "fig12.png", "F1 and F2 by iteration and at the end; kept positions", columns=3, rows=3) as (
        _,
        axes,
        drawn,
    ):
        walls = level.walls_m()
        for column, (name, result) in enumerate(results.items()):
            _draw_lines(axes[column], SEARCHES[name], result)
            draw_nothing(axes[column], nothing_m2)
            scatter = axes[3 + column]
            scatter.plot(result.history.f1[0], result.history.f2[0], ".", color="#aaaaaa", label="starts")
            scatter.plot(result.f1, result.f2, ".", color=COLOURS[0], label="best found")
            scatter.legend(fontsize=7, frameon=False)
            draw_nothing(scatter, nothing_m2)
            label(scatter, "", "F1, patches", "F2, m2")
            kept = _kept(result)
            draw_walls(axes[6 + column], walls)
            axes[6 + column].plot(*starts_m[:, :2].T, ".", color="#bbbbbb", markersize=3)
            axes[6 + column].plot(*result.position_m[kept, :2].T, "o", color=COLOURS[1], markersize=3)
            axes[6 + column].set_title(f"{len(kept)} kept, one a cell of 1.5 m", fontsize=9, loc="left")
    bench.tell(3, 3)
    return _outcome(level, results, nothing_m2, tuple(drawn))


#: Iterations of local search that are "early", as a share of those it may have.
EARLY = 0.5


def verdict(numbers: Mapping[str, Any]) -> Verdict:
    """Whether each sentence of the paper holds.

    Local search ends early; annealing comes lower than it; tabu search comes lowest in F2, and does not reach the most
    patches; and where it ends more triangles are near than where the others do, in fewer cells.
    """

    def judged() -> Verdict:
        down, f1, near = numbers["mean_gain_m2"], numbers["mean_f1"], numbers["median_triangles_near"]
        kept = numbers["kept"]
        return by_share(
            (
                numbers["mean_iterations"]["ls"] < EARLY * numbers["most_iterations"],
                down["ls"] < down["sa"],
                max(down["ls"], down["sa"]) < down["ts"],
                f1["ts"] <= max(f1["ls"], f1["sa"]),
                near["ts"] > max(near["ls"], near["sa"]) and kept["ts"] < min(kept["ls"], kept["sa"]),
            )
        )

    return at_native_columns(numbers, judged)


def _kept(result: SearchResult) -> Int64Array:
    return one_per_cell(result.position_m, result.f1, result.f2, cell_m=(1.5, 1.5, np.inf))


def _draw_lines(axes, title: str, result: SearchResult) -> None:  # type: ignore[no-untyped-def]
    valid = np.isfinite(result.history.f2[0])
    f2 = result.history.f2[:, valid].mean(axis=1)
    axes.plot(f2, color=COLOURS[1], label="F2, where agents are")
    axes.plot(best_so_far(result)[:, valid].mean(axis=1), "--", color=COLOURS[1], label="F2, best so far")
    label(axes, title, "iteration", "mean F2, m2")
    twin = axes.twinx()
    twin.plot(result.history.f1[:, valid].mean(axis=1), color=COLOURS[0], label="F1")
    twin.set_ylabel("mean F1, patches", fontsize=8, color=COLOURS[0])
    twin.tick_params(labelsize=8)
    twin.ticklabel_format(useOffset=False)
    axes.legend(fontsize=7, frameon=False, loc="center right")


def _outcome(level: Level, results: dict[str, SearchResult], nothing_m2: float, drawn: tuple[Picture, ...]) -> Outcome:
    numbers = _numbers(level, results, nothing_m2)
    return Outcome(found=_say(numbers), agrees=verdict(numbers), pictures=drawn, numbers=numbers)


def _numbers(level: Level, results: dict[str, SearchResult], nothing_m2: float) -> dict[str, Any]:
    start = next(iter(results.values())).history
    stood = np.isfinite(start.f2[0])

    def near(position_m: Any) -> float:
        return float(np.median(triangles_near(level.survey.scene, position_m)))

    return {
        "n_starts": int(stood.size),
        "columns": level.columns,
        "sees_nothing_m2": nothing_m2,
        "starts_worse_than_nothing": float((start.f2[0][stood] > nothing_m2).mean()),
        "most_iterations": SearchSettings().max_iterations,
        "mean_gain_m2": {name: float(np.mean(gain(result))) for name, result in results.items()},
        "start_f1": float(start.f1[0][stood].mean()),
        "mean_f1": {name: float(result.f1[result.found].mean()) for name, result in results.items()},
        "start_triangles_near": near(start.position_m[0][stood]),
        "median_triangles_near": {name: near(result.position_m[result.found]) for name, result in results.items()},
        "median_moved_m": {
            name: float(np.median(np.linalg.norm(result.position_m - result.history.position_m[0], axis=1)))
            for name, result in results.items()
        },
        "mean_iterations": {name: float(np.mean(result.history.n_iterations)) for name, result in results.items()},
        "kept": {name: int(_kept(result).size) for name, result in results.items()},
    }


def _say(numbers: Mapping[str, Any]) -> str:
    def each(key: str, digits: int = 0) -> str:
        ls, sa, ts = (f"{numbers[key][name]:.{digits}f}" for name in SEARCHES)
        return f"{ls}, {sa} and {ts}"

    return (
        f"in the order local search, annealing, tabu search, from {numbers['n_starts']} starts F2 came down by "
        f"{each('mean_gain_m2', 1)} m2 on average; {100 * numbers['starts_worse_than_nothing']:.0f} % of the starts "
        "score worse than a station that sees nothing. The searches moved "
        f"{each('mean_iterations')} of at most {numbers['most_iterations']} iterations on average, and the best "
        f"positions lie {each('median_moved_m', 2)} m from their starts (medians). They reach {each('mean_f1')} "
        f"patches on average, the starts {numbers['start_f1']:.0f}. Within {DENSE_WITHIN_M:g} m of the best positions "
        f"are {each('median_triangles_near')} triangles (medians), of the starts "
        f"{numbers['start_triangles_near']:.0f}: tabu search begins anew anywhere on the level. Of one position a "
        f"cell of 1.5 m, {each('kept')} are left."
    )

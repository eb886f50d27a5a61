"""Fig. 12, local search, annealing and tabu search from one set of starts: F1 and F2 on the way, and where they end."""

from __future__ import annotations

import numpy as np

from planner_core.model import Int64Array
from planner_core.paper.search import SearchResult, SearchSettings
from planner_core.paper.search.thinning import one_per_cell

from .charts import COLOURS, chart, draw_walls, label
from .figure import Bench, Outcome
from .levels import open_level
from .searches import SEARCHES, best_so_far, gain, run_search


def run(bench: Bench) -> Outcome:
    """Search with all three methods and compare how far F2 comes down, how long agents move and how wide they roam."""
    level = open_level(
        bench,
        "basement",
        n_azimuths=bench.at(450, None),
        grid_step_m=bench.at(1.5, 0.5),
        heights_m=bench.at((1.3,), ()),
    )
    starts_m = level.candidates().position_m
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
            scatter = axes[3 + column]
            scatter.plot(result.history.f1[0], result.history.f2[0], ".", color="#aaaaaa", label="starts")
            scatter.plot(result.f1, result.f2, ".", color=COLOURS[0], label="best found")
            scatter.legend(fontsize=7, frameon=False)
            label(scatter, "", "F1, patches", "F2, m2")
            kept = _kept(result)
            draw_walls(axes[6 + column], walls)
            axes[6 + column].plot(*starts_m[:, :2].T, ".", color="#bbbbbb", markersize=3)
            axes[6 + column].plot(*result.position_m[kept, :2].T, "o", color=COLOURS[1], markersize=3)
            axes[6 + column].set_title(f"{len(kept)} kept, one a cell of 1.5 m", fontsize=9, loc="left")
    bench.tell(3, 3)
    return _outcome(results, len(starts_m), tuple(drawn))


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


def _outcome(results: dict[str, SearchResult], n_starts: int, drawn: tuple) -> Outcome:  # type: ignore[type-arg]
    down = {name: float(np.mean(gain(result))) for name, result in results.items()}
    moved = {
        name: float(np.median(np.linalg.norm(result.position_m - result.history.position_m[0], axis=1)))
        for name, result in results.items()
    }
    ended = {name: float(np.mean(result.history.n_iterations)) for name, result in results.items()}
    kept = {name: int(_kept(result).size) for name, result in results.items()}
    crowds = kept["ts"] < min(kept["ls"], kept["sa"])
    ordered = down["ls"] < down["sa"] < down["ts"]
    early = ended["ls"] < min(ended["sa"], ended["ts"])
    return Outcome(
        found=(
            f"from {n_starts} starts, F2 came down by {down['ls']:.1f} m2 on average with local search, "
            f"{down['sa']:.1f} with simulated annealing and {down['ts']:.1f} with tabu search. Local search moved "
            f"{ended['ls']:.0f} of at most 60 iterations on average, annealing {ended['sa']:.0f} and tabu search "
            f"{ended['ts']:.0f}; the best positions lie {moved['ls']:.2f}, {moved['sa']:.2f} and {moved['ts']:.2f} m "
            "from their starts (medians): tabu search begins anew anywhere on the level, and crowds: of one position a "
            f"cell of 1.5 m, {kept['ls']}, {kept['sa']} and {kept['ts']} are left."
        ),
        agrees="yes" if ordered and early and crowds else "partly" if down["ls"] < down["ts"] and early else "no",
        pictures=drawn,
        numbers={
            "n_starts": n_starts,
            "mean_gain_m2": down,
            "median_moved_m": moved,
            "mean_iterations": ended,
            "kept": kept,
        },
    )

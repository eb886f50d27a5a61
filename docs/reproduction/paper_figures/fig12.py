"""Fig. 12, local search, annealing and tabu search from one set of starts: F1 and F2 on the way, and where they end.

All of it twice: guided by F2 of squared distances, as Eq. 2 is printed, and of plain ones, as the text has it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner_core.model import FloatArray, Int64Array
from planner_core.paper.search import SearchResult, SearchSettings
from planner_core.paper.search.improve import one_per_cell

from .charts import COLOURS, chart, draw_nothing, draw_walls, label
from .fig11 import DENSE_WITHIN_M, triangles_near
from .figure import Bench, Outcome, Picture, Verdict, at_native_columns, by_share
from .levels import Level, open_level
from .searches import SEARCHES, UNITS, best_so_far, decided, gain, run_search, sees_nothing


@dataclass(frozen=True)
class Guided:
    """The three searches by F2 of one distance. nothing : F2 of a station that sees nothing, in the same unit."""

    results: dict[str, SearchResult]
    nothing: float


def run(bench: Bench) -> Outcome:
    """Search with all three methods and compare how far F2 comes down, how long agents move and how wide they roam."""
    level = open_level(bench, "basement", grid_step_m=bench.at(3.5, 0.5), heights_m=bench.at((1.3,), ()))
    starts_m = level.candidates(n_halvings=0).position_m
    settings = SearchSettings(seed=bench.seed, fixed_height=not bench.full)
    found: dict[str, Guided] = {}
    for done, distance in enumerate(UNITS):
        results: dict[str, SearchResult] = {}
        for part, name in enumerate(SEARCHES):
            bench.tell(3 * done + part, 6, f"{SEARCHES[name]}, {distance}")
            results[name], _ = run_search(bench, name, level, starts_m, settings, distance=distance)
        found[distance] = Guided(results, sees_nothing(level, distance=distance))
    pictures = tuple(
        picture for distance, guided in found.items() for picture in _draw(bench, level, starts_m, guided, distance)
    )
    bench.tell(6, 6)
    numbers = _numbers(level, found)
    return Outcome(found=_say(numbers), agrees=verdict(numbers), pictures=pictures, numbers=numbers)


#: Iterations of local search that are "early", as a share of those it may have.
EARLY = 0.5


def verdict(numbers: Mapping[str, Any]) -> Verdict:
    """Whether each sentence of the paper holds with squared distances; see `findings`."""
    return at_native_columns(
        numbers, lambda: by_share(findings(numbers["squared"], numbers["most_iterations"]).values())
    )


def findings(of: Mapping[str, Any], most_iterations: int) -> dict[str, bool]:
    """The paper's sentences, and whether they hold of the searches by one distance.

    Local search ends early; annealing comes lower than it; tabu search comes lowest in F2, and does not reach the most
    patches; and where it ends more triangles are near than where the others do, in fewer cells.
    """
    down, f1, near, kept = of["mean_gain"], of["mean_f1"], of["median_triangles_near"], of["kept"]
    return {
        "that local search ends early": of["mean_iterations"]["ls"] < EARLY * most_iterations,
        "that annealing comes lower": down["ls"] < down["sa"],
        "that tabu search comes lowest": max(down["ls"], down["sa"]) < down["ts"],
        "that tabu search does not reach the most": f1["ts"] <= max(f1["ls"], f1["sa"]),
        "that tabu search crowds in dense places": near["ts"] > max(near["ls"], near["sa"])
        and kept["ts"] < min(kept["ls"], kept["sa"]),
    }


def _kept(result: SearchResult) -> Int64Array:
    return one_per_cell(result.position_m, result.f1, result.f2, cell_m=(1.5, 1.5, np.inf))


#: Pictures by the distance that guided the searches, and what to call it.
_FILES = {"squared": ("fig12.png", "squared"), "euclidean": ("fig12-plain.png", "plain")}


def _draw(bench: Bench, level: Level, starts_m: FloatArray, guided: Guided, distance: str) -> tuple[Picture, ...]:
    (file, called), unit = _FILES[distance], UNITS[distance]
    shows = f"F1 and F2 of {called} distances by iteration and at the end; kept positions"
    with chart(bench, file, shows, columns=3, rows=3) as (_, axes, drawn):
        walls = level.walls_m()
        for column, (name, result) in enumerate(guided.results.items()):
            _draw_lines(axes[column], f"{SEARCHES[name]}, {called} distances", result, unit)
            draw_nothing(axes[column], guided.nothing, unit=unit)
            if column == 0:  # the only one whose lines leave room for it
                axes[column].legend(fontsize=7, frameon=False, loc="center right")
            scatter = axes[3 + column]
            scatter.plot(result.history.f1[0], result.history.f2[0], ".", color="#aaaaaa", label="starts")
            scatter.plot(result.f1, result.f2, ".", color=COLOURS[0], label="best found")
            scatter.legend(fontsize=7, frameon=False)
            draw_nothing(scatter, guided.nothing, unit=unit)
            label(scatter, "", "F1, patches", f"F2, {unit}")
            kept = _kept(result)
            draw_walls(axes[6 + column], walls)
            axes[6 + column].plot(*starts_m[:, :2].T, ".", color="#bbbbbb", markersize=3)
            axes[6 + column].plot(*result.position_m[kept, :2].T, "o", color=COLOURS[1], markersize=3)
            axes[6 + column].set_title(f"{len(kept)} kept, one a cell of 1.5 m", fontsize=9, loc="left")
    return tuple(drawn)


def _draw_lines(axes, title: str, result: SearchResult, unit: str) -> None:  # type: ignore[no-untyped-def]
    valid = np.isfinite(result.history.f2[0])
    f2 = result.history.f2[:, valid].mean(axis=1)
    axes.plot(f2, color=COLOURS[1], label="F2, where agents are")
    axes.plot(best_so_far(result)[:, valid].mean(axis=1), "--", color=COLOURS[1], label="F2, best so far")
    label(axes, title, "iteration", f"mean F2, {unit}")
    twin = axes.twinx()
    twin.plot(result.history.f1[:, valid].mean(axis=1), color=COLOURS[0], label="F1")
    twin.set_ylabel("mean F1, patches", fontsize=8, color=COLOURS[0])
    twin.tick_params(labelsize=8)
    twin.ticklabel_format(useOffset=False)


def _numbers(level: Level, found: Mapping[str, Guided]) -> dict[str, Any]:
    start = next(iter(found["squared"].results.values())).history
    stood = np.isfinite(start.f2[0])
    return {
        "n_starts": int(stood.size),
        "columns": level.columns,
        "most_iterations": SearchSettings().max_iterations,
        "start_f1": float(start.f1[0][stood].mean()),
        "start_triangles_near": _near(level, start.position_m[0][stood]),
        **{distance: _numbers_of(level, guided) for distance, guided in found.items()},
    }


def _near(level: Level, position_m: FloatArray) -> float:
    return float(np.median(triangles_near(level.survey.scene, position_m)))


def _numbers_of(level: Level, guided: Guided) -> dict[str, Any]:
    """Of the searches by one distance; F2 in its unit."""
    results = guided.results
    f2 = next(iter(results.values())).history.f2[0]
    return {
        "sees_nothing": guided.nothing,
        "starts_worse_than_nothing": float((f2[np.isfinite(f2)] > guided.nothing).mean()),
        "mean_gain": {name: float(np.mean(gain(result))) for name, result in results.items()},
        "mean_f1": {name: float(result.f1[result.found].mean()) for name, result in results.items()},
        "median_triangles_near": {
            name: _near(level, result.position_m[result.found]) for name, result in results.items()
        },
        "median_moved_m": {
            name: float(np.median(np.linalg.norm(result.position_m - result.history.position_m[0], axis=1)))
            for name, result in results.items()
        },
        "mean_iterations": {name: float(np.mean(result.history.n_iterations)) for name, result in results.items()},
        "kept": {name: int(_kept(result).size) for name, result in results.items()},
    }


def _say(numbers: Mapping[str, Any]) -> str:
    squared, plain = ({"most": numbers["most_iterations"], **numbers[distance]} for distance in UNITS)
    of_squared, of_plain = (findings(numbers[distance], numbers["most_iterations"]) for distance in UNITS)
    same = by_share(of_squared.values()) == by_share(of_plain.values())
    return (
        f"in the order local search, annealing, tabu search, from {numbers['n_starts']} starts, which reach "
        f"{numbers['start_f1']:.0f} patches on average and have {numbers['start_triangles_near']:.0f} triangles within "
        f"{DENSE_WITHIN_M:g} m (median). With squared distances as Eq. 2 prints them, {_say_of(squared, 'm2')} Tabu "
        f"search begins anew anywhere on the level. With plain distances, as the text has it, {_say_of(plain, 'm')} "
        f"{decided(of_squared, of_plain, same_verdict=same)}"
    )


def _say_of(of: Mapping[str, Any], unit: str) -> str:
    def each(key: str, digits: int = 0) -> str:
        ls, sa, ts = (f"{of[key][name]:.{digits}f}" for name in SEARCHES)
        return f"{ls}, {sa} and {ts}"

    return (
        f"F2 came down by {each('mean_gain', 1)} {unit} on average; {100 * of['starts_worse_than_nothing']:.0f} % of "
        f"the starts score worse than a station that sees nothing. The searches moved {each('mean_iterations')} of at "
        f"most {of['most']} iterations on average, and the best positions lie {each('median_moved_m', 2)} m from their "
        f"starts (medians). They reach {each('mean_f1')} patches on average, and within {DENSE_WITHIN_M:g} m of them "
        f"are {each('median_triangles_near')} triangles (medians). Of one position a cell of 1.5 m, {each('kept')} are "
        "left."
    )

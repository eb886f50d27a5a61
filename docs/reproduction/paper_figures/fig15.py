"""Fig. 15, the three spatial searches plain and memoised: what each takes a starting position, and all together."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from planner_core.model import FloatArray
from planner_core.paper.search import SearchResult, SearchSettings, search

from .charts import COLOURS, chart, label
from .figure import Bench, Outcome, Picture, Verdict, at_native_columns, by_share
from .levels import Level, open_level
from .searches import SEARCHES, fitness_of

#: Plain over memoised from which on a search is notably faster.
NOTABLE = 1.5
#: Directions that stay on the lattice, and the default ones, which memory rounds to it.
_NEIGHBOURHOODS = {"cube": "on the lattice", "sphere": "rounded to it"}
_HEIGHT_M = 1.3
#: Runs of each version, by turns, where directions stay on the lattice; with the others, one.
_REPEATS = 1


@dataclass(frozen=True)
class Pair:
    """Plain and memoised runs of a search, side by side.

    plain_s, memoised_s : processor seconds by repeat. plain_clock_s, memoised_clock_s : seconds of the clock.
    """

    plain: SearchResult
    memoised: SearchResult
    plain_s: FloatArray
    memoised_s: FloatArray
    plain_clock_s: FloatArray
    memoised_clock_s: FloatArray

    @property
    def ratio(self) -> float:
        """Processor time plain over memoised, the median of the repeats."""
        return float(np.median(self.plain_s / self.memoised_s))

    @property
    def same(self) -> bool:
        """Whether all agents went the same way, position by position."""
        ours, theirs = self.plain.history, self.memoised.history
        return bool(
            np.array_equal(ours.position_m, theirs.position_m)
            and np.array_equal(ours.f1, theirs.f1)
            and np.array_equal(ours.f2, theirs.f2)
        )

    @property
    def worse_m2(self) -> float:
        """How much more F2 the memoised search ends with, on average of the agents that found something in both."""
        both = self.plain.found & self.memoised.found
        return float(np.mean(self.memoised.f2[both] - self.plain.f2[both]))


def run(bench: Bench) -> Outcome:
    """Run every method plain and memoised from the same starts, on the lattice and rounded to it."""
    level = open_level(bench, "basement", grid_step_m=0.5, heights_m=bench.at((_HEIGHT_M,), ()))
    starts_m = _block(level.candidates(n_halvings=0).position_m, bench.at(4, None))
    pairs: dict[str, dict[str, Pair]] = {}
    for kind in _NEIGHBOURHOODS:
        settings = SearchSettings(seed=bench.seed, neighbourhood=kind, fixed_height=not bench.full)
        pairs[kind] = {}
        for name in SEARCHES:
            bench.tell(len(SEARCHES) * (len(pairs) - 1) + len(pairs[kind]), 6, f"{SEARCHES[name]}, {kind}")
            pairs[kind][name] = _pair(level, starts_m, name, settings, repeats=_REPEATS if kind == "cube" else 1)
    pictures = _draw(bench, pairs)
    bench.tell(6, 6)
    n_cells = _cells(level, fixed_height=not bench.full)
    numbers = {
        "n_starts": len(starts_m),
        "columns": level.columns,
        "cells_of_level": n_cells,
        **{kind: _numbers(by_name) for kind, by_name in pairs.items()},
    }
    return Outcome(
        found=_say(pairs, len(starts_m), n_cells=n_cells), agrees=verdict(numbers), pictures=pictures, numbers=numbers
    )


def verdict(numbers: Mapping[str, Any]) -> Verdict:
    """`agreement` of a run at native columns, where directions stay on the lattice."""

    def judged() -> Verdict:
        square = numbers["cube"]
        ratio = {name: square[name]["plain_over_memoised"] for name in SEARCHES}
        return agreement(ratio, square["all_plain_over_memoised"])

    return at_native_columns(numbers, judged)


def agreement(ratio: Mapping[str, float], in_all: float) -> Verdict:
    """Whether ratios of times, plain over memoised by search and of all together, bear the paper out.

    Memory makes all together notably faster, and each of annealing and tabu search; local search, which is soon stuck
    and does not begin anew, gains less than both.
    """
    return by_share(
        (
            in_all >= NOTABLE,
            min(ratio["sa"], ratio["ts"]) >= NOTABLE,
            ratio["ls"] < min(ratio["sa"], ratio["ts"]),
        )
    )


def _block(position_m: FloatArray, n: int | None) -> FloatArray:
    """Return the `n` positions that are nearest to their median: a piece of the grid, as dense as the whole."""
    if n is None:
        return position_m
    away_m = np.linalg.norm(position_m - np.median(position_m, axis=0), axis=1)
    return position_m[np.sort(np.argsort(away_m, kind="stable")[:n])]


def _cells(level: Level, *, fixed_height: bool) -> int:
    """Lattice cells over the level's bounds, in the layers that agents can go to."""
    bounds_m = fitness_of(level).bounds_m
    n = np.floor((bounds_m[1] - bounds_m[0]) / SearchSettings().step_m + 1e-9).astype(np.int64) + 1
    return int(n[:2].prod() if fixed_height else n.prod())


def _pair(level: Level, starts_m: FloatArray, name: str, settings: SearchSettings, *, repeats: int) -> Pair:
    results: dict[bool, SearchResult] = {}
    seconds: dict[bool, list[tuple[float, float]]] = {False: [], True: []}
    for _ in range(repeats):
        for memoised in (False, True):
            fitness = fitness_of(level)
            fitness.evaluate(starts_m[:1])  # what is built once is no part of the search
            cpu_s, clock_s = time.process_time(), time.perf_counter()
            results[memoised] = search(
                name, starts_m, fitness, replace(settings, memoised=memoised), bounds_m=fitness.bounds_m
            )
            seconds[memoised].append((time.process_time() - cpu_s, time.perf_counter() - clock_s))
    plain, recalled = np.array(seconds[False]), np.array(seconds[True])
    return Pair(results[False], results[True], plain[:, 0], recalled[:, 0], plain[:, 1], recalled[:, 1])


def _sum_ratio(by_name: dict[str, Pair]) -> float:
    """Processor time of all searches plain over that of all memoised, the median of the repeats."""
    plain = np.sum([pair.plain_s for pair in by_name.values()], axis=0)
    return float(np.median(plain / np.sum([pair.memoised_s for pair in by_name.values()], axis=0)))


def _numbers(by_name: dict[str, Pair]) -> dict[str, Any]:
    facts: dict[str, Any] = {
        name: {
            "plain_over_memoised": pair.ratio,
            "plain_over_memoised_clock": float(np.median(pair.plain_clock_s / pair.memoised_clock_s)),
            "evaluations_plain": pair.plain.n_evaluations,
            "evaluations_memoised": pair.memoised.n_evaluations,
            "hits": pair.memoised.n_hits,
            "mean_iterations": float(pair.memoised.history.n_iterations.mean()),
            "same_way": pair.same,
            "memoised_ends_higher_by_m2": pair.worse_m2,
        }
        for name, pair in by_name.items()
    }
    return {**facts, "all_plain_over_memoised": _sum_ratio(by_name)}


def _say(pairs: dict[str, dict[str, Pair]], n_starts: int, *, n_cells: int) -> str:
    square, circle = pairs["cube"], pairs["sphere"]
    ratio = {name: pair.ratio for name, pair in square.items()}
    rounded = {name: pair.ratio for name, pair in circle.items()}
    same = all(pair.same for pair in square.values())
    judged = "; ".join(
        f"{SEARCHES[name]} {pair.plain.n_evaluations} positions plain, {pair.memoised.n_evaluations} memoised and "
        f"{pair.memoised.n_hits} remembered, in {pair.memoised.history.n_iterations.mean():.0f} iterations on average"
        for name, pair in square.items()
    )
    clock = {name: float(np.median(pair.plain_clock_s / pair.memoised_clock_s)) for name, pair in square.items()}
    in_all = sum(pair.plain.n_evaluations for pair in square.values())
    restarts = int(np.count_nonzero(square["ts"].memoised.history.restarted))
    repeats = square["ls"].plain_s.size
    times = f"medians of {repeats} runs, plain and memoised by turns" if repeats > 1 else "one run each"
    return (
        f"from {n_starts} starts of a grid of 0.5 m in the basement, with directions that stay on the lattice, plain "
        f"takes {ratio['ls']:.1f} times the processor time of memoised for local search, {ratio['sa']:.1f} for "
        f"annealing, {ratio['ts']:.1f} for tabu search and {_sum_ratio(square):.1f} for all together (by the clock "
        f"{clock['ls']:.1f}, {clock['sa']:.1f} and {clock['ts']:.1f}; {times}). Judged were: {judged}; tabu search "
        f"began anew {restarts} times. Both versions went the same way, bit for bit: {'yes' if same else 'NO'}. With "
        f"16 even directions, which memory rounds to the lattice, the ratios are {rounded['ls']:.1f}, "
        f"{rounded['sa']:.1f} and {rounded['ts']:.1f} (one run each), but the ways are others: memoised ends differ by "
        f"{circle['ls'].worse_m2:+.1f}, {circle['sa'].worse_m2:+.1f} and {circle['ts'].worse_m2:+.1f} m2 of F2. Ours "
        f"judges a cell when it is first looked at, and the times hold that; all {n_cells} cells over the level, which "
        f"the paper judges in advance, are {n_cells / in_all:.1f} times the positions that all plain searches from "
        "these starts judge."
    )


def _draw(bench: Bench, pairs: dict[str, dict[str, Pair]]) -> tuple[Picture, ...]:
    versions = [
        (f"{what}, {version}", COLOURS[tone], hatch, [getattr(pair, f"{version}_s") for pair in pairs[kind].values()])
        for kind, what, tone in (("cube", "on the lattice", 0), ("sphere", "even directions", 1))
        for version, hatch in (("plain", ""), ("memoised", "////"))
    ]
    median = np.array([[float(np.median(one)) for one in times] for *_, times in versions])
    shows = "Time of the searches a starting position, plain and memoised, and of all three together"
    with chart(bench, "fig15.png", shows, columns=2, size_in=(4.6, 3.4)) as (_, (left, right), drawn):
        for k, (name, colour, hatch, _) in enumerate(versions):
            style = {"color": colour if not hatch else "white", "edgecolor": colour, "hatch": hatch, "width": 0.2}
            at = np.arange(len(SEARCHES)) + 0.2 * (k - 1.5)
            bars = left.bar(at, median[k] / median.max(), label=name, **style)
            left.bar_label(bars, fmt="%.2f", fontsize=6, padding=1)
            total = median[k].sum() / median.sum(axis=1).max()
            right.bar_label(right.bar([k], [total], **{**style, "width": 0.6}), fmt="%.2f", fontsize=8, padding=1)
        left.set_xticks(range(len(SEARCHES)), SEARCHES.values())
        left.legend(fontsize=7, frameon=False, loc="upper left")
        right.set_xticks(range(len(versions)), [name.replace(", ", "\n") for name, *_ in versions], fontsize=7)
        label(left, "A starting position", "", "processor time, the longest is 1")
        label(right, "All three searches", "", "processor time, the longest is 1")
    return tuple(drawn)

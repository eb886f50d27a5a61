"""Fig. 16, genetic selection on the device and on the host: the same trajectory, and how long each takes.

The paper compares a GPU with a processor, transfers between them included. Where the OpenCL device is the processor
itself, what is measured is one loop of kernels against NumPy and threads, without any transfer: another question.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from planner_core.device import open_device
from planner_core.paper.genetic import GeneticSettings, select_genetic
from planner_core.select.problem import Constraint, CoverProblem, cover_problem

from .charts import COLOURS, chart, label
from .figure import Bench, Outcome, Verdict, by_share
from .levels import open_level

#: Host over device from which on the device is significantly faster.
NOTABLE = 1.5
#: Times that both are run, one after the other; the median counts.
_REPEATS = 3


def run(bench: Bench) -> Outcome:
    """Time equal evolutions of several population sizes on both engines, side by side."""
    problem = _problem(bench)
    populations = bench.at((100, 250, 500), (100, 250, 500, 1000, 2000))
    iterations = bench.at(150, 1000)
    base = GeneticSettings(seed=bench.seed, max_iterations=iterations, patience=iterations, expected_active=60.0)
    where = select_genetic(problem, replace(base, max_iterations=0))
    if where.engine == "host":
        return _host_alone(bench, problem, base, populations)
    ratios: list[float] = []
    shares: list[tuple[float, float]] = []
    same = True
    for done, population in enumerate(populations):
        bench.tell(done, len(populations), f"population {population}")
        settings = replace(base, population=population, n_parents=population // 2)
        device_s, host_s, equal = _times(problem, settings)
        same &= equal
        ratios.append(float(np.median(np.array(host_s) / np.array(device_s))))
        shares.append((float(np.median(device_s)), float(np.median(host_s))))
    bench.tell(len(populations), len(populations))
    slowest = max(host for _, host in shares)
    with chart(bench, "fig16.png", "Time of an evolution by population, device and host", columns=2) as (
        _,
        axes,
        drawn,
    ):
        axes[0].plot(
            populations, [host / slowest for _, host in shares], "o-", color=COLOURS[1], label="host, all cores"
        )
        axes[0].plot(populations, [device / slowest for device, _ in shares], "o-", color=COLOURS[0], label="device")
        axes[0].legend(fontsize=8, frameon=False)
        label(axes[0], f"{iterations} iterations", "population", "time, the longest is 1")
        axes[1].plot(populations, ratios, "o-", color=COLOURS[2])
        axes[1].set_ylim(bottom=0)
        label(axes[1], "Host over device", "population", "ratio of times")
    kind = open_device().kind
    numbers = {
        "device_kind": kind,
        "populations": list(populations),
        "host_over_device": ratios,
        "same_trajectory": same,
    }
    what = (
        "The device was a GPU, and times hold all transfers"
        if kind == "gpu"
        else "The device was the processor itself: this is one loop of OpenCL kernels against NumPy and threads on the "
        "same cores, with no transfer to spare, and says nothing about GPUs"
    )
    return Outcome(
        found=(
            f"with {problem.n_candidates} candidates and {problem.n_rows} merged rows of patches, the whole loop on "
            f"the device ({where.device}) takes 1 / {min(ratios):.1f} to 1 / {max(ratios):.1f} of the time of the host "
            f"version, which runs the same operators with the same random numbers on all cores (populations of "
            f"{populations[0]} to {populations[-1]}, medians of {_REPEATS}). {what}. Both went the same way, bit for "
            f"bit: {'yes' if same else 'NO'}."
        ),
        agrees=verdict(numbers),
        pictures=tuple(drawn),
        numbers=numbers,
    )


def verdict(numbers: Mapping[str, Any]) -> Verdict:
    """Whether a GPU is notably faster for all populations; `partly` for some. Not tested on any other device."""
    if numbers.get("device_kind") != "gpu":
        return "not tested"
    return by_share(ratio > NOTABLE for ratio in numbers["host_over_device"])


def _host_alone(bench: Bench, problem: CoverProblem, base: GeneticSettings, populations: tuple[int, ...]) -> Outcome:
    """Time the host where there is no device to compare it with."""
    times = []
    for done, population in enumerate(populations):
        bench.tell(done, len(populations), f"population {population}")
        settings = replace(base, population=population, n_parents=population // 2)
        seconds = []
        for _ in range(_REPEATS):
            start = time.perf_counter()
            select_genetic(problem, settings, engine="host")
            seconds.append(time.perf_counter() - start)
        times.append(float(np.median(seconds)))
    bench.tell(len(populations), len(populations))
    shares = [one / max(times) for one in times]
    with chart(bench, "fig16.png", "Time of an evolution by population, host alone", columns=1) as (_, axes, drawn):
        axes[0].plot(populations, shares, "o-", color=COLOURS[1], label="host, all cores")
        label(axes[0], f"{base.max_iterations} iterations", "population", "time, the longest is 1")
    return Outcome(
        found=(
            f"no OpenCL device is usable on this machine: there was nothing to compare the host version "
            f"with. With {problem.n_candidates} candidates and {problem.n_rows} merged rows of patches, a population "
            f"of {populations[0]} took it {shares[0]:.2f} of the time of {populations[-1]} (medians of {_REPEATS})."
        ),
        agrees="not tested",
        pictures=tuple(drawn),
        numbers={"device_kind": "none", "populations": list(populations), "host_time_share": shares},
    )


def _problem(bench: Bench) -> CoverProblem:
    level = open_level(bench, "basement", grid_step_m=bench.at(1.0, 0.5))
    visibility = level.engine.visible_patches(level.survey.template, level.candidates().position_m)
    area_m2 = level.survey.patches.area_m2
    seen = np.zeros(area_m2.size, dtype=bool)
    seen[visibility.patch] = True
    return cover_problem(visibility, area_m2, (Constraint(seen, 0.95),))


def _times(problem: CoverProblem, settings: GeneticSettings) -> tuple[list[float], list[float], bool]:
    """Seconds on the device and on the host, run by run, and whether both went the same way."""
    select_genetic(problem, replace(settings, max_iterations=1))  # builds the kernels
    device_s: list[float] = []
    host_s: list[float] = []
    same = True
    for _ in range(_REPEATS):
        ends = []
        for engine, seconds in (("device", device_s), ("host", host_s)):
            start = time.perf_counter()
            ends.append(select_genetic(problem, settings, engine=engine))
            seconds.append(time.perf_counter() - start)
        same &= bool(np.array_equal(ends[0].key_by_iteration, ends[1].key_by_iteration))
    return device_s, host_s, same

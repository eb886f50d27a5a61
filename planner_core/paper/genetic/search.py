"""Genetic selection: from coverage rows to a set of stations, by a population that evolves.

Input `CoverProblem` and `GeneticSettings`, output a `GeneticResult`. The whole loop runs on an
OpenCL device, or on the host with the same operators and random numbers: the results are the same, bit for bit.

References
----------
López et al. 2023, section 3.6; docs/method/genetic-selection.md gives our deviations and their reasons.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner_core.device import Device, open_device
from planner_core.errors import DeviceError, RequirementError
from planner_core.model import BoolArray, Int32Array, Int64Array
from planner_core.model.methods import GeneticSettings
from planner_core.paper.genetic.host import evolve_on_host
from planner_core.paper.genetic.objective import check_problem, objective_of
from planner_core.paper.genetic.on_device import evolve_on_device
from planner_core.progress import Progress, silent
from planner_core.select.problem import CoverProblem

ENGINES = ("auto", "device", "host")


@dataclass(frozen=True)
class GeneticResult:
    """The best set of stations and how it was come by.

    chosen : (K,) int32, candidates, sorted. key_by_iteration, covered_by_iteration, active_by_iteration :
    (iterations + 1,) int64, of the best set so far, the start included: its key (`paper.genetic.objective`), the
    ticks that it covers, its stations.
    """

    chosen: Int32Array
    key_by_iteration: Int64Array
    covered_by_iteration: Int64Array
    active_by_iteration: Int64Array
    n_evaluations: int
    why_stopped: str
    """`no improvement` or `iterations`."""
    engine: str
    """`device` or `host`."""
    device: str
    """What it ran on, for the record."""

    @property
    def iterations(self) -> int:
        """Generations bred."""
        return int(self.key_by_iteration.size - 1)


def select_genetic(
    problem: CoverProblem,
    settings: GeneticSettings = GeneticSettings(),  # noqa: B008 (frozen)
    *,
    engine: str = "auto",
    device: Device | str | None = None,
    given: Sequence[NDArray[np.integer]] = (),
    progress: Progress = silent,
) -> GeneticResult:
    """Evolve sets of stations and return the best.

    Parameters
    ----------
    engine
        `device`: the whole loop on an OpenCL device; `host`: NumPy on all cores, slower, to the same result; `auto`:
        the device where one is given or usable, else the host.
    device
        An open device or a name for `planner_core.device.open_device`; not for `host`.
    given
        Sets of candidates that the first population holds besides random ones, e.g. a greedy selection.

    Raises
    ------
    RequirementError
        An unknown engine, no candidates, more given sets than individuals, or candidates that do not exist.
    DeviceError
        No device, where one is required; or it fails.
    """
    if engine not in ENGINES:
        raise RequirementError(f"genetic engine: got {engine!r}, expected one of {', '.join(ENGINES)}")
    check_problem(problem)
    objective = objective_of(problem, settings)
    first = _given(given, settings, objective.n_candidates)
    opened = None if engine == "host" else _opened(device, needed=engine == "device" or device is not None)
    if opened is None:
        label = "NumPy"
        trajectory = evolve_on_host(problem, settings, objective, first, progress=progress)
    else:
        label = opened.label
        trajectory = evolve_on_device(problem, settings, objective, first, device=opened, progress=progress)
    iterations = len(trajectory.history) - 1
    key, covered, active = trajectory.history.T.copy()
    return GeneticResult(
        chosen=np.flatnonzero(trajectory.best).astype(np.int32),
        key_by_iteration=key,
        covered_by_iteration=covered,
        active_by_iteration=active,
        n_evaluations=settings.population + iterations * settings.n_offspring,
        why_stopped=trajectory.why_stopped,
        engine="host" if opened is None else "device",
        device=label,
    )


def _opened(device: Device | str | None, *, needed: bool) -> Device | None:
    """Return the device, opened; None where there is none and none is needed."""
    if isinstance(device, Device):
        return device
    try:
        return open_device(device)
    except DeviceError:
        if needed:
            raise
        return None


def _given(given: Sequence[NDArray[np.integer]], settings: GeneticSettings, n_candidates: int) -> BoolArray:
    """(n, N) bool."""
    if len(given) > settings.population:
        raise RequirementError(
            f"genetic selection: got {len(given)} given sets for a population of {settings.population}, expected no "
            "more than individuals; give fewer or take a larger population"
        )
    genes = np.zeros((len(given), n_candidates), dtype=bool)
    for row, candidates in zip(genes, given, strict=True):
        at = np.asarray(candidates, dtype=np.int64)
        if at.size and (at.min() < 0 or at.max() >= n_candidates):
            raise RequirementError(
                f"genetic selection: got candidate {int(at.min() if at.min() < 0 else at.max())} in a given set, "
                f"expected 0 to {n_candidates - 1}"
            )
        row[at] = True
    return genes

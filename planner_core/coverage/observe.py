"""Looking around: how positions see patches, by beams or by samples, in batches that memory holds.

A `Survey`, a scan mode, an open engine, positions (N, 3) in the local frame, metres -> `Observations`, without noise.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from planner_core.coverage.counted import observed_enough
from planner_core.coverage.ground_sides import GroundSides
from planner_core.coverage.levels import Observations, observations_of_returns, observations_of_views
from planner_core.engine.patch_mode import PatchMode, scan_mode_of
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import FloatArray, ScanBy, Survey
from planner_core.progress import Progress, ProgressEvent, silent

#: Observations a batch should have: some 500 bytes each while a batch is worked on.
_BATCH_OBSERVATIONS = 2**20
#: Positions of the first batch, when nobody knows yet how many patches one sees, and of any.
_FIRST_BATCH, _MOST_BATCH = 8, 64


def looks_in_batches(
    survey: Survey, scan_mode: ScanBy, engine: ScanEngine, positions_m: FloatArray, *, progress: Progress = silent
) -> Iterator[Observations]:
    """How each of positions sees each patch, piece by piece: of the first few positions, the next few, and so on.

    How positions are split depends on how much they see, and no figure depends on it.

    Parameters
    ----------
    scan_mode
        As in `PlanSettings`. The rows are those of `planner_core.coverage.survey.visible_from` in that mode; once the
        survey knows how much of each patch counts, those of which enough is seen, see `coverage.counted`.

    Raises
    ------
    RequirementError, DeviceError
        See `ScanEngine.patch_returns`, `PatchMode.see`.
    """
    look = observing(survey, scan_mode, engine)
    positions = np.asarray(positions_m, dtype=np.float64)
    first, size = 0, _FIRST_BATCH
    while first < len(positions):
        end = min(first + size, len(positions))
        observations = look(positions[first:end], _counted_from(progress, first, len(positions)))
        yield observations
        size = min(max(_BATCH_OBSERVATIONS * (end - first) // max(observations.patch.size, 1), 1), _MOST_BATCH)
        first = end


def observing(survey: Survey, scan_mode: ScanBy, engine: ScanEngine) -> Callable[[FloatArray, Progress], Observations]:
    """Turn positions into observations; patch mode sends its groups to the device here."""
    template, only, sides = survey.template, survey.looked_at, GroundSides(survey)

    def from_above(at: FloatArray, found: Observations) -> Observations:
        counts = sides.counts(at, found.starts, found.patch)
        return found if counts.all() else found.take(counts)

    if scan_mode_of(scan_mode, template) == ScanBy.BEAMS:
        area_m2 = survey.patches.area_m2
        return lambda at, progress: from_above(
            at,
            observations_of_returns(
                engine.patch_returns(template, at, moments=True, progress=progress), area_m2, only=only
            ),
        )
    mode, counted = PatchMode(engine, survey.scene, survey.patches, only=only), survey.patches.counted
    return lambda at, progress: observed_enough(
        from_above(at, observations_of_views(mode.see(template, at, progress=progress))), counted
    )


def _counted_from(progress: Progress, first: int, total: int) -> Progress:
    """Progress of a batch that starts at position `first`, as progress of all."""
    return lambda event: progress(ProgressEvent(event.stage, first + event.done, total, event.note))

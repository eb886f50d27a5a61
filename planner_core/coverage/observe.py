"""How positions see patches: near or far, straight or askew, how densely, with what noise. The input of all limits.

A `Survey`, an open engine, positions (N, 3) in the local frame, metres -> `Observations`, by beams or by samples, in
batches that memory holds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from planner_core.coverage.ground_sides import GroundSides
from planner_core.coverage.levels import Observations, observations_of_returns, observations_of_views, with_noise
from planner_core.coverage.visibility_threshold import observed_enough
from planner_core.engine.patch_mode import PatchMode
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import FloatArray, ScanBy, Survey
from planner_core.progress import Progress, ProgressEvent, silent

#: Observations a batch should have: some 500 bytes each while a batch is worked on.
_BATCH_OBSERVATIONS = 2**20
#: Positions of the first batch, when nobody knows yet how many patches one sees, and of any.
_FIRST_BATCH, _MOST_BATCH = 8, 64


def observations_in_batches(
    survey: Survey, engine: ScanEngine, positions_m: FloatArray, *, noise: bool = False, progress: Progress = silent
) -> Iterator[Observations]:
    """How each of positions sees each patch, piece by piece: of the first few positions, the next few, and so on.

    How positions are split depends on how much they see, and no figure depends on it. The rows are those of
    `planner_core.coverage.survey.visible_from`; once the survey knows how much of each patch counts, those of which
    enough is seen, see `coverage.visibility_threshold`. 20 bytes per observation, 24 with noise.

    Raises
    ------
    RequirementError, DeviceError
        See `ScanEngine.patch_returns`, `PatchMode.see`, `with_noise`.
    """
    look = observing(survey, engine, noise=noise)
    positions = np.asarray(positions_m, dtype=np.float64)
    first, size = 0, _FIRST_BATCH
    while first < len(positions):
        end = min(first + size, len(positions))
        observations = look(positions[first:end], _counted_from(progress, first, len(positions)))
        yield observations
        size = min(max(_BATCH_OBSERVATIONS * (end - first) // max(observations.patch.size, 1), 1), _MOST_BATCH)
        first = end


def observing(
    survey: Survey, engine: ScanEngine, *, noise: bool = False
) -> Callable[[FloatArray, Progress], Observations]:
    """Turn positions into observations; patch mode sends its groups to the device here."""
    sides = GroundSides(survey)
    by_mode = _by_beams(survey, engine) if survey.scan_mode == ScanBy.BEAMS else _by_samples(survey, engine)

    def look(at: FloatArray, progress: Progress) -> Observations:
        found = by_mode(at, progress)
        counts = sides.counts(at, found.starts, found.patch)
        found = observed_enough(found if counts.all() else found.take(counts), survey.patches.countable_share)
        return with_noise(found, survey.scanner, reflectivity=survey.reflectivity) if noise else found

    return look


def _by_beams(survey: Survey, engine: ScanEngine) -> Callable[[FloatArray, Progress], Observations]:
    template, area_m2, only = survey.template, survey.patches.area_m2, survey.patches_observed
    return lambda at, progress: observations_of_returns(
        engine.patch_returns(template, at, moments=True, progress=progress), area_m2, only=only
    )


def _by_samples(survey: Survey, engine: ScanEngine) -> Callable[[FloatArray, Progress], Observations]:
    mode = PatchMode(engine, survey.scene, survey.patches, only=survey.patches_observed)
    return lambda at, progress: observations_of_views(mode.see(survey.template, at, progress=progress))


def _counted_from(progress: Progress, first: int, total: int) -> Progress:
    """Progress of a batch that starts at position `first`, as progress of all."""
    return lambda event: progress(ProgressEvent(event.stage, first + event.done, total, event.note))

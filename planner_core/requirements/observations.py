"""How positions see patches: near or far, straight or askew, how densely, with what noise. The input of all limits.

A `Survey`, settings, an open engine, positions (N, 3) in the local frame, metres -> `Observations` in batches.
"""

from __future__ import annotations

from collections.abc import Iterator

from planner_core.coverage.levels import Observations, with_noise
from planner_core.coverage.observe import looks_in_batches
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import FloatArray, PlanSettings, Survey
from planner_core.progress import Progress, silent


def observations_in_batches(
    survey: Survey, settings: PlanSettings, engine: ScanEngine, positions_m: FloatArray, *, progress: Progress = silent
) -> Iterator[Observations]:
    """How each of positions (N, 3), local frame, sees each patch: by beams or by samples, as `settings.scan_mode` says.

    Piece by piece, of the first few positions, the next few, and so on: how positions are split depends on how much
    they see, and no figure depends on it. The rows are those of `looks_in_batches`; noise is there where
    the requirements ask for it. 20 bytes per observation, 24 with noise.

    Raises
    ------
    RequirementError, DeviceError
        See `ScanEngine.patch_returns`, `PatchMode.see`.
    """
    noisy = settings.requirements.limits_noise
    for observations in looks_in_batches(survey, settings.scan_mode, engine, positions_m, progress=progress):
        if noisy:
            yield with_noise(observations, settings.scanner, reflectivity=settings.requirements.reflectivity)
        else:
            yield observations

"""How positions see patches: near or far, straight or askew, how densely, with what noise. The input of all limits.

A `Survey`, settings, an open engine, positions (N, 3) in the local frame, metres -> `Sights`, whole or in batches.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from planner_core.coverage.levels import Sights, with_noise
from planner_core.coverage.looking import looks_in_batches
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import FloatArray, PlanSettings, Survey
from planner_core.progress import Progress, silent


def sights_from(
    survey: Survey, settings: PlanSettings, engine: ScanEngine, positions_m: FloatArray, *, progress: Progress = silent
) -> Sights:
    """How each of positions (N, 3), local frame, sees each patch: by beams or by samples, as `settings.scan_mode` says.

    The rows are those of `coverage.survey.visible_from`; noise is there where the requirements ask for it. 20 bytes
    a sight, 24 with noise: where thousands of positions see many patches, `sights_in_batches` needs less.

    Raises
    ------
    RequirementError, DeviceError
        See `ScanEngine.patch_returns`, `PatchMode.see`.
    """
    batches = list(sights_in_batches(survey, settings, engine, positions_m, progress=progress))
    sizes = np.concatenate([np.zeros(1, dtype=np.int64), *(np.diff(batch.starts) for batch in batches)])
    none = np.zeros(0, dtype=np.float32)
    noise = [batch.noise_m for batch in batches if batch.noise_m is not None]
    return Sights(
        starts=np.cumsum(sizes, dtype=np.int64),
        patch=np.concatenate([none.astype(np.int32), *(batch.patch for batch in batches)]),
        n_patches=survey.patches.n_patches,
        spacing_m=np.concatenate([none, *(batch.spacing_m for batch in batches)]),
        range_m=np.concatenate([none, *(batch.range_m for batch in batches)]),
        incidence_rad=np.concatenate([none, *(batch.incidence_rad for batch in batches)]),
        noise_m=np.concatenate([none, *noise]) if settings.requirements.limits_noise else None,
    )


def sights_in_batches(
    survey: Survey, settings: PlanSettings, engine: ScanEngine, positions_m: FloatArray, *, progress: Progress = silent
) -> Iterator[Sights]:
    """Sights of `sights_from` piece by piece: of the first few positions, the next few, and so on.

    How positions are split depends on how much they see, and no figure depends on it.
    """
    noisy = settings.requirements.limits_noise
    for sights in looks_in_batches(survey, settings.scan_mode, engine, positions_m, progress=progress):
        if noisy:
            yield with_noise(sights, settings.scanner, reflectivity=settings.requirements.reflectivity)
        else:
            yield sights

"""How positions see patches: near or far, straight or askew, how densely, with what noise. The input of all limits.

A `Survey`, settings, an open engine, positions (N, 3) in the local frame, metres -> `Sights`, whole or in batches.
"""

from __future__ import annotations

from collections.abc import Iterator

from planner_core.coverage.levels import Sights, with_noise
from planner_core.coverage.looking import looks_in_batches
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import RequirementError
from planner_core.model import FloatArray, PlanSettings, Requirements, Survey
from planner_core.progress import Progress, silent


def check_noise(settings: PlanSettings) -> None:
    """Refuse limits on noise where the scanner's figures know none.

    Raises
    ------
    RequirementError
        Noise is asked for and the scanner has no table of range noise.
    """
    if asks_for_noise(settings.requirements) and not settings.scanner.range_noise:
        raise RequirementError(
            f"noise: got a limit with scanner {settings.scanner.name}, expected one with a table of range noise; "
            "give a scanner file of your own with range_noise, or ask for range and incidence instead"
        )


def asks_for_noise(requirements: Requirements) -> bool:
    """Whether anything asked of all or of a part limits noise."""
    return any(asked.noise_m is not None for asked in (requirements.asked, *(p.asked for p in requirements.parts)))


def sights_in_batches(
    survey: Survey, settings: PlanSettings, engine: ScanEngine, positions_m: FloatArray, *, progress: Progress = silent
) -> Iterator[Sights]:
    """How each of positions (N, 3), local frame, sees each patch: by beams or by samples, as `settings.scan_mode` says.

    Piece by piece, of the first few positions, the next few, and so on: how positions are split depends on how much
    they see, and no figure depends on it. The rows are those of `coverage.survey.visible_from`; noise is there where
    the requirements ask for it. 20 bytes a sight, 24 with noise.

    Raises
    ------
    RequirementError, DeviceError
        See `check_noise`, `ScanEngine.patch_returns`, `PatchMode.see`.
    """
    check_noise(settings)
    noisy = asks_for_noise(settings.requirements)
    for sights in looks_in_batches(survey, settings.scan_mode, engine, positions_m, progress=progress):
        if noisy:
            yield with_noise(sights, settings.scanner, reflectivity=settings.requirements.reflectivity)
        else:
            yield sights

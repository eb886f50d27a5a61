"""From option values to what the library takes: scene, settings, survey, engine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from .options import METRES_PER_UNIT, FileOptions
from .output import repairs

if TYPE_CHECKING:
    from planner_core.model import PlanSettings, Scene, Survey
    from planner_core.progress import Progress
    from planner_core.scan.engine import ScanEngine

    from .progress import ProgressReporter


def load(scene: Path, reading: FileOptions, *, progress: Progress) -> Scene:
    """Load the scene file with the options of the command line."""
    from planner_core.scene.load import LoadOptions, load_scene

    options = LoadOptions(
        metres_per_unit=METRES_PER_UNIT[reading.units] if reading.units else None,
        up_axis=reading.up.upper() if reading.up else None,
        skip_bad_faces=reading.skip_bad_faces,
        glass=reading.glass,
    )
    return load_scene(scene, options=options, progress=progress)


def settings(
    *,
    scanner: str,
    coverage_percent: float,
    overlap_percent: float,
    floors: Sequence[str],
    grid_step_m: float,
    heights_m: Sequence[float],
    clearance_m: float,
    max_patch_area_m2: float,
    scan_mode: str,
    seed: int,
) -> PlanSettings:
    """Return the settings of a plan from the values of `options.problem_options`."""
    from planner_core.model import PlanSettings, Requirements
    from planner_core.scan.scanners import load_scanner

    return PlanSettings(
        scanner=load_scanner(scanner),
        requirements=Requirements(
            coverage=coverage_percent / 100.0, overlap=overlap_percent / 100.0, floors=tuple(floors)
        ),
        seed=seed,
        grid_step_m=grid_step_m,
        instrument_heights_m=tuple(heights_m),
        clearance_m=clearance_m,
        max_patch_area_m2=max_patch_area_m2,
        scan_mode=scan_mode,
    )


def with_method(
    problem: PlanSettings,
    *,
    method: str,
    search: str | None,
    time_limit_s: float | None,
    assignments: Sequence[str],
) -> PlanSettings:
    """Return the settings with a method and its options, from the values of `options.method_choice`.

    Raises
    ------
    RequirementError
        Text that is no NAME=VALUE, a search for a method that has none, or options that the method refuses.
    """
    from planner_core.errors import RequirementError
    from planner_core.paper import paper_settings
    from planner_core.plan import selection_settings

    if search is not None and method != "paper":
        raise RequirementError(f"--search: got it with --method {method}, which has none; add --method paper")
    if time_limit_s is not None and method != "proven":
        raise RequirementError(f"--time-limit: got it with --method {method}, which has none; add --method proven")
    options = [("search", search)] if search is not None else []
    options += [("time_limit_s", repr(time_limit_s))] if time_limit_s is not None else []
    for text in assignments:
        name, equals, value = text.partition("=")
        if not (name and equals):
            raise RequirementError(f"--set: got {text!r}, expected NAME=VALUE, such as spatial.step_m=0.1")
        options.append((name.strip(), value.strip()))
    chosen = replace(problem, method=method, method_options=tuple(options))
    if method == "paper":
        paper_settings(chosen)  # refuses what makes no sense before anything is loaded
    elif method == "proven":
        selection_settings(chosen)
    elif options:
        raise RequirementError(
            f"--set: got it with --method {method}, which has no options; add --method proven or paper"
        )
    return chosen


def open_survey(
    scene: Path,
    problem: PlanSettings,
    reading: FileOptions,
    reporter: ProgressReporter,
    *,
    engine: str,
    device: str | None,
    listed_in: str,
) -> tuple[Survey, ScanEngine, tuple[str, ...]]:
    """Load the scene, find its floors and open the engine; tell each warning at once, and return them all.

    `listed_in` says where the user finds the faces that loading dropped.
    """
    from planner_core.progress import ProgressEvent
    from planner_core.scan.engine import open_engine
    from planner_core.survey import make_survey

    loaded = load(scene, reading, progress=reporter.show)
    of_scene = (*repairs(loaded.report, listed_in=listed_in), *loaded.report.warnings)
    reporter.warn(of_scene)
    survey = make_survey(loaded, problem, progress=reporter.show)
    reporter.warn(survey.warnings)
    reporter.show(ProgressEvent("engine", 0, 1))
    caster = open_engine(survey.scene, survey.patches, engine=engine, device=device)
    reporter.show(ProgressEvent("engine", 1, 1, f"{caster.name}: {caster.device}"))
    reporter.warn(caster.warnings)
    return survey, caster, (*of_scene, *survey.warnings, *caster.warnings)

"""`tlsplan plan`: from a scene file to a plan folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..options import (
    DEFAULT_DRAWING_SETTINGS,
    DEFAULT_FILE_OPTIONS,
    DEFAULT_METHOD_OPTIONS,
    NO_PRIOR_STATIONS,
    DrawingSettings,
    FileOptions,
    MethodOptions,
    PriorStations,
    apply,
    drawing_options,
    engine_options,
    method_choice,
    output_options,
    overwrite_option,
    prior_options,
    problem_options,
    scene_argument,
    scene_options,
    scheduler_option,
    verify_option,
)

if TYPE_CHECKING:
    from planner_core.model import PlanSettings


#: What takes longest to import, in the order in which a plan needs it.
_NEEDED_LATER = (
    "planner_core.planning.plan",
    "planner_core.planning.independent_check",
    "planner_core.engine.open3d:import_open3d",
    "planner_core.plan_folder.folder",
    "matplotlib.backends.backend_agg",
    "pyvista",
    "vtkmodules.vtkRenderingOpenGL2",
    "planner_core.plan_folder.offscreen:window_class",
)


@click.command(
    "plan",
    epilog="Example:  tlsplan plan building.ifc --coverage 95 -o plan/",
)
@scene_argument
@click.option("-o", "--output", "folder", type=click.Path(path_type=Path), metavar="FOLDER",
              help="Plan folder to write. [default: <scene>-plan in the current directory]")  # fmt: skip
@verify_option
@apply(problem_options, prior_options, method_choice, scene_options, drawing_options, engine_options,
       scheduler_option, overwrite_option, output_options)  # fmt: skip
def command(
    scenes: tuple[Path, ...], folder: Path | None, overwrite: bool, as_json: bool, quiet: bool, **values: Any
) -> None:
    """Plan scanner stations in SCENE, one or more files of a building.

    They are the fewest that meet the requirements and register as one network.

    Drawings (DXF, PDF, pictures), a storey each from the lowest, are raised to an IFC file beside the plan; that is
    planned.

    Ctrl-C during the search ends it: the best plan so far is written, with its lower bound.
    """
    run(scenes, folder or Path(f"{scenes[0].stem}-plan"), overwrite=overwrite, as_json=as_json, quiet=quiet, **values)


def run(
    scenes: Sequence[Path],
    folder: Path,
    *,
    overwrite: bool,
    as_json: bool,
    quiet: bool,
    engine: str,
    device: str | None,
    scheduler: str | None = None,
    n_verify: int | None = None,
    reading: FileOptions = DEFAULT_FILE_OPTIONS,
    drawn: DrawingSettings = DEFAULT_DRAWING_SETTINGS,
    choosing: MethodOptions = DEFAULT_METHOD_OPTIONS,
    prior_stations: PriorStations = NO_PRIOR_STATIONS,
    **problem: Any,
) -> None:
    """Plan, write the folder and print the summary; `demo` calls this too."""
    from planner_core.executor import spread_over
    from planner_core.plan_folder.folder import check_output, write_plan_folder
    from planner_core.plan_folder.report import letter_warnings
    from planner_core.planning.independent_check import with_independent_check
    from planner_core.planning.plan import plan_survey

    from .. import drawings, inputs, summary
    from ..progress import ProgressReporter

    check_output(folder, overwrite=overwrite)  # before minutes of work, not after
    settings = problem_of(choosing=choosing, prior_stations=prior_stations, **problem)
    with ProgressReporter(quiet=quiet or as_json) as reporter:
        scenes, reading = drawings.with_drawings_lifted(
            scenes, reading, drawn, folder.with_name(f"{folder.name}.ifc"), reporter, overwrite=overwrite
        )
        survey, scan_engine, _ = inputs.open_survey(
            scenes, settings, reading, reporter, engine=engine, device=device, listed_in="plan.json",
            needed_later=_NEEDED_LATER,
        )  # fmt: skip
        with inputs.opened_cluster(scheduler, reporter) as cluster, spread_over(cluster):
            plan = plan_survey(survey, settings, scan_engine, progress=reporter.show)
        plan = with_independent_check(
            plan,
            scan_engine,
            n_points=inputs.points_to_verify(n_verify, preset=_preset(choosing, problem)),
            progress=reporter.show,
        )
        reporter.warn(plan.warnings)
        write_plan_folder(plan, folder, engine=scan_engine, overwrite=overwrite, progress=reporter.show)
        reporter.warn(letter_warnings(plan))
    summary.finish(plan, folder, check_in_full=n_verify is not None, as_json=as_json, quiet=quiet)


def problem_of(
    *,
    choosing: MethodOptions = DEFAULT_METHOD_OPTIONS,
    prior_stations: PriorStations = NO_PRIOR_STATIONS,
    **problem: Any,
) -> PlanSettings:
    """Return what is planned, from the values of the options that say it; `batch` makes its sites' of the same.

    Raises
    ------
    RequirementError, StationListError
        As `inputs.settings`, `inputs.with_prior` and `inputs.with_method` do.
    """
    from .. import inputs

    settings = inputs.settings(**{**problem, "preset": _preset(choosing, problem)})
    return inputs.with_method(inputs.with_prior(settings, prior_stations), choosing)


def _preset(choosing: MethodOptions, problem: dict[str, Any]) -> str | None:
    return "paper" if choosing.method == "paper" else problem.get("preset")

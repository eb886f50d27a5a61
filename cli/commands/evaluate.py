"""`tlsplan evaluate`: what a GIVEN list of stations sees, in the same keys as a plan."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..options import (
    FileOptions,
    apply,
    engine_options,
    output_options,
    overwrite_option,
    problem_options,
    scene_argument,
    scene_options,
    stations_option,
    verify_option,
)


@click.command("evaluate", epilog="Example:  tlsplan evaluate building.ifc --stations mine.csv --json")
@scene_argument
@stations_option
@click.option("-o", "--output", "folder", type=click.Path(path_type=Path), metavar="FOLDER",
              help="Plan folder of these stations to write.")  # fmt: skip
@verify_option
@apply(problem_options, scene_options, engine_options, overwrite_option, output_options)
def command(
    scenes: tuple[Path, ...],
    stations: Path,
    folder: Path | None,
    n_verify: int | None,
    overwrite: bool,
    as_json: bool,
    quiet: bool,
    engine: str,
    device: str | None,
    reading: FileOptions,
    **problem: Any,
) -> None:
    """Compute coverage and network of a given station list in SCENE: your own plan, or stations as scanned."""
    from planner_core.plan_folder.folder import check_output, write_plan_folder
    from planner_core.plan_folder.report import letter_warnings
    from planner_core.plan_folder.stations_csv import read_station_list
    from planner_core.planning.evaluate import evaluate_survey
    from planner_core.planning.independent_check import with_independent_check

    from .. import inputs, summary
    from ..progress import ProgressReporter

    if folder is not None:
        check_output(folder, overwrite=overwrite)
    settings = inputs.settings(**problem)
    given = read_station_list(stations)
    with ProgressReporter(quiet=quiet or as_json) as reporter:
        survey, scan_engine, _ = inputs.open_survey(
            scenes, settings, reading, reporter, engine=engine, device=device, listed_in="plan.json"
        )
        plan = evaluate_survey(survey, settings, given, scan_engine, progress=reporter.show)
        plan = with_independent_check(
            plan, scan_engine, n_points=inputs.points_to_verify(n_verify, **problem), progress=reporter.show
        )
        reporter.warn(plan.warnings)
        if folder is not None:
            write_plan_folder(plan, folder, engine=scan_engine, overwrite=overwrite, progress=reporter.show)
            reporter.warn(letter_warnings(plan))
    summary.finish(plan, folder, check_in_full=n_verify is not None, as_json=as_json, quiet=quiet)

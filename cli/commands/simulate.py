"""`tlsplan simulate`: the clouds that given stations would bring home."""

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
    scanner_option,
    scene_argument,
    scene_options,
    scheduler_option,
    stations_option,
)

FORMATS = ("exr", "png", "ply")


@click.command(
    "simulate", epilog="Example:  tlsplan simulate building.ifc --stations plan/plan.json -o scans/ --format ply"
)
@scene_argument
@stations_option
@click.option("-o", "--output", "folder", type=click.Path(path_type=Path), required=True, metavar="FOLDER",
              help="Folder of scans to write.")  # fmt: skip
@click.option("--format", "formats", type=click.Choice(FORMATS), multiple=True,
              default=FORMATS, show_default=True,
              help="Files per station. exr: range image; png: preview; ply: point cloud; may be repeated.")  # fmt: skip
@apply(scanner_option, scene_options, engine_options, scheduler_option, overwrite_option, output_options)
def command(
    scenes: tuple[Path, ...],
    stations: Path,
    folder: Path,
    formats: tuple[str, ...],
    scanner: str | None,
    reading: FileOptions,
    engine: str,
    device: str | None,
    scheduler: str | None,
    overwrite: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Simulate the scans of a station list in SCENE: range images and point clouds per station."""
    from planner_core.executor import spread_over
    from planner_core.export.clouds.simulated import simulated_clouds, write_simulated_scans
    from planner_core.model import PlanSettings
    from planner_core.plan_folder.stations_csv import read_station_list
    from planner_core.planning.evaluate import place_stations
    from planner_core.positions.admissibility import Tripods
    from planner_core.positions.free_space import free_space
    from planner_core.scanner import DEFAULT_SCANNER
    from planner_core.scanner.load_scanner import load_scanner

    from .. import inputs, output
    from ..progress import ProgressReporter

    _check_folder(folder, overwrite=overwrite)
    settings = PlanSettings(scanner=load_scanner(scanner or DEFAULT_SCANNER))
    given = read_station_list(stations)
    with ProgressReporter(quiet=quiet or as_json) as reporter:
        survey, scan_engine, warned = inputs.open_survey(
            scenes, settings, reading, reporter, engine=engine, device=device, listed_in="`tlsplan floors --json`"
        )
        space = free_space(survey, progress=reporter.show)
        listed, remarks = place_stations(Tripods(survey, settings, scan_engine), given, space)
        warnings = [*warned, *remarks]
        reporter.warn(warnings)
        clouds = simulated_clouds(survey, settings, listed, scan_engine, progress=reporter.show)
        with inputs.opened_cluster(scheduler, reporter) as cluster, spread_over(cluster):
            written = write_simulated_scans(clouds, formats, folder, overwrite=overwrite)
    scans: list[dict[str, Any]] = [
        {
            "station": scan.station_id,
            "n_beams": scan.n_beams,
            "n_returns": scan.n_returns,
            "files": [str(folder / name) for name in scan.files],
        }
        for scan in written
    ]
    if as_json:
        output.as_json({"scanner": settings.scanner.name, "scans": scans, "warnings": warnings})
    elif not quiet:
        output.table(
            ("station", "beams", "returns", "files"),
            [(s["station"], str(s["n_beams"]), str(s["n_returns"]), " ".join(s["files"])) for s in scans],
        )


def _check_folder(folder: Path, *, overwrite: bool) -> None:
    """Refuse, before any work, a folder that holds anything but scans, and one with scans unless it may be replaced."""
    from planner_core.errors import OutputExistsError
    from planner_core.plan_folder.atomic import check_writable

    check_writable(folder)
    if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
        raise OutputExistsError(f"{folder}: is not a folder, expected one to write; give another name")
    if not folder.is_dir() or not any(folder.iterdir()):
        return
    foreign = sorted(path.name for path in folder.iterdir() if path.suffix[1:] not in FORMATS)
    if foreign:
        raise OutputExistsError(f"{folder}: holds {foreign[0]!r}, expected a folder of scans; give another name")
    if not overwrite:
        raise OutputExistsError(f"{folder}: holds scans; give another name, or pass --overwrite to replace them all")

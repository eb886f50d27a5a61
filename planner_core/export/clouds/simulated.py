"""Scans of any stations, without a plan: range images, previews and point clouds as files, streamed, one a station.

Survey, stations, engine -> a folder, in scene coordinates. What is in the files: docs/formats/scans.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import ExportError, PlannerError, RequirementError
from planner_core.export.clouds.each_station import WriteStation, one_file, write_each
from planner_core.export.clouds.exr import write_images
from planner_core.export.clouds.file_header import file_names
from planner_core.export.clouds.ply import write_points
from planner_core.export.clouds.points import Clouds
from planner_core.model import PlanSettings, SiteFrame, Station, Survey
from planner_core.plan_folder.atomic import staged_folder
from planner_core.plan_folder.plan_source import FieldStation
from planner_core.progress import Progress, silent

FORMATS = ("exr", "png", "ply")


@dataclass(frozen=True)
class SimulatedScan:
    """What was written of a station. files : names, in the order of `FORMATS`."""

    station_id: str
    n_beams: int
    n_returns: int
    files: tuple[str, ...]


def simulated_clouds(
    survey: Survey,
    settings: PlanSettings,
    stations: Sequence[Station],
    engine: ScanEngine,
    *,
    progress: Progress = silent,
) -> Clouds:
    """Make ready to scan from stations of the local frame: every beam, exactly, in scene coordinates."""
    scene = survey.scene
    return Clouds(
        title=scene.title,
        identity=tuple(source.sha256 for source in scene.sources),
        frame=SiteFrame(),
        settings=settings,
        survey=survey,
        stations=tuple(_in_scene(station, survey) for station in stations),
        template=survey.template,
        step=1,
        noise=None,
        seed=0,
        progress=progress,
        scan_engine=engine,
    )


def write_simulated_scans(
    clouds: Clouds,
    formats: Sequence[str],
    folder: Path,
    *,
    overwrite: bool = False,
) -> tuple[SimulatedScan, ...]:
    """Write the scans of all stations into `folder`, which appears whole or not at all.

    Here or, within `spread_over`, by others: see `write_each`. Memory holds one block of a scan. Images and points are
    scanned for one after the other: nothing of a scan is kept.

    Parameters
    ----------
    formats
        Some of `FORMATS`.
    overwrite
        Replace the folder, whatever it holds.

    Raises
    ------
    RequirementError
        Another format, or none.
    OutputExistsError
        The folder holds something, and is not to be replaced.
    ExportError
        A file can't be written.
    MissingPackageError
        OpenImageIO is missing (EXR, PNG).
    """
    passes = _passes(formats)
    try:
        with staged_folder(folder, replace=overwrite) as staging:
            tallies = write_each(clouds, passes, staging)
    except PlannerError:
        raise
    except OSError as error:
        raise ExportError(
            f"{folder}: can't be written ({error.strerror or error}), nothing was changed; check the free space and "
            "the permissions"
        ) from error
    n_rows, n_columns = clouds.template.shape
    return tuple(
        SimulatedScan(
            station_id=station.id,
            n_beams=n_rows * n_columns,
            n_returns=tallies[index].n_points,
            files=tuple(f"{name}.{suffix}" for suffix in FORMATS if suffix in formats),
        )
        for index, (station, name) in enumerate(zip(clouds.stations, file_names(clouds), strict=True))
    )


def _passes(formats: Sequence[str]) -> tuple[WriteStation, ...]:
    """What is written of a scan at once."""
    unknown = sorted(set(formats) - set(FORMATS))
    if unknown or not formats:
        raise RequirementError(
            f"format: got {unknown[0] if unknown else 'none'}, expected some of {', '.join(FORMATS)}"
        )
    passes: list[WriteStation] = []
    if "exr" in formats or "png" in formats:
        passes.append(partial(write_images, exr="exr" in formats, png="png" in formats))
    if "ply" in formats:
        passes.append(one_file(".ply", write_points))
    return tuple(passes)


def _in_scene(station: Station, survey: Survey) -> FieldStation:
    return FieldStation(
        id=station.id,
        number=station.order,
        floor_id=station.floor,
        floor_name=next((floor.name for floor in survey.floors if floor.id == station.floor), ""),
        order=station.order,
        position_m=station.position_m + survey.scene.offset_m,
        instrument_height_m=station.instrument_height_m,
        frame=SiteFrame(),
        fixed=station.fixed,
        own_area_m2=station.own_area_m2,
        covered_area_m2=station.covered_area_m2,
    )

"""What `import tlsplan` offers: the library's stages with names, defaults and words of the command line."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.coordinates.request import FrameRequest
from planner_core.engine.patch_mode import mode_that_counts_parts
from planner_core.errors import PlannerError, StationListError
from planner_core.export.options import Options as ExportOptions
from planner_core.export.reviewed import opened_as_reviewed
from planner_core.export.write import Written, check_export, export_pack
from planner_core.model import (
    Doors,
    Glass,
    Greedy,
    Method,
    Objective,
    Paper,
    Plan,
    PlanSettings,
    Proven,
    Requirements,
    Scanner,
    Scene,
    Scope,
    UpAxis,
    VisibilityMode,
)
from planner_core.model.choices import one_of
from planner_core.plan_folder import folder as plan_folders
from planner_core.plan_folder import plan_source
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.plan_folder.stations_csv import GivenStation, read_station_list
from planner_core.planning.evaluate import evaluate_stations
from planner_core.planning.plan import make_plan
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.requirements.deliverables import DEFAULT_DELIVERABLE, NO_DELIVERABLE
from planner_core.requirements.goals import NO_COVER
from planner_core.requirements.read import read_requirements, requirements_from
from planner_core.scanner import DEFAULT_SCANNER, PAPER_SCANNER
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene import load
from planner_core.scene.load import LoadOptions

__all__ = [
    "Doors",
    "ExportOptions",
    "FrameRequest",
    "Glass",
    "Greedy",
    "LoadOptions",
    "Method",
    "Objective",
    "Paper",
    "Plan",
    "PlanSettings",
    "PlanSource",
    "PlannerError",
    "Progress",
    "ProgressEvent",
    "Proven",
    "Requirements",
    "Scene",
    "UpAxis",
    "Written",
    "evaluate",
    "export",
    "load_scene",
    "open_plan",
    "plan",
    "settings",
    "write_plan",
]

#: As the command line reads files: beams end at glass, and doors indoors are open.
AS_THE_COMMAND = LoadOptions(glass=Glass.STOP, doors=Doors.OPEN)
_SETTINGS = {field.name for field in fields(PlanSettings)} - {"scanner", "requirements", "site"}


def load_scene(
    path: str | Path | Sequence[str | Path],
    *,
    options: LoadOptions | Sequence[LoadOptions] = AS_THE_COMMAND,
    progress: Progress = silent,
) -> Scene:
    """Load a building from an IFC, OBJ, PLY, STL, glTF or USD file, or from several files of one building.

    Parameters
    ----------
    options
        Of all files, or one for each.

    Raises
    ------
    SceneError
        A file can't be used, or not with the others; one line.
    """
    paths = [path] if isinstance(path, str | Path) else path
    return load.load_scene([Path(each) for each in paths], options=options, progress=progress)


def settings(
    scanner: str | Path | Scanner | None = None, *, requirements: str | Path | None = None, **more: Any
) -> PlanSettings:
    """Return settings to plan or evaluate with.

    Parameters
    ----------
    scanner
        Name, as `tlsplan scanners` lists them, or file; a mode after a colon, such as `rtc360:high`. The default is
        `rtc360`. With `method=Paper()` no limits apply to points, and the scanner is the paper's, `hdl-64e`.
    requirements
        A requirements file, YAML or JSON, see docs/formats/requirements.md.
    more
        Fields of `PlanSettings`, such as `grid_step_m=1.0` or `method=Proven(work_limit=20)`; and entries of a
        requirements file, `site` among them, in place of the file's own, such as `coverage="95 %"`,
        `spacing="6 mm"`, `deliverable="survey"`.

    Raises
    ------
    RequirementError
        An entry that is not understood, or is not valid.
    """
    chosen = {name: more.pop(name) for name in _SETTINGS & set(more)}
    is_paper = isinstance(chosen.get("method"), Paper)
    defaults: dict[str, Any] = {"deliverable": NO_DELIVERABLE if is_paper else DEFAULT_DELIVERABLE}
    defaults |= {"scope": Scope.ALL if is_paper else Scope.AUTO, "no_cover": () if is_paper else NO_COVER}
    scanner = scanner or (PAPER_SCANNER if is_paper else DEFAULT_SCANNER)
    if requirements is None:
        required, site = requirements_from(more, where="settings", **defaults)
    else:
        required, site = read_requirements(requirements, instead=more, **defaults)
    used = scanner if isinstance(scanner, Scanner) else load_scanner(scanner)
    if not is_paper:
        mode = one_of(VisibilityMode, chosen.get("scan_mode", VisibilityMode.AUTO), "scan_mode")
        chosen["scan_mode"] = mode_that_counts_parts(mode, used)
    return PlanSettings(scanner=used, requirements=required, site=site, **chosen)


def plan(
    scene: Scene,
    settings: PlanSettings | None = None,
    *,
    engine: str = "auto",
    device: str | None = None,
    verify_points: int | None = None,
    progress: Progress = silent,
    **more: Any,
) -> Plan:
    """Plan the stations of a survey.

    Parameters
    ----------
    settings
        None: made from `more`, by the function `settings`.
    engine, device
        Scan engine: `auto`, `opencl` or `open3d`; OpenCL device by number or part of its name.
    verify_points
        Random points of the independent check; 0: none. None: 20000, and none for `method=Paper()`.
    progress
        Is called with one `ProgressEvent` after the other; a KeyboardInterrupt that it raises while stations are
        chosen ends the search with the best plan so far.

    Raises
    ------
    PlannerError
        Settings that are not valid or can't be met, no device; one line.
    """
    chosen = _settings(settings, more)
    return make_plan(scene, chosen, engine=engine, device=device, verify_points=verify_points, progress=progress)


def evaluate(
    scene: Scene,
    stations: str | Path | Iterable[Sequence[float]],
    settings: PlanSettings | None = None,
    *,
    engine: str = "auto",
    device: str | None = None,
    verify_points: int | None = None,
    progress: Progress = silent,
    **more: Any,
) -> Plan:
    """Evaluate given stations: the figures of a plan.

    Parameters
    ----------
    stations
        A CSV or plan.json; or positions (x, y, z) of the sensor, scene frame, metres.
    settings, engine, device, verify_points, progress, more
        As for `plan`.

    Raises
    ------
    PlannerError
        As `plan`; or stations that can't be read.
    """
    given = read_station_list(Path(stations)) if isinstance(stations, str | Path) else _given(stations)
    chosen = _settings(settings, more)
    return evaluate_stations(
        scene, chosen, given, engine=engine, device=device, verify_points=verify_points, progress=progress
    )


def write_plan(
    plan: Plan, folder: str | Path, *, overwrite: bool = False, pictures: bool = True, progress: Progress = silent
) -> PlanSource:
    """Write the plan folder, as `tlsplan plan` does, and return it opened.

    pictures : False leaves the pictures out of the report; drawing them takes seconds.

    Raises
    ------
    PlannerError
        There is something at `folder` that may not be replaced, or it can't be written.
    """
    plan_folders.write_plan_folder(plan, Path(folder), overwrite=overwrite, pictures=pictures, progress=progress)
    return open_plan(folder)


def open_plan(
    folder: str | Path,
    *,
    scene: str | Path | Sequence[str | Path] | None = None,
    frame: FrameRequest | None = None,
) -> PlanSource:
    """Open a plan folder: its stations, floors and links, and plan.json in `document`.

    Parameters
    ----------
    scene
        The scene file or files, where they are neither where they were nor beside the folder.
    frame
        The site's coordinate system, where the scene file does not tell it.

    Raises
    ------
    PlannerError
        There is no plan of this version, or no such coordinate system.
    """
    files = [scene] if isinstance(scene, str | Path) else scene or []
    return plan_source.open_plan(Path(folder), scene=[Path(each) for each in files], frame=frame)


def export(
    plan: PlanSource | str | Path,
    folder: str | Path,
    formats: Sequence[str] = ("all",),
    options: ExportOptions = ExportOptions(),  # noqa: B008 - frozen
    *,
    overwrite: bool = False,
    progress: Progress = silent,
) -> Written:
    """Write a plan folder, as its review leaves it, in formats of other programs, into one folder.

    Parameters
    ----------
    plan
        Where it is; or opened, then without its review: of coordinates and scene files that the plan does not know,
        tell `open_plan`.
    formats
        Names, as `tlsplan export --list` has them; `all`: every one that needs nothing else.

    Raises
    ------
    PlannerError
        An unknown format, something at `folder`, or what a format needs is not there.
    """
    more: dict[str, Any] = {"overwrite": overwrite, "progress": progress}
    if isinstance(plan, PlanSource):
        return export_pack(formats, plan, Path(folder), options, **more)

    def check(source: PlanSource) -> None:
        check_export(formats, source, Path(folder), options, is_pack=True, overwrite=overwrite)

    with opened_as_reviewed(Path(plan), tuple(formats), check=check, progress=progress) as (opened, remarks):
        written = export_pack(formats, opened, Path(folder), options, **more)
    return replace(written, remarks=(*written.remarks, *remarks))


def _settings(given: PlanSettings | None, more: dict[str, Any]) -> PlanSettings:
    if given is None:
        return settings(**more)
    if more:
        raise TypeError(f"got settings and {', '.join(more)}, too, expected one of the two; put them into the settings")
    return given


def _given(positions: Iterable[Sequence[float]]) -> tuple[GivenStation, ...]:
    given = []
    for number, position in enumerate(positions, start=1):
        at = np.asarray(position, dtype=np.float64)
        if at.shape != (3,) or not np.isfinite(at).all():
            raise StationListError(f"station {number}: got {position}, expected three finite numbers x, y, z in metres")
        given.append(GivenStation(f"S{number:03d}", at, None, None))
    return tuple(given)

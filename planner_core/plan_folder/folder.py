"""The plan folder: everything of a plan, written so that it appears whole or not at all.

Plan, ScanEngine -> folder; docs/formats/plan.md lists the files. Every station is scanned once more, for a preview of
its cloud, of few beams where the scanner has many. `simulate` and `export` make whole clouds and range images.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import OutputExistsError, PlanFolderError
from planner_core.model import Plan
from planner_core.plan_folder.atomic import check_writable, locked_folder, recover, staged_folder
from planner_core.plan_folder.carry_over import HEATMAPS_FILE, STAGE_FILES, carry_over, plan_station_names
from planner_core.plan_folder.face_results import face_results
from planner_core.plan_folder.plan_json import plan_text
from planner_core.plan_folder.report import report_files, write_report
from planner_core.plan_folder.stations_csv import stations_csv
from planner_core.plan_folder.usd_names import station_prim_names
from planner_core.plan_folder.usd_stage import cloud_layer, empty_review, write_heatmaps, write_layer, write_stage
from planner_core.plan_folder.viewer_layers import (
    LayerFigures,
    layer_file_names,
    layer_files,
    layers_of,
    packed_cloud,
    patches_bytes,
)
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.scanner.template import preview_template

STAGE = "export"


def check_output(folder: Path, *, overwrite: bool) -> None:
    """Say at once, before minutes of work, whether `folder` may be written.

    A free name and an empty folder may; a plan folder may with `overwrite`, unless reviewers' changes would be lost.

    Raises
    ------
    OutputExistsError
        With the remedy.
    PlanFolderError
        Nothing can be written there: no folder to write into, or no permission.
    """
    _check_parent(folder)
    recover(folder)
    if folder.is_symlink():
        raise OutputExistsError(f"{folder}: is a link, expected a folder of its own; name what it leads to")
    if not folder.exists():
        return
    if not folder.is_dir():
        raise OutputExistsError(f"{folder}: is a file, expected a folder to write; give another name")
    if os.path.ismount(folder):
        raise OutputExistsError(
            f"{folder}: is where a disk is mounted, expected a folder that can be renamed; name one inside it"
        )
    if not any(folder.iterdir()):
        return
    if not overwrite:
        raise OutputExistsError(f"{folder}: exists, expected a free name; give another or pass --overwrite")
    try:
        plan_station_names(folder)
    except PlanFolderError as error:
        raise OutputExistsError(
            f"{folder}: holds files but no plan of this version, expected a plan folder to replace; "
            "give another name or delete it yourself"
        ) from error
    _check_review(folder)


def _check_parent(folder: Path) -> None:
    """Check the nearest folder above that is there: those missing between are made when the plan is written."""
    parent = folder.absolute().parent
    while not os.path.lexists(parent):
        parent = parent.parent
    if not parent.is_dir():
        raise PlanFolderError(
            f"{folder}: can't be written, {parent} is not a folder, expected one to write into; give another path"
        )
    check_writable(folder)


def write_plan_folder(
    plan: Plan,
    folder: Path,
    *,
    engine: ScanEngine | None = None,
    overwrite: bool = False,
    pictures: bool = True,
    progress: Progress = silent,
) -> None:
    """Write the plan folder. What people put into the folder that it replaces is carried over.

    Parameters
    ----------
    engine
        Scans the stations; of the plan's scene and patches. None opens the default one.
    pictures
        False leaves the pictures out of the report: drawing them takes longer than planning a small building.
    progress
        Stage `export`, one step a file. Raising from it leaves nothing behind.

    Raises
    ------
    OutputExistsError
        See `check_output`, which is called again right before the old plan is replaced, and `carry_over`.
    PlanFolderError
        A file can't be written: disk full, no permission.
    """
    with staged_plan_folder(folder, overwrite=overwrite) as staging:
        scanner = engine or open_engine(plan.survey.scene, plan.survey.patches)
        _Writer(plan, scanner, staging, progress, folder, pictures=pictures).write()


@contextlib.contextmanager
def staged_plan_folder(folder: Path, *, overwrite: bool) -> Iterator[Path]:
    """Yield an empty folder; on leaving it becomes the plan folder. Raises as `write_plan_folder`."""
    check_output(folder, overwrite=overwrite)

    def bring_along(staging: Path) -> None:
        if overwrite and folder.is_dir() and any(folder.iterdir()):
            check_output(folder, overwrite=True)  # it may be another folder by now
            held.enter_context(locked_folder(folder))  # who commits to its review waits, and finds the new plan
            carry_over(folder, staging)
            _check_review(folder)

    try:
        with (
            contextlib.ExitStack() as held,
            staged_folder(folder, replace=overwrite, before_install=bring_along) as staging,
        ):
            yield staging
    except OutputExistsError:
        raise
    except OSError as error:
        raise PlanFolderError(
            f"{folder}: can't be written ({error.strerror or error}), nothing was changed; "
            "check the free space and the permissions"
        ) from error


class _Writer:
    """Writes the files of one plan folder into a staging folder and counts them."""

    def __init__(
        self, plan: Plan, engine: ScanEngine, staging: Path, progress: Progress, final: Path, *, pictures: bool
    ) -> None:
        self._plan = plan
        self._engine = engine
        self._folder = staging
        self._final = final
        self._progress = progress
        self._pictures = pictures
        self._n_done = 0
        self._n_files = 2 * len(plan.stations) + len(STAGE_FILES) + len(report_files(plan, pictures=pictures)) + 4
        self._n_files += len(layer_file_names(plan))

    def write(self) -> None:
        """Write everything: the layers before the stage, because the results of the faces need their ranges."""
        self._write_previews()
        layers = layers_of(self._plan.settings.scanner)
        figures = LayerFigures(layers, self._plan.survey.patches.n_patches)
        self._put("viewer/patches.u8", patches_bytes(self._plan.times_seen, self._plan.achievable))
        for name, content in layer_files(self._plan, self._engine, figures):
            self._put(name, content)
        best_range_m = next(figures.of(layer) for layer in layers if layer.id == "range")
        write_stage(self._plan, face_results(self._plan, best_range_m), self._folder)
        self._step("stage", n_files=len(STAGE_FILES))
        write_heatmaps(self._plan, self._folder)
        self._step(HEATMAPS_FILE)
        self._put("stations.csv", stations_csv(self._plan).encode())
        report = self._folder / "report"
        for name in write_report(self._plan, report, engine=self._engine, pictures=self._pictures):
            self._step(f"report/{name}")
        self._put("plan.json", plan_text(self._plan, self._final).encode())

    def _write_previews(self) -> None:
        plan, template = self._plan, preview_template(self._plan.survey.template)
        for name, station in zip(station_prim_names(plan.stations), plan.stations, strict=True):
            scans = self._engine.scan(template, station.position_m[None, :])
            range_m = scans.range_m[0]
            self._put(f"viewer/clouds/{name}.cloud", packed_cloud(range_m, scans.cos_incidence[0], template))
            write_layer(cloud_layer(range_m, template), self._folder / f"stage/clouds/{name}.usdc")
            self._step(f"stage/clouds/{name}.usdc")

    def _put(self, name: str, content: bytes) -> None:
        path = self._folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        self._step(name)

    def _step(self, name: str, *, n_files: int = 1) -> None:
        self._n_done += n_files
        self._progress(ProgressEvent(STAGE, self._n_done, self._n_files, name))


def _check_review(folder: Path) -> None:
    review = folder / "review.usda"
    if review.is_file() and review.read_text(encoding="utf-8", errors="replace") != empty_review():
        raise OutputExistsError(
            f"{review}: holds reviewers' changes, which overwriting would delete; expected it untouched; "
            "move it away or give another folder"
        )

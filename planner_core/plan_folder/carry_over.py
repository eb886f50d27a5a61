"""What people put into a plan folder: everything that is not the plan's, taken along when the plan is replaced.

A file is the plan's where docs/formats/plan.md names it; for stations the ids in the folder's own plan.json decide.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

from planner_core.errors import OutputExistsError
from planner_core.operating_system import sync
from planner_core.plan_folder.plan_json import read_plan
from planner_core.plan_folder.usd_names import prim_names_of_ids

#: Named here and not where they are written: who reads a folder need not load USD.
STAGE_FILES = (
    "plan.usda",
    "review.usda",
    "stage/results.usdc",
    "stage/stations.usda",
    "stage/building.usdc",
    "viewer/stage.usdc",
)
HEATMAPS_FILE = "stage/heatmaps.usdc"
_FILES = frozenset(
    {
        *STAGE_FILES,
        HEATMAPS_FILE,
        "plan.json",
        "stations.csv",
        "viewer/patches.u8",
        "viewer/layers.json",
        "viewer/reason.u8",
        "viewer/pieces.i32",
        "viewer/rooms.u16",
        "viewer/achievable.u8",
        "viewer/counted.u8",
        *(f"viewer/layers/{name}.u16" for name in ("range", "incidence", "spacing", "noise")),
        "report/index.html",
        "report/overview.png",
        "report/coverage_curve.png",
        "report/unseen.csv",
        "report/unseen_surfaces.csv",
    }
)
_FOLDERS = frozenset(
    {
        "stage",
        "stage/clouds",
        "viewer",
        "viewer/clouds",
        "viewer/layers",
        "viewer/seen",
        "viewer/lost",
        "scans",
        "report",
    }
)
_OF_A_STATION = (
    "stage/clouds/{}.usdc",
    "viewer/clouds/{}.cloud",
    "viewer/clouds/{}.u16",  # of older versions, as are the two of scans: they go with the plan that they are of
    "viewer/seen/{}.bits",
    "viewer/lost/{}.u32",
    "scans/{}.exr",
    "scans/{}.png",
)
_OF_A_FLOOR = re.compile(r"report/(map|links|picture)_F[0-9]+\.png")


def plan_station_names(folder: Path) -> tuple[str, ...]:
    """Return the names that the station files of a plan folder bear.

    Raises
    ------
    PlanFolderError
        The folder holds no plan of this version.
    """
    return prim_names_of_ids([station.id for station in read_plan(folder).stations])


def foreign_entries(folder: Path) -> tuple[str, ...]:
    """Files and folders of a plan folder that are not the plan's: relative paths, folders before what is in them."""
    ours = {pattern.format(name) for name in plan_station_names(folder) for pattern in _OF_A_STATION} | _FILES
    return tuple(_foreign(folder, "", ours))


def _foreign(folder: Path, prefix: str, ours: set[str]) -> Iterator[str]:
    for entry in sorted(os.scandir(folder / prefix), key=lambda entry: entry.name):
        path = prefix + entry.name
        is_folder = entry.is_dir(follow_symlinks=False)
        if path not in _FOLDERS if is_folder else path not in ours and not _OF_A_FLOOR.fullmatch(path):
            yield path
        if is_folder:
            yield from _foreign(folder, f"{path}/", ours)


def carry_over(old: Path, new: Path) -> tuple[str, ...]:
    """Give the plan folder `new` the foreign entries of `old`, and have the disk hold them; return their paths.

    Files are hard links where the file system has them: no copy, and what is still being written arrives too.

    Raises
    ------
    OutputExistsError
        `new` has a file of the same name: one of the two would be lost.
    PlanFolderError
        `old` holds no plan.
    """
    entries = foreign_entries(old)
    touched: set[Path] = set()
    for path in entries:
        source, target = old / path, new / path
        if os.path.lexists(target):
            raise OutputExistsError(
                f"{source}: is not of the plan there, but the new plan has a file of this name, which would replace "
                "it; move yours away"
            )
        target.parent.mkdir(parents=True, exist_ok=True)
        if source.is_dir() and not source.is_symlink():
            target.mkdir()
        else:
            _link_or_copy(source, target)
        touched.update((target.parent, target.parent.parent))
    for path in reversed(entries):
        if (new / path).is_dir() and not (new / path).is_symlink():
            shutil.copystat(old / path, new / path)
    for folder in touched:
        if folder.is_relative_to(new):
            sync(folder)
    return entries


def _link_or_copy(source: Path, target: Path) -> None:
    try:
        os.link(source, target, follow_symlinks=False)
    except OSError:  # no hard links here, or not of files of other people
        shutil.copy2(source, target, follow_symlinks=False)
        if not target.is_symlink():
            sync(target)

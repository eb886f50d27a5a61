"""Poses of the scans in E57 files, from their headers; the points stay where they are.

Programs that lose a pose, or put it into the points, write the identity: no translation and no rotation.

libE57Format reads them in a child process, one for all files: a damaged file that ends it is one line.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from planner_core import child_process
from planner_core.child_process import LostChildError, limits_for
from planner_core.errors import StationListError
from planner_core.model import FloatArray
from planner_core.progress import silent

#: Name, position (3,) float64 in metres, and whether the pose is the identity.
Pose = tuple[str, FloatArray, bool]


def e57_poses(paths: Sequence[Path]) -> tuple[Pose, ...]:
    """Poses of all scans, in the files' own coordinates; in the order of the files.

    Raises
    ------
    StationListError
        A file is none, is no E57, is damaged, or has a scan without a pose.
    """
    for path in paths:
        if not path.is_file():
            raise StationListError(f"{path}: no such file, expected an E57 file; check the path")
    try:
        poses: tuple[Pose, ...] = child_process.run_isolated(
            "planner_core.as_scanned.e57_poses:read",
            {"paths": [os.fspath(path) for path in paths]},
            classes=(),
            limits=limits_for(0),
            stage="stations",
            progress=silent,
        )
    except LostChildError as lost:
        raise StationListError(
            f"{lost.place or paths[0]}: libE57Format {lost}, expected an E57 file that it can read; export it again"
        ) from lost
    return poses


def read(paths: Sequence[str]) -> list[Pose]:
    """What the child does."""
    return [pose for path in paths for pose in _of_file(Path(path))]


def _of_file(path: Path) -> list[Pose]:
    from pye57 import libe57

    child_process.at(str(path))
    try:
        file = libe57.ImageFile(str(path), "r")
        try:
            root = file.root()
            n_scans = root["data3D"].childCount() if root.isDefined("data3D") else 0
            if not n_scans:
                raise StationListError(
                    f"{path}: got no scans, expected some with their poses; export it with its scans"
                )
            return [_pose(path, root["data3D"][k], k) for k in range(n_scans)]
        finally:
            file.close()
    except libe57.E57Exception as error:
        line = str(error).partition("\n")[0]
        raise StationListError(f"{path}: can't be read as E57 ({line}); export it again") from error


def _pose(path: Path, scan: Any, k: int) -> Pose:
    name = str(scan["name"].value()).strip() if scan.isDefined("name") else ""
    if not scan.isDefined("pose/translation"):
        raise StationListError(
            f"{path}: scan {name or k + 1!r} has no pose, expected registered scans; export them after registration"
        )
    at = scan["pose"]["translation"]
    position_m = np.array([float(at[axis].value()) for axis in "xyz"])
    if not np.isfinite(position_m).all():
        raise StationListError(
            f"{path}: the pose of scan {name or k + 1!r} is not a valid position; export the scans again"
        )
    is_identity = not position_m.any() and not _is_turned(scan["pose"])
    return name or f"{path.stem} {k + 1}", position_m, is_identity


def _is_turned(pose: Any) -> bool:
    """Whether a pose has a rotation: a quaternion with an imaginary part."""
    if not pose.isDefined("rotation"):
        return False
    return any(float(pose["rotation"][axis].value()) != 0.0 for axis in "xyz")

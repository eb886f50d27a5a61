"""Folders that tests of several workers read: a scene, a plan. Who comes first fills one, the others wait."""

from __future__ import annotations

import fcntl
import shutil
from collections.abc import Callable
from pathlib import Path

MadeOnce = Callable[[str, Callable[[Path], object]], Path]


def folders_made_once(root: Path) -> MadeOnce:
    """What gives `root/name`, filled by a function of the folder; processes may share `root`."""

    def folder_of(name: str, fill: Callable[[Path], object]) -> Path:
        folder, made = root / name, root / f"{name}.made"
        with (root / f"{name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not made.exists():
                shutil.rmtree(folder, ignore_errors=True)  # what an error left
                folder.mkdir()
                fill(folder)
                made.touch()
        return folder

    return folder_of

"""Folders for what has to wait leave nothing behind, whenever the run is interrupted."""

from __future__ import annotations

import fcntl
import os
import shutil
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest

from planner_core.plan_folder.atomic import scratch_folder, staged_file, staged_folder


def test_scratch_folder_is_beside_its_target_and_goes(tmp_path: Path) -> None:
    with scratch_folder(tmp_path / "campus.ply") as folder:
        assert folder.parent == tmp_path and folder.name.startswith(".campus.waiting-")
        (folder / "faces").write_bytes(b"x")
    assert list(tmp_path.iterdir()) == []


def test_scratch_folder_goes_when_work_in_it_fails(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="full"), scratch_folder(tmp_path / "a.ply") as folder:
        (folder / "faces").write_bytes(b"x")
        raise RuntimeError("full")
    assert list(tmp_path.iterdir()) == []


def test_scratch_folder_goes_when_it_is_interrupted_as_it_comes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make = Path.mkdir

    def interrupted(path: Path, *arguments: Any, **options: Any) -> None:
        make(path, *arguments, **options)
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "mkdir", interrupted)
    with pytest.raises(KeyboardInterrupt), scratch_folder(tmp_path / "a.ply"):
        pass
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("call", ["os.open", "fcntl.flock"])
@pytest.mark.parametrize("how", [scratch_folder, staged_file, lambda path: staged_folder(path, replace=False)])
def test_nothing_stays_of_an_interrupt_as_a_name_is_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: str, how: Callable[[Path], AbstractContextManager[Path]]
) -> None:
    module = {"os": os, "fcntl": fcntl}[call.split(".")[0]]
    real = getattr(module, call.split(".")[1])

    def interrupted(*arguments: Any, **options: Any) -> None:
        real(*arguments, **options)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(module, call.split(".")[1], interrupted)
        with how(tmp_path / "a.ply"):
            pass
    assert list(tmp_path.iterdir()) == []


def test_scratch_folder_goes_when_it_is_interrupted_as_it_goes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    remove, calls = shutil.rmtree, []

    def interrupted(path: Path, **options: Any) -> None:
        calls.append(path)
        if len(calls) == 1:
            raise KeyboardInterrupt
        remove(path, **options)

    monkeypatch.setattr("planner_core.plan_folder.atomic.shutil.rmtree", interrupted)
    with pytest.raises(KeyboardInterrupt), scratch_folder(tmp_path / "a.ply"):
        pass
    assert list(tmp_path.iterdir()) == []

"""Folders for what has to wait leave nothing behind, whenever the run is interrupted."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from planner_core.export.atomic import scratch_folder


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


def test_scratch_folder_goes_when_it_is_interrupted_as_it_goes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    remove, calls = shutil.rmtree, []

    def interrupted(path: Path, **options: Any) -> None:
        calls.append(path)
        if len(calls) == 1:
            raise KeyboardInterrupt
        remove(path, **options)

    monkeypatch.setattr("planner_core.export.atomic.shutil.rmtree", interrupted)
    with pytest.raises(KeyboardInterrupt), scratch_folder(tmp_path / "a.ply"):
        pass
    assert list(tmp_path.iterdir()) == []

"""What killed writers of files left beside their target goes with the next one; what live ones have there stays."""

import errno
import fcntl
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from planner_core.plan_folder.atomic import recover, scratch_folder, staged_file, staged_folder

WRITER = """
import sys, time
from pathlib import Path
from planner_core.plan_folder import atomic

with getattr(atomic, sys.argv[1])(Path(sys.argv[2])) as staging:
    (staging / "faces" if staging.is_dir() else staging).write_text("half")
    print("writing", flush=True)
    time.sleep(100)
"""


@contextmanager
def writing(how: str, path: Path) -> Iterator[subprocess.Popen[str]]:
    """A process of its own that is in the middle of it."""
    process = subprocess.Popen([sys.executable, "-c", WRITER, how, str(path)], stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "writing\n"
        yield process
    finally:
        process.kill()
        process.communicate()


def kill(how: str, path: Path) -> None:
    """Leave what an abort leaves."""
    with writing(how, path) as process:
        process.send_signal(signal.SIGABRT)
        process.wait()


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize("how", ["staged_file", "scratch_folder"])
@pytest.mark.parametrize("name", ["cloud.ply", "cloud"])
def test_what_a_killed_writer_left_goes_with_the_next_one(tmp_path: Path, how: str, name: str) -> None:
    target = tmp_path / name
    kill(how, target)
    assert len(names(tmp_path)) == 2
    with staged_file(target) as staging, scratch_folder(target):
        staging.write_text("whole")
    assert names(tmp_path) == [name]
    assert target.read_text() == "whole"


def test_what_a_killed_writer_left_goes_though_the_next_one_fails(tmp_path: Path) -> None:
    kill("staged_file", tmp_path / "cloud.ply")
    with pytest.raises(OSError, match="No space"), staged_file(tmp_path / "cloud.ply"):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert names(tmp_path) == []


@pytest.mark.slow
@pytest.mark.parametrize("how", ["staged_file", "scratch_folder"])
def test_what_a_live_writer_has_there_stays(tmp_path: Path, how: str) -> None:
    target = tmp_path / "cloud.ply"
    with writing(how, target) as other:
        before = names(tmp_path)
        with staged_file(target) as staging, scratch_folder(target):
            staging.write_text("whole")
        assert names(tmp_path) == sorted([*before, "cloud.ply"])
        assert other.poll() is None


@pytest.mark.slow
@pytest.mark.parametrize("next_name", ["cloud.las", "cloud", "a.cloud.ply", "cloud.ply.gz"])
def test_what_writers_of_other_targets_left_stays(tmp_path: Path, next_name: str) -> None:
    kill("staged_file", tmp_path / "cloud.ply")
    before = names(tmp_path)
    with staged_file(tmp_path / next_name) as staging, scratch_folder(tmp_path / f"{next_name}.ply"):
        staging.write_text("whole")
    assert names(tmp_path) == sorted([*before, next_name])


@pytest.mark.slow
def test_a_folder_and_a_file_of_one_name_leave_nothing_of_each_other(tmp_path: Path) -> None:
    kill("staged_file", tmp_path / "cloud")
    with staged_folder(tmp_path / "cloud", replace=False) as staging:
        (staging / "x").write_text("whole")
    assert names(tmp_path) == ["cloud"]
    (tmp_path / "cloud" / "x").unlink()
    (tmp_path / "cloud").rmdir()
    kill("scratch_folder", tmp_path / "cloud")
    recover(tmp_path / "cloud")
    assert names(tmp_path) == []


def test_a_file_that_bears_the_name_of_a_lock_but_is_none_stays(tmp_path: Path) -> None:
    stranger = tmp_path / ".cloud.lock-notes.ply"
    stranger.write_text("mine")
    with staged_file(tmp_path / "cloud.ply") as staging:
        staging.write_text("whole")
    assert names(tmp_path) == [".cloud.lock-notes.ply", "cloud.ply"]


def test_without_locks_files_are_written_and_nothing_is_cleaned_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kill("staged_file", tmp_path / "cloud.ply")
    before = names(tmp_path)

    def refuse(handle: int, how: int) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", refuse)
    with staged_file(tmp_path / "cloud.ply") as staging:
        staging.write_text("whole")
    assert names(tmp_path) == sorted([*before, "cloud.ply"])

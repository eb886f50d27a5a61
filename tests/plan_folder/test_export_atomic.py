"""Writers of one folder side by side, links and parents in the way, disks that say no: whole or not at all."""

import errno
import fcntl
import os
import subprocess
import sys
from pathlib import Path

import pytest

from planner_core.errors import OutputExistsError, PlanFolderError
from planner_core.plan_folder import atomic
from planner_core.plan_folder.folder import check_output

WRITER = """
import os, sys
from pathlib import Path
from planner_core.plan_folder import atomic

folder, mine = Path(sys.argv[1]), sys.argv[2]
os.fsync = lambda handle: None  # a power cut is not what this is about, and the disk is slow
for turn in range(60):
    with atomic.staged_folder(folder, replace=True) as staging:
        for name in "abc":
            (staging / name).write_text(f"{mine} {turn}")
"""


def test_writers_of_one_folder_at_a_time_never_lose_each_others_work(tmp_path: Path) -> None:
    folder = tmp_path / "plan"
    writers = [
        subprocess.Popen([sys.executable, "-c", WRITER, str(folder), str(n)], stderr=subprocess.PIPE, text=True)
        for n in range(4)
    ]
    said = [writer.communicate(timeout=240)[1] for writer in writers]
    assert said == [""] * 4
    assert [path.name for path in tmp_path.iterdir()] == ["plan"]
    assert sorted(path.name for path in folder.iterdir()) == ["a", "b", "c"]
    assert len({path.read_text() for path in folder.iterdir()}) == 1


def test_writer_whose_lock_was_cleaned_up_takes_another_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another process recovers between the making of the lock file and its locking, every time but the last."""
    lock = fcntl.flock
    gone: list[str] = []

    def late(handle: int, how: int) -> None:
        if len(gone) < 3 and not how & fcntl.LOCK_NB:
            (file,) = tmp_path.iterdir()
            gone.append(file.name)
            file.unlink()
        lock(handle, how)

    monkeypatch.setattr(fcntl, "flock", late)
    with atomic.staged_folder(tmp_path / "plan", replace=False) as staging:
        atomic.recover(tmp_path / "plan")
        (staging / "file").write_text("x")
        assert len(set(gone)) == 3
    assert [path.name for path in tmp_path.iterdir()] == ["plan"]


def test_names_differ_for_writers_of_equal_process_number(tmp_path: Path) -> None:
    with (
        atomic.staged_folder(tmp_path / "plan", replace=False) as one,
        atomic.staged_folder(tmp_path / "plan", replace=True) as two,
    ):
        assert one != two


@pytest.mark.parametrize("code", [errno.ENOLCK, errno.EBADF, errno.EOPNOTSUPP])
def test_file_system_without_locks_is_written_and_nothing_is_cleaned_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    def refuse(handle: int, how: int) -> None:
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(fcntl, "flock", refuse)
    with atomic.staged_folder(tmp_path / "plan", replace=False) as staging:
        atomic.recover(tmp_path / "plan")
        (staging / "file").write_text("x")
    assert (tmp_path / "plan" / "file").read_text() == "x"


@pytest.mark.parametrize("replaces", [False, True])
def test_disk_that_does_not_confirm_the_new_name_is_not_told_as_nothing_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, replaces: bool
) -> None:
    folder = tmp_path / "plan"
    if replaces:
        folder.mkdir()
        (folder / "file").write_text("old")
    sync = atomic.sync

    def failing(path: Path) -> None:
        if path == tmp_path:
            raise OSError(errno.EIO, "Input/output error")
        sync(path)

    monkeypatch.setattr(atomic, "sync", failing)

    def write() -> None:
        with atomic.staged_folder(folder, replace=True) as staging:
            (staging / "file").write_text("new")

    with pytest.raises(PlanFolderError, match="is written and in place"):
        write()
    assert (folder / "file").read_text() == "new"
    assert [path.name for path in tmp_path.iterdir()] == ["plan"]


def test_folder_that_cannot_be_synced_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fsync = os.fsync

    def refuse_folders(handle: int) -> None:
        if Path(f"/proc/self/fd/{handle}").is_dir():
            raise OSError(errno.EINVAL, "Invalid argument")
        fsync(handle)

    monkeypatch.setattr(os, "fsync", refuse_folders)
    with atomic.staged_folder(tmp_path / "plan", replace=False) as staging:
        (staging / "file").write_text("x")
    assert (tmp_path / "plan" / "file").exists()


def test_links_and_pipes_in_a_folder_do_not_stop_syncing(tmp_path: Path) -> None:
    (tmp_path / "nowhere").symlink_to("gone")
    os.mkfifo(tmp_path / "pipe")
    atomic.sync_tree(tmp_path)


def test_link_is_refused_even_where_it_leads_to_an_empty_folder_or_nowhere(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    for target in ("empty", "nowhere"):
        link = tmp_path / f"to-{target}"
        link.symlink_to(tmp_path / target)
        with pytest.raises(OutputExistsError, match="is a link"):
            check_output(link, overwrite=False)


def test_file_among_the_parents_is_noticed(tmp_path: Path) -> None:
    (tmp_path / "house.ifc").touch()
    for name in ("house.ifc/plan", "house.ifc/plans/first/plan"):
        with pytest.raises(PlanFolderError, match=r"house\.ifc is not a folder"):
            check_output(tmp_path / name, overwrite=False)


def test_parents_that_are_not_there_are_made(tmp_path: Path) -> None:
    folder = tmp_path / "plans" / "first" / "plan"
    check_output(folder, overwrite=False)
    with atomic.staged_folder(folder, replace=False) as staging:
        (staging / "file").touch()
    assert (folder / "file").is_file()


@pytest.mark.parametrize("name", ["plan", "new/plan"])
@pytest.mark.parametrize("number", [errno.EACCES, errno.EROFS, errno.ENOENT])  # the last one of /proc
def test_parent_that_takes_no_files_is_noticed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, number: int
) -> None:
    """The tests may run as root, whom no permission stops: the system's refusal is made here."""

    def refuse(path: Path, *_: object, **__: object) -> int:
        raise OSError(number, os.strerror(number), str(path))

    monkeypatch.setattr(atomic.os, "open", refuse)
    with pytest.raises(PlanFolderError, match=rf"plan: can't be written \({os.strerror(number)}\).*permissions"):
        check_output(tmp_path / name, overwrite=False)
    monkeypatch.undo()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["x" * 240, f"{'y' * 300}/plan"])
def test_name_that_is_too_long_once_staged_is_noticed(tmp_path: Path, name: str) -> None:
    with pytest.raises(PlanFolderError, match="give a shorter name"):
        check_output(tmp_path / name, overwrite=False)
    assert list(tmp_path.iterdir()) == []


def test_check_of_a_target_leaves_nothing_behind(tmp_path: Path) -> None:
    for name in ("plan", "plans/first/plan"):
        atomic.check_writable(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_mount_point_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "plan").mkdir()
    monkeypatch.setattr(os.path, "ismount", lambda path: path == tmp_path / "plan")
    with pytest.raises(OutputExistsError, match="mounted"):
        check_output(tmp_path / "plan", overwrite=True)

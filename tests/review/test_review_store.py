"""The review on disk: kept once it is answered, whoever else writes, and whenever the process dies."""

from __future__ import annotations

import fcntl
import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest
from oldest_plan import floor, oldest_plan, station

from planner_core.errors import PlanFolderError, ReviewError
from planner_core.model import Review
from planner_core.plan_folder.atomic import locked_folder
from planner_core.plan_folder.folder import check_output
from planner_core.plan_folder.usd_stage import empty_review
from planner_core.review import changes as c
from planner_core.review import store as store_module
from planner_core.review.commit import Committed, Conflict
from planner_core.review.store import ReviewStore

PLAN = oldest_plan(
    floors=[floor("F0", 0.0)],
    stations=[station("S001", "F0", 1, [1.0, 2.0, 1.5])],
    registration={"threshold": 0.3, "connected": True, "links": []},
)

WRITER = """
import sys
from pathlib import Path
from planner_core.review import changes as c
from planner_core.review.commit import Committed
from planner_core.review.store import ReviewStore
store = ReviewStore(Path(sys.argv[1]))
store.current()
print("ready", flush=True)
sys.stdin.readline()
for number in range(int(sys.argv[3])):
    outcome = store.commit(0, [c.AddComment(f"{sys.argv[2]} {number}")], sys.argv[2])
    assert isinstance(outcome, Committed)
    print(number, outcome.review.revision, flush=True)
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    plan = tmp_path / "plan"
    plan.mkdir()
    (plan / "plan.json").write_text(json.dumps(PLAN))
    (plan / "review.usda").write_text(empty_review())
    return plan


def comments(folder: Path) -> set[str]:
    return {comment.text for comment in ReviewStore(folder).current().comments.values()}


def writer(folder: Path, name: str, n_commits: int) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", WRITER, str(folder), name, str(n_commits)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    return process


def begin(*processes: subprocess.Popen[str]) -> None:
    for process in processes:
        assert process.stdin is not None
        process.stdin.write("go\n")
        process.stdin.flush()


def test_what_is_committed_is_on_disk_for_every_other_store(folder: Path) -> None:
    outcome = ReviewStore(folder, clock=lambda: "2026-11-21T16:30:00Z").commit(0, [c.LockStation("S001")], "Ana")
    assert isinstance(outcome, Committed)
    assert ReviewStore(folder).current() == outcome.review
    assert outcome.review.touched["station:S001"].at == "2026-11-21T16:30:00Z"


def test_two_stores_of_one_folder_see_each_others_commits(folder: Path) -> None:
    one, other = ReviewStore(folder), ReviewStore(folder)
    assert one.current() == other.current() == Review()
    one.commit(0, [c.LockStation("S001")], "Ana")
    assert isinstance(other.commit(0, [c.UnlockStation("S001")], "Ben"), Conflict)
    assert other.commit(0, [c.AddComment("x")], "Ben").review.revision == 2
    assert one.current() == other.current()
    assert one.current().stations["S001"].locked


@pytest.mark.parametrize("n_answers", [4, *(pytest.param(n, marks=pytest.mark.slow) for n in (1, 9))])
def test_a_process_that_is_killed_loses_nothing_that_it_answered(folder: Path, n_answers: int) -> None:
    with writer(folder, "Ana", 10_000) as process:
        begin(process)
        assert process.stdout is not None
        for _ in range(n_answers):
            process.stdout.readline()
        time.sleep(0.003 * n_answers)
        os.kill(process.pid, signal.SIGKILL)
        answered = n_answers + len(process.stdout.readlines())
    found = comments(folder)
    assert {f"Ana {number}" for number in range(answered)} <= found
    assert found <= {f"Ana {number}" for number in range(answered + 1)}  # one may be kept that nobody was told of
    ReviewStore(folder).commit(0, [c.AddComment("after")], "Ben")
    assert sorted(path.name for path in folder.iterdir()) == ["plan.json", "review.usda"]


@pytest.mark.slow
def test_two_processes_that_write_at_once_lose_nothing(folder: Path) -> None:
    with writer(folder, "Ana", 25) as one, writer(folder, "Ben", 25) as other:
        begin(one, other)
        assert (one.wait(240), other.wait(240)) == (0, 0)  # fifty times the disk confirms: some take a second for it
    assert comments(folder) == {f"{name} {number}" for name in ("Ana", "Ben") for number in range(25)}
    assert ReviewStore(folder).current().revision == 50


def test_threads_of_one_store_and_of_two_lose_nothing(folder: Path) -> None:
    """Two stores share nothing but the lock of the folder, as two processes do."""
    shared, own = ReviewStore(folder), ReviewStore(folder)

    def write(store: ReviewStore, name: str) -> None:
        for number in range(5):
            store.commit(0, [c.AddComment(f"{name} {number}")], name)

    writers = [(shared, "Ana"), (shared, "Ben"), (own, "Carl")]
    threads = [threading.Thread(target=write, args=each) for each in writers]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert comments(folder) == {f"{name} {number}" for _, name in writers for number in range(5)}
    assert ReviewStore(folder).current().revision == 15


@pytest.mark.parametrize("content", [b"my own notes", b"#usda 1.0\nover", b"\xff\xfe#usda", b"x" * 2000])
def test_a_review_that_can_not_be_read_is_told_and_never_written_over(
    folder: Path, content: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store_module, "MOST_REVIEW_BYTES", 1000)
    (folder / "review.usda").write_bytes(content)
    store = ReviewStore(folder)
    with pytest.raises(PlanFolderError, match=r"review\.usda"):
        store.current()
    with pytest.raises(PlanFolderError, match=r"review\.usda.*rename it to begin a new[^:]*: nothing is deleted"):
        store.commit(0, [c.LockStation("S001")], "Ana")
    assert (folder / "review.usda").read_bytes() == content


def test_a_review_that_would_grow_too_large_is_refused_and_stays(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = ReviewStore(folder)
    store.commit(0, [c.AddComment("x" * 500)], "Ana")
    before = (folder / "review.usda").read_bytes()
    monkeypatch.setattr(store_module, "MOST_REVIEW_BYTES", len(before) + 400)
    with pytest.raises(ReviewError, match="remove comments"):
        store.commit(1, [c.AddComment("y" * 500)], "Ana")
    assert (folder / "review.usda").read_bytes() == before
    assert store.current().revision == 1


def test_a_failed_write_is_told_and_changes_nothing(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = ReviewStore(folder)
    store.commit(0, [c.AddComment("kept")], "Ana")

    def full(path: Path) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(store_module, "sync", full)
        with pytest.raises(PlanFolderError, match="No space left"):
            store.commit(1, [c.AddComment("lost")], "Ana")
    assert comments(folder) == {"kept"}
    assert store.commit(1, [c.AddComment("later")], "Ana").review.revision == 2


def test_a_folder_without_a_review_file_begins_one(folder: Path) -> None:
    (folder / "review.usda").unlink()
    store = ReviewStore(folder)
    assert store.current() == Review()
    store.commit(0, [c.AddComment("x")], "Ana")
    assert comments(folder) == {"x"}


def test_changes_made_on_a_plan_that_was_replaced_are_refused(folder: Path) -> None:
    store = ReviewStore(folder)
    shown = store.plan().sha256
    (folder / "plan.json").write_text(json.dumps({**PLAN, "seed": 7}))
    outcome = store.commit(0, [c.LockStation("S001")], "Ana", plan_sha256=shown)
    assert isinstance(outcome, Conflict)
    assert "replaced" in outcome.message
    assert isinstance(store.commit(0, [c.LockStation("S001")], "Ana", plan_sha256=store.plan().sha256), Committed)


@pytest.mark.parametrize("change", [{"stations": [{"id": "S001"}]}, {"floors": None}, {"scene": {"n_elements": "x"}}])
def test_a_plan_that_lacks_what_reviews_need_is_told(folder: Path, change: dict[str, Any]) -> None:
    (folder / "plan.json").write_text(json.dumps({**PLAN, **change}))
    with pytest.raises(PlanFolderError, match="plan again"):
        ReviewStore(folder).current()


def test_a_reviewed_plan_is_not_overwritten(folder: Path) -> None:
    check_output(folder, overwrite=True)
    store = ReviewStore(folder)
    store.commit(0, [c.AddComment("x")], "Ana")
    with pytest.raises(FileExistsError, match=r"review\.usda: holds reviewers' changes"):
        check_output(folder, overwrite=True)


def test_the_lock_is_that_of_the_folder_that_bears_the_name_when_it_is_got(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    has_old, order, lock = threading.Event(), [], fcntl.flock

    def telling(handle: int, how: int) -> None:
        if threading.current_thread() is thread:
            has_old.set()
        lock(handle, how)

    def second() -> None:
        with locked_folder(folder):
            order.append((folder / "which").read_text())
            handle = os.open(folder, os.O_RDONLY)
            with pytest.raises(BlockingIOError):
                lock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            os.close(handle)
            order.append("held")

    thread = threading.Thread(target=second)
    with locked_folder(folder):
        monkeypatch.setattr(fcntl, "flock", telling)
        thread.start()
        assert has_old.wait(120)
        folder.rename(tmp_path / "old")
        folder.mkdir()
        (folder / "which").write_text("new")
        order.append("first")
    thread.join(120)
    assert order == ["first", "new", "held"]


def test_the_lock_of_a_folder_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(PlanFolderError, match="No such file"), locked_folder(tmp_path / "gone"):
        pass

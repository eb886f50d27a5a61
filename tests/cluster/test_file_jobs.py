"""File jobs and who does them: nothing is lost, written twice, left behind, or waited for without end."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from dataclasses import dataclass
from importlib import invalidate_caches
from importlib.machinery import PathFinder
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from distributed import Client
from waiting import until

from planner_core.cluster import file_jobs, worker_files
from planner_core.cluster.file_jobs import FileJobDispatcher, Order, _Out, _pieces
from planner_core.cluster.payloads import Packer
from planner_core.cluster.worker import LackingError
from planner_core.errors import DeviceError
from planner_core.executor import Kept, NotWantedError, Outcome, Place, Task
from planner_core.progress import Progress, silent

from .conftest import cluster_of, threads


@dataclass(frozen=True)
class Writes:
    """A file job that writes its task into files of several folders."""

    def answer(self, task: Any, kept: Kept, progress: Progress = silent) -> bytes:
        if task == "fails":
            raise ValueError("fails")
        return b"same"

    def do(self, task: Any, place: Place) -> Outcome:
        (place.made / "deep").mkdir()
        (place.made / "deep" / "of").write_bytes(place.file(task).read_bytes() if len(task) == 64 else task.encode())
        (place.made / "empty").touch()
        return Outcome(answer=b"done")


def order_of(task: str, made: Path, **files: Path) -> Order:
    return Order(task, Packer().payload(Writes()), task, files, made)


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(file_jobs, "_WAIT_S", 0.05)


def test_folders_of_a_worker_hide_no_package() -> None:
    def package() -> tuple[list[str], str | None]:
        folder = worker_files._own_folder("any").parent
        invalidate_caches()
        found = PathFinder.find_spec("tlsplan", [str(folder.parent)])
        return [each.name for each in folder.iterdir()], None if found is None else str(found)

    with threads(1) as address, Client(address) as client:
        assert client.submit(package).result() == (["any"], None)


@pytest.mark.parametrize("size", [0, 1, 4, 5, 8, 11])
def test_files_go_in_pieces_of_which_one_is_the_last(
    size: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(worker_files, "PIECE_BYTES", 4)
    content = bytes(range(size))
    (tmp_path / "file").write_bytes(content)
    pieces = list(_pieces(tmp_path / "file", hashlib.sha256(content).hexdigest()))
    assert b"".join(piece for piece, _ in pieces) == content
    assert [is_last for _, is_last in pieces] == [False] * (len(pieces) - 1) + [True]
    assert max(len(piece) for piece, _ in pieces) <= 4


def test_a_file_that_changed_or_is_gone_fails_its_file_job_and_no_other(tmp_path: Path) -> None:
    digest = hashlib.sha256(b"before").hexdigest()
    (tmp_path / "changed").write_bytes(b"after")
    (tmp_path / "sound").write_bytes(b"before")
    found: dict[Any, Outcome] = {}
    with cluster_of(1) as (cluster, told):
        given = FileJobDispatcher(cluster, lambda address: True)
        for name in ("changed", "gone", "sound"):
            order = order_of(digest, tmp_path / f"made-{name}", **{digest: tmp_path / name})
            given.give(Order(name, order.payload, digest, order.files, order.made))
        until(lambda: found.update({order.key: outcome for order, outcome in given.done()}) or len(found) == 3)
        given.stop()
    assert "changed: changed meanwhile" in found["changed"].message
    assert "gone: can't be read" in found["gone"].message
    assert found["sound"] == Outcome(answer=b"done")
    assert (tmp_path / "made-sound" / "deep" / "of").read_bytes() == b"before"
    assert (tmp_path / "made-sound" / "empty").read_bytes() == b""
    assert sorted(path.name for path in tmp_path.glob("made-*")) == ["made-sound"]
    assert told == []


def test_what_is_no_longer_wanted_is_not_written(tmp_path: Path) -> None:
    out = _Out(order_of("a", tmp_path / "made"), "worker")
    with out.writing():
        out.made.mkdir(parents=True)
    out.end()
    with pytest.raises(NotWantedError), out.writing():
        out.made.mkdir(parents=True)
    assert list(tmp_path.iterdir()) == []


def test_a_file_job_over_which_workers_are_lost_is_given_up_in_a_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(self: FileJobDispatcher, out: _Out) -> Outcome:
        raise TimeoutError("whatever")

    monkeypatch.setattr(FileJobDispatcher, "_attend", fails)
    found: list[tuple[Order, Outcome]] = []
    with cluster_of(2) as (cluster, _):
        given = FileJobDispatcher(cluster, lambda address: True)
        given.give(order_of("a", tmp_path / "made"))
        until(lambda: found.extend(given.done()) or found)
        given.stop()
        assert cluster.n_bugs == 0
    assert found[0][1].message == "3 workers were lost over it (whatever); run the same command to try again"
    assert given.orders() == {}


def done_and_left(given: FileJobDispatcher) -> tuple[dict[Any, Outcome], list[Any]]:
    """What is done of file jobs, and what is left to this process."""
    found: dict[Any, Outcome] = {}

    def look() -> list[Order] | None:
        found.update({order.key: outcome for order, outcome in given.done()})
        return given.left_alone()

    left = [order.key for order in until(look)]
    given.stop()
    return found, left


@pytest.mark.parametrize("where", ["over a worker", "while it deals"])
def test_a_bug_here_is_told_and_this_machine_does_what_is_left(
    where: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*of: Any) -> Any:
        raise KeyError("whatever")

    monkeypatch.setattr(FileJobDispatcher, "_attend" if where == "over a worker" else "_dispatch", fails)
    with cluster_of(2) as (cluster, told):
        given = FileJobDispatcher(cluster, lambda address: True)
        given.give(order_of("a", tmp_path / "made"))
        assert done_and_left(given) == ({}, ["a"])
        assert cluster.n_bugs == (2 if where == "over a worker" else 1)
    bug, alone = told
    who = "worker inproc://" if where == "over a worker" else "this machine: "
    assert bug.startswith(who)
    assert "internal error: KeyError: 'whatever' (" in bug
    assert f"in {'fails' if where == 'over a worker' else 'done'}). This is a bug: please report it" in bug
    assert alone == "no worker can do this: this machine goes on alone"


@pytest.mark.parametrize("error", [KeyError("odd"), RuntimeError("odd"), SystemExit("odd")])
def test_a_file_job_at_which_a_bug_strikes_is_left_to_this_machine_and_others_go_on(
    error: BaseException, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of five workers three fail at it: the others do the rest."""
    sound = Writes.do

    def do(self: Writes, task: Any, place: Place) -> Outcome:
        if task == "odd":
            raise error
        return sound(self, task, place)

    monkeypatch.setattr(Writes, "do", do)
    with cluster_of(5) as (cluster, told):
        given = FileJobDispatcher(cluster, lambda address: True)
        for name in ("odd", "a", "b", "c", "d", "e"):
            given.give(order_of(name, tmp_path / name))
        found, left = done_and_left(given)
        assert cluster.n_bugs == 3
        (last,) = cluster.last_words()
    assert (sorted(found), left) == (["a", "b", "c", "d", "e"], ["odd"])
    assert {outcome.message for outcome in found.values()} == {""}
    bug, alone = told
    assert f"internal error: {type(error).__name__}: " in bug
    assert " (planner_core.cluster.worker_files:" in bug
    assert ", in work). This is a bug: please report it" in bug
    assert "no worker can do what is left" in alone
    assert "3 internal errors, reported above" in last
    assert not list(tmp_path.glob("odd*"))


@pytest.mark.parametrize("error", [DeviceError("no device"), MemoryError("no room"), ImportError("no package")])
def test_a_file_job_for_which_a_worker_lacks_something_goes_to_another(
    error: Exception, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sound, n_done = Writes.do, 0

    def do(self: Writes, task: Any, place: Place) -> Outcome:
        nonlocal n_done
        n_done += 1
        if n_done == 1:
            raise error
        return sound(self, task, place)

    monkeypatch.setattr(Writes, "do", do)
    found: list[tuple[Order, Outcome]] = []
    with cluster_of(2) as (cluster, told):
        given = FileJobDispatcher(cluster, lambda address: True)
        given.give(order_of("a", tmp_path / "made"))
        until(lambda: found.extend(given.done()) or found)
        given.stop()
        assert cluster.last_words() == []
    assert found[0][1] == Outcome(answer=b"done")
    (line,) = told
    assert line.endswith(f"is not used: {error}; what it had is given to others")


def test_a_file_job_that_nobody_asked_about_for_long_is_gone_for_whoever_asks_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It ends by what tells it, which is no bug, and its lease is not renewed."""
    monkeypatch.setattr(worker_files, "_own_folder", lambda name: tmp_path)
    held: list[Place] = []

    class Waits:
        def do(self, task: Any, place: Place) -> Outcome:
            held.append(place)
            until(lambda: not place.is_wanted())
            raise NotWantedError

    monkeypatch.setattr(worker_files, "job_of", lambda digest: Waits())
    worker_files.begin("1", "digest", None)
    until(lambda: held)
    assert worker_files.state("1", 0.0).outcome is None
    monkeypatch.setattr(worker_files, "LEASE_S", 0.0)
    with pytest.raises(LackingError):
        worker_files.state("1", 0.0)
    until(lambda: "1" not in worker_files._going and not held[0].folder.exists())


def dealt(
    monkeypatch: pytest.MonkeyPatch, folder: Path, *, most: int | None
) -> tuple[FileJobDispatcher, Callable[[], list[str]]]:
    """File jobs of which two are out for long, and who has one after another look."""
    monkeypatch.setattr(file_jobs, "_LONG_S", -1.0)
    given = FileJobDispatcher(SimpleNamespace(), lambda address: True, most=most)  # type: ignore[arg-type]
    monkeypatch.setattr(given, "_send", lambda order, address: given._out.append(_Out(order, address)))
    given._pool.used.update(("w1", "w2"))
    for name in ("a", "b"):
        given.give(order_of(name, folder / name))

    def look() -> list[str]:
        given._dispatch()
        return sorted(out.address for out in given._out)

    assert look() == ["w1", "w2"]
    return given, look


def test_idle_workers_get_copies_once_no_new_file_job_came(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given, look = dealt(monkeypatch, tmp_path, most=None)
    given._pool.used.update(("w3", "w4"))
    assert look() == ["w1", "w2"]
    given.give(order_of("c", tmp_path / "c"))
    assert look() == ["w1", "w2", "w3", "w4"]
    assert sorted(out.order.key for out in given._out if out.address in ("w3", "w4"))[1] == "c", "one of the two"


def test_copies_keep_to_the_most_at_the_same_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given, look = dealt(monkeypatch, tmp_path, most=2)
    given._pool.used.add("w3")
    assert [look(), look()] == [["w1", "w2"]] * 2
    given._out.pop()
    assert given.free() == 1


def test_what_a_task_raises_here_after_all_workers_failed_comes_out() -> None:
    def here(task: Any) -> bytes:
        if task == "fails":
            raise ValueError("here, too")
        return b"same"

    tasks = [Task("first", 1), Task("fails", 1), Task("other", 1)]
    with cluster_of(1) as (cluster, _), pytest.raises(ValueError, match="here, too"):
        cluster.answers(Writes(), tasks, here=here, stage="scan", progress=silent)


def test_files_that_were_just_needed_stay_where_there_are_too_many(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(worker_files, "_own_folder", lambda name: tmp_path)
    monkeypatch.setattr(worker_files, "_MOST_FILE_BYTES", 2)
    for name, age_s in (("old", 1000), ("needed", 1000), ("young", 0)):
        (tmp_path / name).write_bytes(b"x")
        now_s = (tmp_path / name).stat().st_mtime
        os.utime(tmp_path / name, (now_s - age_s, now_s - age_s))
    assert worker_files.lacks_files(["needed", "other"]) == ["other"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["needed", "young"]
    assert worker_files.lacks_files([]) == []
    assert sorted(path.name for path in tmp_path.iterdir()) == ["needed", "young"], "it was asked for a moment ago"

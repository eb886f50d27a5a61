"""What is kept between commands: never another result than without it, whatever happens to the files."""

from __future__ import annotations

import errno
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import scenes_synthetic
from planner_core import kept as kept_results
from planner_core.errors import EnvironmentVariableError
from planner_core.kept import Shelf, forget_kept, hash_of, hash_of_scene, kept, use_of_kept
from planner_core.model import Element, Visibility
from planner_core.progress import silent
from planner_core.scene import isolated_readers
from planner_core.scene.isolated_readers import read_apart
from planner_core.scene.raw import RawScene

ROWS = Visibility(np.array([0, 2, 3]), np.array([4, 7, 4], dtype=np.int32), 9)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where results are kept, up to 1 MB."""
    monkeypatch.setenv("TLSPLAN_CACHE", str(tmp_path))
    monkeypatch.setenv("TLSPLAN_CACHE_SIZE", "1MB")
    monkeypatch.setattr(kept_results, "_n_written", float("inf"))
    monkeypatch.setattr(kept_results, "_written_s", 0.0)
    return tmp_path / "results"


class Counted:
    """Computes rows, and counts how often."""

    def __init__(self) -> None:
        self.n = 0

    def __call__(self) -> Visibility:
        self.n += 1
        return ROWS

    def kept(self, *inputs: object) -> Visibility:
        return kept("rows", inputs, self, classes=(Visibility,))


def is_same(a: Visibility, b: Visibility) -> bool:
    arrays = zip((a.starts, a.patch), (b.starts, b.patch), strict=True)
    return a.n_patches == b.n_patches and all(x.dtype == y.dtype and np.array_equal(x, y) for x, y in arrays)


def test_a_result_is_computed_once_and_again_where_an_input_differs(folder: Path) -> None:
    made = Counted()
    assert all(is_same(made.kept("a", np.arange(3.0)), ROWS) for _ in range(3))
    assert made.n == 1
    made.kept("a", np.arange(3.0, dtype=np.float32))
    made.kept("a", np.arange(3.0)[:, None])
    made.kept("a", replace(ROWS, n_patches=10))
    assert made.n == 4


@pytest.mark.parametrize("damage", ["flipped", "cut off", "empty", "a foreign file", "of another result"])
def test_a_damaged_file_counts_as_none_and_is_replaced(folder: Path, damage: str) -> None:
    made = Counted()
    made.kept("a")
    (path,) = folder.iterdir()
    whole = path.read_bytes()
    if damage == "of another result":
        made.kept("b")
        other = next(each for each in folder.iterdir() if each != path)
        path.write_bytes(other.read_bytes())
    else:
        at = len(whole) - 5
        flipped = whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :]
        path.write_bytes({"flipped": flipped, "cut off": whole[:at], "empty": b""}.get(damage, b"PK" + whole))
    n = made.n
    assert is_same(made.kept("a"), ROWS)
    assert made.n == n + 1
    assert path.read_bytes() == whole


def test_other_sources_find_nothing(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = Counted()
    made.kept("a")
    monkeypatch.setattr(kept_results, "code_hash", lambda: "other")
    made.kept("a")
    assert made.n == 2


def test_those_not_used_for_longest_go_first_and_those_of_killed_writers_too(folder: Path) -> None:
    shelf = Shelf("block", [])
    for number in range(5):
        shelf.put(np.full(190_000, number, dtype=np.uint8), bytes([number]))
        for path in folder.iterdir():
            os.utime(path, (path.stat().st_mtime - 10, path.stat().st_mtime - 10))
    assert shelf.find(bytes([0])) is not None  # which is a use
    left = folder / ".left"
    left.write_bytes(bytes(100_000))
    os.utime(left, (1.0, 1.0))
    shelf.put(np.zeros(190_000, dtype=np.uint8), b"new")
    there = [number for number in range(5) if shelf.find(bytes([number])) is not None]
    assert there == [0, 2, 3, 4]
    assert not left.exists()
    assert use_of_kept().n_bytes <= 1_000_000
    shelf.put(np.zeros(300_000, dtype=np.uint8), b"large")  # more than a quarter of all
    assert shelf.find(b"large") is None
    forget_kept()
    assert use_of_kept().n_files == 0


@pytest.mark.parametrize("size, keeps", [("0", False), ("5MB", True)])
def test_the_size_says_whether_anything_is_kept(
    folder: Path, monkeypatch: pytest.MonkeyPatch, size: str, keeps: bool
) -> None:
    monkeypatch.setenv("TLSPLAN_CACHE_SIZE", size)
    made = Counted()
    made.kept("a"), made.kept("a")
    assert (made.n, folder.exists()) == (1 if keeps else 2, keeps)
    monkeypatch.setenv("TLSPLAN_CACHE_SIZE", "much")
    with pytest.raises(EnvironmentVariableError, match=r"TLSPLAN_CACHE_SIZE: got 'much', expected a size .* or 0"):
        made.kept("a")


@pytest.mark.parametrize("fault", ["full disk", "a file in its place", "no home"])
def test_a_folder_that_takes_nothing_is_no_error(folder: Path, monkeypatch: pytest.MonkeyPatch, fault: str) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    if fault == "full disk":
        monkeypatch.setattr(Path, "replace", full)
    elif fault == "a file in its place":
        folder.write_text("")
    else:
        for variable in ("TLSPLAN_CACHE", "XDG_CACHE_HOME", "HOME"):
            monkeypatch.delenv(variable, raising=False)
    made = Counted()
    assert is_same(made.kept("a"), ROWS) and is_same(made.kept("a"), ROWS)
    assert made.n == 2
    assert not folder.is_dir() or not [*folder.iterdir()]


def test_a_slow_disk_is_left_alone_after_a_while(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    monkeypatch.setattr(kept_results, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    monkeypatch.setattr(kept_results, "_LOADED_S", 0.0)
    monkeypatch.setattr(kept_results, "_written_s", 0.0)
    write = kept_results._write

    def slow(*arguments: Any) -> None:
        clock[0] += 0.3
        write(*arguments)

    monkeypatch.setattr(kept_results, "_write", slow)
    made = Counted()
    for name in "abcdefgh":
        made.kept(name)
    assert len([*folder.iterdir()]) == 4  # 1.2 s of writing, where 1 s and a tenth of 1.2 s may be
    clock[0] += 10.0  # of other work
    made.kept("i")
    assert len([*folder.iterdir()]) == 5


def test_writers_of_the_same_result_at_the_same_time_leave_one_sound_file(folder: Path) -> None:
    shelf, block = Shelf("block", []), np.arange(20_000, dtype=np.int64)
    with ThreadPoolExecutor(8) as pool:
        done = [pool.submit(shelf.put, block) for _ in range(40)]
        read = [pool.submit(shelf.find) for _ in range(40)]
    assert all(each.exception() is None for each in done)
    found = [each.result() for each in read]
    assert all(each is None or np.array_equal(each, block) for each in found)
    assert np.array_equal(shelf.find(), block)
    assert len([*folder.iterdir()]) == 1


def test_the_hash_of_a_scene_is_of_what_is_built_and_not_of_where_its_file_lies() -> None:
    scene = scenes_synthetic.build("box").scene
    moved = replace(scene, source=replace(scene.source, path=Path("elsewhere.ifc"), sha256="0"))
    assert hash_of_scene(moved) == hash_of_scene(scene)
    shut = replace(scene, source=replace(scene.source, doors="outside"))
    higher = replace(scene, vertices_m=scene.vertices_m + np.array([0.0, 0.0, 1.0]))
    assert len({hash_of_scene(each) for each in (scene, shut, higher)}) == 3


def test_a_file_that_changes_while_it_is_read_is_not_kept(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, n_read = tmp_path / "box.ifc", 0
    path.write_text("ISO-10303-21;")
    raw = RawScene(np.zeros((3, 3)), *np.zeros((3, 1), dtype=np.int64), elements=(Element("Wall", "IfcWall", "0"),))

    def read(*_: object) -> RawScene:
        nonlocal n_read
        n_read += 1
        if n_read == 1:
            path.write_text("ISO-10303-21; another")
        return raw

    monkeypatch.setattr(isolated_readers, "_read_apart", read)
    found = [read_apart(path, "ifc", skip_bad_faces=False, progress=silent) for _ in range(3)]
    assert n_read == 2
    assert [hash_of(each) for each in found] == 3 * [hash_of(raw)]

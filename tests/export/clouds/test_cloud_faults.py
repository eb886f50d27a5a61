"""Clouds that can't be finished: interrupts, a full disk; and that memory does not grow with the number of beams."""

import resource
import tracemalloc
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cloud_room import edited_plan

from planner_core.engine.open_engine import open_engine
from planner_core.errors import ExportError
from planner_core.export.clouds.e57 import _E57
from planner_core.export.clouds.points import STAGE
from planner_core.export.formats import FORMATS
from planner_core.export.options import Options
from planner_core.export.write import export_plan
from planner_core.plan_folder.plan_source import FieldStation, PlanSource, open_plan
from planner_core.progress import ProgressEvent


@pytest.fixture(autouse=True)
def quick_to_start(monkeypatch: pytest.MonkeyPatch) -> None:
    """Open3D has nothing to build; who casts the beams does not matter here."""
    engine = partial(open_engine, engine="open3d")
    monkeypatch.setattr("planner_core.export.clouds.points.open_engine", engine)


NAMES = ("e57", "e57-split", "las", "laz", "laz-split", "ply", "ply-split", "exr")


class Interrupter:
    """Stops the work like Ctrl-C does, after some blocks."""

    def __init__(self, after: int) -> None:
        self.left = after

    def __call__(self, event: ProgressEvent) -> None:
        self.left -= event.stage == STAGE
        if self.left < 0:
            raise KeyboardInterrupt


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_an_interrupted_cloud_leaves_nothing_behind(
    source: PlanSource, tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("planner_core.export.clouds.points._BLOCK_BEAMS", 8 * 400)
    target = tmp_path / FORMATS[name].file_name
    for after in (0, 4, 11):  # at once, within the first station, within the second
        with pytest.raises(KeyboardInterrupt):
            export_plan(name, source, target, progress=Interrupter(after))
        assert list(tmp_path.iterdir()) == []
    export_plan(name, source, target, Options(max_points=100))
    assert [path.name for path in tmp_path.iterdir()] == [target.name]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_an_interrupted_cloud_leaves_the_older_one_as_it_was(source: PlanSource, tmp_path: Path, name: str) -> None:
    def contents() -> dict[str, bytes]:
        return {str(path): path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}

    target = tmp_path / FORMATS[name].file_name
    export_plan(name, source, target, Options(max_points=100))
    before = contents()
    with pytest.raises(KeyboardInterrupt):
        export_plan(name, source, target, overwrite=True, progress=Interrupter(1))
    assert contents() == before


def test_an_e57_interrupted_before_its_first_point_ends_cleanly(
    source: PlanSource, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a writer open that nobody could close yet, cancelling the file would end the process."""

    def interrupted(self: _E57, scan: Any, station: FieldStation) -> None:
        node = self._lib.CompressedVectorNode(self._file, self._prototype(), self._lib.VectorNode(self._file, True))
        scan.set("points", node)
        writer = node.writer(self._buffers(10)[1])
        assert writer.isOpen()
        raise KeyboardInterrupt

    monkeypatch.setattr(_E57, "_points", interrupted)
    with pytest.raises(KeyboardInterrupt):
        export_plan("e57", source, tmp_path / "x.e57")
    assert list(tmp_path.iterdir()) == []


class FullDisk:
    """From some block on no file can be longer than some bytes, as on a disk without space.

    Not from the start: what scans may write files of its own then. Python ignores the signal that comes with the limit.
    """

    def __init__(self, after: int, n_bytes: int) -> None:
        self._left, self._n_bytes = after, n_bytes
        self._before = resource.getrlimit(resource.RLIMIT_FSIZE)

    def __call__(self, event: ProgressEvent) -> None:
        self._left -= event.stage == STAGE
        if self._left < 0:
            resource.setrlimit(resource.RLIMIT_FSIZE, (self._n_bytes, self._before[1]))

    def end(self) -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, self._before)


@pytest.fixture
def disk_full_from() -> Iterator[Callable[[int, int], FullDisk]]:
    disks: list[FullDisk] = []

    def make(after: int, n_bytes: int) -> FullDisk:
        disks.append(FullDisk(after, n_bytes))
        return disks[-1]

    yield make
    for disk in disks:
        disk.end()


@pytest.mark.parametrize(
    ("name", "after", "room"),
    [
        *((name, 3, 80_000) for name in NAMES),
        *((name, 0, 0) for name in ("e57", "laz", "ply-split")),
        *((name, 12, 100) for name in ("e57-split", "las", "ply", "exr")),
    ],
)
def test_a_full_disk_is_told_in_one_line_and_leaves_nothing(
    source: PlanSource,
    tmp_path: Path,
    name: str,
    after: int,
    room: int,
    disk_full_from: Callable[[int, int], FullDisk],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("planner_core.export.clouds.points._BLOCK_BEAMS", 8 * 400)
    target = tmp_path / FORMATS[name].file_name
    disk = disk_full_from(after, room)
    with pytest.raises(ExportError) as caught:
        export_plan(name, source, target, progress=disk)
    disk.end()
    assert "can't be written" in str(caught.value)
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "noise"),
    [
        ("e57", False),
        pytest.param("las", True, marks=pytest.mark.slow),
        pytest.param("ply", False, marks=pytest.mark.campaign),
        pytest.param("exr", False, marks=pytest.mark.campaign),
        pytest.param("laz", False, marks=pytest.mark.slow),
    ],
)
def test_memory_does_not_grow_with_the_number_of_beams(
    plan_folder: Path, tmp_path: Path, name: str, noise: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    n_columns, n_few, n_many = 60, 3_000, 6_000  # previews of either have 1500 rows
    monkeypatch.setattr("planner_core.export.clouds.points._BLOCK_BEAMS", 125 * n_columns)  # 1000 rows are cast
    peak = []
    for n_rows in (n_few, n_few, n_many):  # the first one pays for what is loaded and built once
        rows = np.deg2rad(np.linspace(90, -60, n_rows)).tolist()
        folder = edited_plan(plan_folder, tmp_path / f"{len(peak)}", elevation_rad=rows, n_azimuths=n_columns)
        source = open_plan(folder)
        source.survey()
        tracemalloc.start()
        export_plan(name, source, tmp_path / f"{len(peak)}.{name}", Options(noise=noise, stations=("S001",)))
        peak.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    # Any array of the whole scan has at least a byte a beam; a row has an elevation, and some texts of it.
    n_more_bytes = peak[2] - peak[1]
    assert n_more_bytes < (n_many - n_few) * (n_columns / 2 + 100)

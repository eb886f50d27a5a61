"""The shape of beam tiles: what was measured on a device is used there, and nothing in a file can break a scan."""

import json
import os
import re
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tlsplan import environment, start_time
from tlsplan.commands import doctor, tune

from planner_core.cache import cache_folder
from planner_core.device import Device, check, choice, list_devices, open_device, runtime, sources
from planner_core.engine import tuning
from planner_core.engine.opencl import OpenCLEngine
from planner_core.engine.tuning import (
    ShapeTimes,
    is_possible,
    keep_shape,
    measure_shapes,
    shape_file,
    shape_in_use,
    shapes_to_try,
    tile_shape,
    use_shape,
)
from planner_core.errors import DeviceError, RequirementError
from planner_core.model import BeamTemplate, Patches, Scene
from planner_core.progress import ProgressEvent
from planner_core.scanner import load_scanner

OTHER = (4, 16, 4)


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A cache folder of the test's own; what the process remembers of files is forgotten before and after.

    No verdict on the device is in it, and none is needed: that costs a process (test_device_check.py).
    """
    monkeypatch.setenv("TLSPLAN_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(check, "problem_of", lambda device, index, anew=False: "")
    sources.kernels_hash.cache_clear()
    tuning._read.cache_clear()
    yield tmp_path / "cache"
    tuning._read.cache_clear()


def test_without_a_measurement_the_shipped_shape_is_used_and_said_to_be(device: Device) -> None:
    used = shape_in_use(device)
    assert used.origin == "shipped"
    assert "tlsplan tune" in used.detail
    assert is_possible(used.shape)
    assert tile_shape(device) == used.shape


def test_a_measured_shape_is_used_from_then_on(device: Device, cache: Path) -> None:
    file = keep_shape(device, OTHER, {"4 x 16": 1.23456789})
    assert file.parent == cache
    used = shape_in_use(device)
    assert (used.shape, used.origin) == (OTHER, "measured")
    assert str(file) in used.detail
    document = json.loads(file.read_text(encoding="utf-8"))
    assert document["milliseconds"] == {"4 x 16": 1.2346}
    assert [path.name for path in cache.iterdir()] == [file.name], "nothing is left beside the file"
    tuning._read.cache_clear()
    assert tile_shape(open_device()) == OTHER, "as a fresh process finds it"


def test_packets_that_are_too_wide_here_are_not_taken(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(device, "max_lanes", 16)
    file = keep_shape(device, (4, 64, 16), {})
    assert tile_shape(device) == (4, 64, 16)
    monkeypatch.setattr(device, "max_lanes", 8)
    used = shape_in_use(device)
    assert (used.shape, used.origin) == ((8, 64, 8), "shipped")
    assert f"packets of 16, which {file} keeps" in used.detail
    assert all(lanes <= 8 for _, _, lanes in shapes_to_try(device))


@pytest.mark.parametrize("part", ["name", "driver", "n_compute_units"])
def test_another_device_or_driver_does_not_take_it(device: Device, monkeypatch: pytest.MonkeyPatch, part: str) -> None:
    keep_shape(device, OTHER, {})
    monkeypatch.setattr(device, part, 99 if part == "n_compute_units" else "other")
    assert shape_in_use(device).origin == "shipped"


def test_other_kernels_do_not_take_it(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    keep_shape(device, OTHER, {})
    monkeypatch.setattr(runtime, "kernels_hash", lambda: "0" * 16)
    assert shape_in_use(device).origin == "shipped"


def test_the_hash_is_that_of_every_kernel_source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.cl").write_text("one")
    (tmp_path / "b.h").write_text("two")
    monkeypatch.setattr(sources.resources, "files", lambda _: tmp_path)
    seen = set()
    for change in (None, ("a.cl", "three"), ("b.h", "four"), ("c.cl", "five"), ("README.md", "no kernel")):
        if change is not None:
            (tmp_path / change[0]).write_text(change[1])
        seen.add(sources.kernels_hash.__wrapped__())
    assert len(seen) == 4


def shape_document(**changes: object) -> str:
    good = {"schema": "tlsplan/tile-shape/1", "tile_rows": 4, "tile_columns": 16, "lanes": 4}
    return json.dumps({**good, **changes})


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        "null",
        "\x00\xff",
        shape_document(schema="tlsplan/tile-shape/2"),
        shape_document(lanes=3),
        shape_document(lanes=16),
        shape_document(lanes=True),
        shape_document(lanes="4"),
        shape_document(tile_rows=0),
        shape_document(tile_rows=-4),
        shape_document(tile_columns=15),
        shape_document(tile_columns=None),
        shape_document(tile_rows=4096),
        shape_document(tile_rows=1, tile_columns=4),
    ],
)
def test_a_file_that_holds_no_shape_counts_as_none(device: Device, text: str) -> None:
    file = shape_file(device)
    assert file is not None
    file.parent.mkdir(parents=True)
    file.write_text(text, encoding="latin-1")
    used = shape_in_use(device)
    assert used.origin == "shipped"
    assert str(file) in used.detail
    assert "\n" not in used.detail


def test_a_folder_in_the_place_of_the_file_counts_as_none(device: Device) -> None:
    file = shape_file(device)
    assert file is not None
    file.mkdir(parents=True)
    assert shape_in_use(device).origin == "shipped"
    with pytest.raises(RequirementError, match="TLSPLAN_CACHE"):
        keep_shape(device, OTHER, {})


def test_a_shape_that_does_not_build_is_not_kept(device: Device, cache: Path) -> None:
    with pytest.raises(RequirementError, match="tile shape"):
        keep_shape(device, (3, 5, 4), {})
    assert not cache.exists()


@pytest.mark.parametrize(
    ("variables", "expected"),
    [
        ({"TLSPLAN_CACHE": "/a/b", "XDG_CACHE_HOME": "/c", "HOME": "/d"}, Path("/a/b")),
        ({"XDG_CACHE_HOME": "/c", "HOME": "/d"}, Path("/c/tlsplan")),
        ({"XDG_CACHE_HOME": "relative", "HOME": "/d"}, Path("/d/.cache/tlsplan")),
        ({"HOME": "/d"}, Path("/d/.cache/tlsplan")),
        ({}, None),
    ],
)
def test_the_cache_folder_follows_the_environment(
    monkeypatch: pytest.MonkeyPatch, device: Device, variables: dict[str, str], expected: Path | None
) -> None:
    for name in ("TLSPLAN_CACHE", "XDG_CACHE_HOME", "HOME"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert cache_folder() == expected
    if expected is None:
        assert shape_in_use(device).origin == "shipped"
        with pytest.raises(RequirementError, match="cache folder"):
            keep_shape(device, OTHER, {})


def test_a_given_shape_goes_before_all_others_and_ends_with_its_block(device: Device) -> None:
    keep_shape(device, OTHER, {})
    with use_shape((8, 8, 1)):
        assert tile_shape(device) == (8, 8, 1)
        with use_shape((8, 32, 8)):
            assert tile_shape(device) == (8, 32, 8)
        assert tile_shape(device) == (8, 8, 1)
    assert tile_shape(device) == OTHER
    with pytest.raises(RequirementError), use_shape((1, 1, 1)):
        pass


@given(st.integers(1, 20), st.integers(1, 80), st.sampled_from([1, 2, 4, 8, 16]))
def test_possible_shapes_are_those_whose_packets_come_in_eights(rows: int, columns: int, lanes: int) -> None:
    packets = rows * (columns / lanes)
    assert is_possible((rows, columns, lanes)) == (columns % lanes == 0 and packets % 8 == 0)


@pytest.mark.parametrize("kind", ["cpu", "gpu", "other"])
def test_shapes_to_try_can_all_be_built_and_begin_with_the_shipped_one(
    device: Device, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    monkeypatch.setattr(device, "kind", kind)
    shapes = shapes_to_try(device)
    assert shapes[0] == shape_in_use(device).shape
    assert len(set(shapes)) == len(shapes) >= 10
    assert all(is_possible(shape) for shape in shapes)


# --------------------------------------------------------------------------------------------------- measuring
TEMPLATE = BeamTemplate(np.arange(64) * (np.pi / 32), np.linspace(0.4, -0.4, 8), 0.0, 100.0)


def test_measuring_times_every_shape_and_finds_the_one_that_is_clearly_fastest(device: Device) -> None:
    engine = SimpleNamespace(device="idle", visible_patches=lambda *_: None)
    shapes = ((8, 32, 8), (4, 16, 4), (8, 8, 1))
    seconds = {(8, 32, 8): 4.0, (4, 16, 4): 1.0, (8, 8, 1): 3.0}
    now = [0.0]
    asked: list[tuple[int, int, int]] = []

    def clock() -> float:
        """Every second reading is later by what the shape is said to take, the first round by a disturbance more."""
        asked.append(tile_shape(device))
        if len(asked) % 2 == 0:
            now[0] += seconds[asked[-1]] + (100.0 if len(asked) <= 6 else 0.0)
        return now[0]

    events: list[ProgressEvent] = []
    times = measure_shapes(engine, TEMPLATE, np.zeros((2, 3)), shapes, n_rounds=2, clock=clock, progress=events.append)
    assert times.milliseconds == {shape: 1e3 * seconds[shape] / 2 for shape in shapes}
    assert times.best() == (4, 16, 4)
    assert times.refused == {}
    assert [(event.done, event.total) for event in events] == [(n, 6) for n in range(1, 7)]


def test_the_first_shape_stays_where_no_other_is_clearly_faster() -> None:
    assert ShapeTimes({(8, 32, 8): 1.0, (4, 16, 4): 0.99}, {}).best() == (8, 32, 8)
    assert ShapeTimes({(8, 32, 8): 1.0, (4, 16, 4): 0.9}, {}).best() == (4, 16, 4)


class Picky:
    """An engine on a device whose compiler takes one packet width only."""

    name, device, warnings = "opencl", "picky", ()

    def __init__(self, on: Device, lanes: int) -> None:
        self._on, self._lanes = on, lanes

    def visible_patches(self, *_: object) -> None:
        if tile_shape(self._on)[2] != self._lanes:
            raise DeviceError("scan_tiles.cl does not build")


def test_shapes_that_do_not_build_are_left_out_and_named(device: Device) -> None:
    times = measure_shapes(Picky(device, 4), TEMPLATE, np.zeros((1, 3)), ((8, 32, 8), OTHER))
    assert list(times.milliseconds) == [OTHER]
    assert times.best() == OTHER
    assert times.refused == {(8, 32, 8): "scan_tiles.cl does not build"}
    with pytest.raises(DeviceError, match="none of 2 tile shapes"):
        measure_shapes(Picky(device, 1), TEMPLATE, np.zeros((1, 3)), ((8, 32, 8), OTHER))


def test_scans_are_the_same_with_a_shape_that_was_kept(device: Device, room: tuple[Scene, Patches]) -> None:
    at = np.array([[0.1, 0.2, 0.3]])
    shipped = OpenCLEngine(*room, device).scan(TEMPLATE, at)
    keep_shape(device, OTHER, {})
    kept = OpenCLEngine(*room, device).scan(TEMPLATE, at)
    for name, value in vars(shipped).items():
        np.testing.assert_array_equal(getattr(kept, name), value)


# ------------------------------------------------------------------------------------------------ as a user
def test_tune_refuses_to_measure_what_it_can_not_keep(
    command: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    # Nobody, root included, can make a folder below /proc.
    for name in ("XDG_CACHE_HOME", "XDG_CONFIG_HOME", "MPLCONFIGDIR", "TLSPLAN_CACHE"):
        monkeypatch.setenv(name, "")
    monkeypatch.setenv("HOME", "/proc/self")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))  # where caches go then
    for name in ("_caches_are_kept", "_own_caches"):  # of the process: as before the next test
        monkeypatch.setattr(environment, name, getattr(environment, name))
    code, _, err = command("tune", "-q")
    assert code == 4
    assert "TLSPLAN_CACHE" in err
    assert err.count("\n") == 1


@pytest.mark.parametrize("is_set", [True, False])
def test_tune_refuses_a_cache_that_can_not_be_written_before_it_measures(
    command: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, is_set: bool
) -> None:
    for name in ("TLSPLAN_CACHE", "XDG_CACHE_HOME", "HOME"):
        monkeypatch.delenv(name, raising=False)
    (tmp_path / "file").write_text("in the way")
    if is_set:
        monkeypatch.setenv("TLSPLAN_CACHE", str(tmp_path / "file" / "cache"))
    monkeypatch.setattr(tune, "_tune", lambda *_: pytest.fail("it measured"))
    code, _, err = command("tune", "-q")
    assert code == 4
    assert ("file/cache: can't be written" if is_set else "cache folder: got none") in err
    assert "TLSPLAN_CACHE" in err and err.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.opencl
def test_tune_keeps_its_answer(
    command: Callable[..., tuple[int, str, str]], cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    few_beams = replace(load_scanner.load_scanner("hdl-64e"), n_azimuths=90)
    monkeypatch.setattr(load_scanner, "load_scanner", lambda name: few_beams)
    code, out, err = command("tune", "--json", "--quick")
    assert code == 0, err
    answer = json.loads(out)
    document = next(each for each in answer["devices"] if each["device"] == answer["fastest"])
    assert len(answer["devices"]) == len(list_devices()), "all that there are"
    best = (document["tile_rows"], document["tile_columns"], document["lanes"])
    assert len(document["milliseconds"]) == 3
    assert min(document["milliseconds"].values()) > 0
    kept = json.loads(Path(document["file"]).read_text(encoding="utf-8"))
    assert Path(document["file"]).parent == cache
    assert (kept["tile_rows"], kept["tile_columns"], kept["lanes"]) == best
    fastest = choice.fastest_measured(list_devices())
    assert fastest is not None
    assert open_device().label == open_device(str(fastest)).label == answer["fastest"]


def test_doctor_shows_the_shape_in_use_and_where_it_is_from(device: Device) -> None:
    (shipped,) = doctor._tiles()
    assert "shipped" in shipped.detail
    file = keep_shape(device, OTHER, {})
    (found,) = doctor._tiles()
    assert found.detail == f"4 x 16 beams, packets of 4; measured, kept in {file}"


@pytest.mark.slow
def test_doctor_shows_how_long_a_start_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(start_time, "first_use_s", lambda: 61.2345)  # the real one is part of the test of doctor
    found = doctor._start()
    assert found.ok
    assert re.fullmatch(r"compiled before \d+\.\d s; first use, compiling 61\.2 s", found.detail)
    monkeypatch.setattr(start_time, "first_use_s", lambda: None)
    failed = doctor._start()
    assert not failed.ok
    assert not failed.needed
    assert "tlsplan.start_time" in failed.remedy


@pytest.mark.slow
def test_a_start_that_takes_too_long_is_told_as_one_that_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(start_time, "_TIME_LIMIT_S", 0.001)
    assert start_time.cached_s() is None


def test_a_first_use_finds_no_cache_of_the_user(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[dict[str, str]] = []
    monkeypatch.setattr(start_time, "_in_fresh_process", lambda variables: given.append(variables) or 1.0)
    assert start_time.first_use_s() == 1.0
    assert start_time.cached_s() == 1.0
    empty, as_it_is = given
    assert as_it_is == {}
    for name in ("HOME", "XDG_CACHE_HOME", "POCL_CACHE_DIR", "TLSPLAN_CACHE"):
        assert empty[name] != os.environ.get(name)
        assert not Path(empty[name]).exists(), "the folder is gone afterwards"

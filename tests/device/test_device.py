"""The choice of a device, memory told before it is taken, and errors of the driver in one line."""

import re
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyopencl
import pyopencl.cltypes
import pytest
from pyopencl import _cl

from planner_core.device import (
    DEVICE_VARIABLE,
    Device,
    check,
    choice,
    keep_fastest,
    list_devices,
    open_device,
    pocl,
    runtime,
)
from planner_core.device.sources import kernel_source
from planner_core.errors import DeviceError, PlannerError

pytestmark = pytest.mark.opencl

DOUBLE = (
    "kernel void twice(global const float *x, global float *y) { y[get_global_id(0)] = 2.0f * x[get_global_id(0)]; }"
)


def test_devices_are_listed_with_their_numbers() -> None:
    devices = list_devices()
    assert devices, "make test installs PoCL"
    assert [info.index for info in devices] == list(range(len(devices)))
    for info in devices:
        assert info.name
        assert info.kind in {"cpu", "gpu", "other"}
        assert info.memory_bytes > 0


def test_a_device_is_found_by_number_by_name_and_by_variable(monkeypatch: pytest.MonkeyPatch) -> None:
    info = list_devices()[0]
    by_number = open_device("0")
    assert info.name in by_number.label
    assert open_device(info.name.upper()).label == by_number.label
    monkeypatch.setenv(DEVICE_VARIABLE, info.platform)
    assert open_device().label == by_number.label
    monkeypatch.setenv(DEVICE_VARIABLE, "no such thing")
    with pytest.raises(DeviceError, match="no such thing"):
        open_device()
    assert open_device("0").label == by_number.label, "an argument goes before the variable"


def test_without_a_driver_no_device_is_listed_and_without_pyopencl_that_is_the_error(
    monkeypatch: pytest.MonkeyPatch, faults: SimpleNamespace
) -> None:
    with faults.refuse(pyopencl, "get_platforms", "PLATFORM_NOT_FOUND_KHR"):
        assert list_devices() == ()
    monkeypatch.setitem(sys.modules, "pyopencl", None)
    with pytest.raises(DeviceError, match=r"pyopencl can't be loaded .* see `tlsplan doctor`"):
        list_devices()


def test_kernels_for_a_processor_that_goes_by_its_level_are_as_wide_as_the_level(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    source = "kernel void a(global int *x) {\n#ifdef COMPILED_FOR_X86_64_V3\n x[0] = 3;\n#endif\n}"
    wide = choice.open_unchecked(0).native_lanes
    for level, lanes in ((pocl.HIGHEST_LEVEL, wide), ("x86-64-v3", 8)):
        monkeypatch.setattr(runtime, "name_given", lambda _, level=level: level)
        named, out = choice.open_unchecked(0), np.zeros(1, dtype=np.int32)
        assert named.native_lanes == named.max_lanes == lanes
        assert named.identity()["driver"] == f"{named.driver}, for {level}"
        with named.outputs("test", {"x": out}) as buffers:
            named.program_from_source(source, title="a.cl", defines={}).run("a", (1,), buffers["x"])
    assert out[0] == 3


@pytest.mark.parametrize("name", ["no-such-device", "99"])
def test_an_unknown_device_is_answered_with_those_there(name: str) -> None:
    with pytest.raises(DeviceError, match=re.escape(list_devices()[0].name)):
        open_device(name)


def test_the_device_that_was_measured_to_be_the_fastest_goes_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TLSPLAN_CACHE", str(tmp_path))
    info = list_devices()[0]
    two = (replace(info, kind="gpu"), replace(info, index=1, name="another"))
    assert [each.index for each in choice.in_order_of_preference(two)] == [0, 1]
    keep_fastest(two, 1)
    assert [each.index for each in choice.in_order_of_preference(two)] == [1, 0]
    other_driver = (two[0], replace(two[1], version="new"))
    assert [each.index for each in choice.in_order_of_preference(other_driver)] == [0, 1], "measured with another one"
    for file in tmp_path.iterdir():
        file.write_text(file.read_text().replace('"fastest": 1', '"fastest": 7'))
    assert [each.index for each in choice.in_order_of_preference(two)] == [0, 1], "no such device"


def test_a_device_that_fails_its_check_is_passed_over_and_refused_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    real = list_devices()[0]
    monkeypatch.setattr(choice, "list_devices", lambda: (real, replace(real, name="a twin of it")))
    monkeypatch.setattr(check, "problem_of", lambda device, index: "" if len(asked) else asked.append(index) or "wrong")
    asked: list[int] = []
    assert open_device().name == real.name, "the second one"
    assert asked == [0]
    monkeypatch.setattr(check, "problem_of", lambda device, index: "it computes wrongly")
    for name in (None, real.name):
        with pytest.raises(DeviceError, match=r"it computes wrongly; install another driver: .*tlsplan\[intel\]"):
            open_device(name)


def test_a_program_runs_and_is_built_once(device: Device) -> None:
    x = np.arange(10, dtype=np.float32)
    y = np.zeros(10, dtype=np.float32)
    given = device.upload("test", {"x": x})
    program = device.program_from_source(DOUBLE, title="twice.cl", defines={})
    with device.outputs("test", {"y": y}) as out:
        program.run("twice", (10,), given["x"], out["y"])
    np.testing.assert_array_equal(y, 2 * x)
    assert device.program_from_source(DOUBLE, title="twice.cl", defines={}) is program
    program.run("twice", (0,), given["x"], given["x"])
    device.read(given["x"], y)
    np.testing.assert_array_equal(y, x)


def test_numbers_of_every_kind_reach_a_kernel_as_they_are(device: Device) -> None:
    source = """kernel void take(global float *out, int i, float f, uint u, long l, float4 v) {
        out[0] = i; out[1] = f; out[2] = u; out[3] = l; out[4] = v.x + v.w; }"""
    program, out = device.program_from_source(source, title="take.cl", defines={}), np.zeros(5, dtype=np.float32)
    vector = np.array([1.0, 2.0, 3.0, 8.0], dtype=np.float32)
    for number in (7, -7):
        numbers = (np.int32(number), np.float32(2.5), np.uint32(4_000_000_000), np.int64(-5_000_000_000), vector)
        with device.outputs("test", {"out": out}) as written:
            program.run("take", (1,), written["out"], *numbers)
        np.testing.assert_array_equal(out, np.array([number, 2.5, 4e9, -5e9, 9], dtype=np.float32))
    with pytest.raises(DeviceError, match=r"take of take\.cl"), device.outputs("test", {"out": out}) as written:
        program.run("take", (1,), written["out"], np.int64(7), *numbers[1:])


@pytest.mark.parametrize("kind", ["cpu", "gpu"])
def test_inputs_are_lent_to_a_cpu_and_copied_elsewhere(device: Device, kind: str) -> None:
    x, y = np.arange(1000, dtype=np.float32), np.zeros(1000, dtype=np.float32)
    program = device.program_from_source(DOUBLE, title="twice.cl", defines={})
    elsewhere, held = open_device(), device.held_bytes
    if device.kind != "cpu":
        pytest.skip("a device with its own memory: there is nothing to lend")
    elsewhere.kind = kind
    with elsewhere.inputs("test", {"x": x}) as given, device.outputs("test", {"y": y}) as out:
        x += 1
        program.run("twice", (1000,), given["x"], out["y"])
    np.testing.assert_array_equal(y, 2 * x if kind == "cpu" else 2 * (x - 1))
    assert (elsewhere.held_bytes, device.held_bytes) == (0, held)


def test_inputs_of_no_entries_are_fine(device: Device) -> None:
    with device.inputs("nothing", {"nothing": np.empty((0, 6), dtype=np.float32)}) as given:
        assert given["nothing"].n_bytes == 0


def test_a_launch_takes_the_arguments_of_its_call_whatever_those_before_were(device: Device) -> None:
    source = """kernel void fill(global float *out, int n, float4 add) {
        out[get_global_id(0)] = n + add.s0 + add.s3;
    }"""
    program = device.program_from_source(source, title="fill.cl", defines={})
    add = np.zeros(4, dtype=np.float32)
    got = np.empty(3, dtype=np.float32)
    for given in (add, add.view(pyopencl.cltypes.float4)[0]):  # the same memory
        for turn in range(4):
            out = device.allocate("out", got.nbytes)  # mostly where the one before it was
            add[3] = 0.5 * turn
            program.run("fill", (3,), out, np.int32(turn // 2), given)
            program.run("fill", (1,), out, np.int32(100), given)
            device.read(out, got)
            assert got.tolist() == [100 + add[3], turn // 2 + add[3], turn // 2 + add[3]]
            out.release()


@pytest.mark.slow
def test_a_program_that_does_not_build_names_the_error_and_the_log(device: Device) -> None:
    with pytest.raises(DeviceError) as caught:
        device.program_from_source("kernel void broken(global float *x) { x[0] = nonsense; }", title="b.cl", defines={})
    message = str(caught.value)
    assert len(message.splitlines()) == 1
    assert "b.cl does not build" in message
    log = Path(re.search(r"the full log is (\S+);", message)[1])
    try:
        assert "nonsense" in log.read_text(encoding="utf-8")
    finally:
        log.unlink()


@pytest.mark.parametrize("n_signals", [1, 2])
def test_a_build_that_lost_its_file_to_a_signal_is_made_once_more(
    device: Device, monkeypatch: pytest.MonkeyPatch, n_signals: int
) -> None:
    lost = f"error: unable to rename temporary 'a.tmp' to output file 'a.cl' ({n_signals} signals)"  # in no cache
    record = _cl._ErrorRecord("clBuildProgram", pyopencl.status_code.BUILD_PROGRAM_FAILURE, lost)
    real, tried = pyopencl.Program.build, []

    def build(program: pyopencl.Program, **options: object) -> object:
        tried.append(program)
        if len(tried) <= n_signals:
            raise pyopencl.RuntimeError(record)
        return real(program, **options)

    monkeypatch.setattr(pyopencl.Program, "build", build)
    source = f"{DOUBLE} // {n_signals}"
    if n_signals == 1:
        program = device.program_from_source(source, title="twice.cl", defines={})
        assert device.program_from_source(source, title="twice.cl", defines={}) is program
    else:
        with pytest.raises(DeviceError, match="unable to rename") as caught:
            device.program_from_source(source, title="twice.cl", defines={})
        Path(re.search(r"the full log is (\S+);", str(caught.value))[1]).unlink()
    assert len(tried) == 2


def test_memory_is_totalled_before_it_is_taken(device: Device) -> None:
    held = device.held_bytes
    with pytest.raises(DeviceError, match=r"requested .* available") as caught:
        device.reserve("scene", {"a": device.memory_bytes // 2, "b": device.memory_bytes // 2})
    assert "scene" in str(caught.value)
    with pytest.raises(DeviceError, match="one buffer can have"):
        device.reserve("scene", {"a": device.max_buffer_bytes + 1})
    assert device.held_bytes == held


def test_memory_comes_back(device: Device) -> None:
    held = device.held_bytes
    buffer = device.allocate("test", 1000)
    assert device.held_bytes == held + 1000
    buffer.release()
    buffer.release()
    assert device.held_bytes == held
    given = device.upload("test", {"x": np.zeros(10)})
    assert device.held_bytes == held + 80
    del given
    assert device.held_bytes == held


def test_zero_and_read_cover_the_bytes_asked_for(device: Device) -> None:
    buffer = device.upload("test", {"x": np.full(16, 7, dtype=np.uint8)})["x"]
    device.zero(buffer, 10)
    got = np.full(14, 99, dtype=np.uint8)
    device.read(buffer, got[:12])
    assert got.tolist() == [0] * 10 + [7, 7, 99, 99]


def test_an_error_of_the_driver_is_a_device_error(device: Device) -> None:
    program = device.program_from_source(DOUBLE, title="twice.cl", defines={})
    buffer = device.allocate("test", 4)
    with pytest.raises(DeviceError, match="kernel thrice"):
        program.run("thrice", (1,), buffer, buffer)
    assert issubclass(DeviceError, PlannerError)


@pytest.mark.parametrize("file", ["scan_tiles.cl", "see_patches.cl", "cast_rays.cl", "tree_merge.cl"])
def test_kernel_sources_are_found_and_hold_no_include_of_ours(file: str) -> None:
    source = kernel_source(file)
    assert "kernel void" in source
    assert '#include "' not in source


@pytest.mark.parametrize(("kind", "asks"), [("gpu", True), ("cpu", False)])
def test_gpus_are_asked_to_divide_as_processors_do(
    device: Device, monkeypatch: pytest.MonkeyPatch, kind: str, asks: bool
) -> None:
    real, given = pyopencl.Program.build, []

    def build(program: pyopencl.Program, *, options: list[str]) -> object:
        given.extend(options)
        return real(program, options=options)

    monkeypatch.setattr(pyopencl.Program, "build", build)
    other = Device(device.queue.device, label="another", kind=kind)
    other.program_from_source(f"{DOUBLE} // {kind}", title="quotients.cl", defines={})
    assert ("-cl-fp32-correctly-rounded-divide-sqrt" in given) == asks

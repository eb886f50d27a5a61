"""What the library does when a driver fails: one clear line, or the announced fallback; never half a result."""

import gc
import tempfile
from collections.abc import Callable
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyopencl
import pytest

from planner_core.device import Device, in_batches, open_device
from planner_core.device import faults as device_faults
from planner_core.engine.open_engine import open_engine
from planner_core.engine.opencl import OpenCLEngine
from planner_core.errors import DeviceError, DeviceMemoryError
from planner_core.model import BeamTemplate, Patches, Scene

pytestmark = pytest.mark.opencl

TEMPLATE = BeamTemplate(
    azimuth_rad=np.arange(32) * (2 * np.pi / 32),
    elevation_rad=np.linspace(0.5, -0.5, 4),
    range_min_m=0.0,
    range_max_m=100.0,
)
AT = np.array([[0.0, 0.0, 0.0], [0.2, 0.1, -0.3], [-0.4, 0.5, 0.6]])
NOWHERE = (np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0]]))


@pytest.fixture(autouse=True)
def collections(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Of cycles, before smaller batches are tried: noted and left out, since the tests' process holds a lot."""
    noted: list[str] = []
    monkeypatch.setattr(device_faults, "gc", SimpleNamespace(collect=lambda: noted.append("collected")))
    return noted


def scan(engine: OpenCLEngine) -> object:
    return engine.scan(TEMPLATE, AT)


def see(engine: OpenCLEngine) -> object:
    return engine.visible_patches(TEMPLATE, AT)


def cast(engine: OpenCLEngine) -> object:
    return engine.cast_rays(*NOWHERE, range_max_m=10.0)


def clear_line(error: BaseException) -> str:
    """The message, once it is seen to be one line that says what was expected and what to do."""
    text = str(error)
    assert "\n" not in text
    assert "expected" in text or "does not build" in text
    assert "--engine open3d" in text or "smaller scene" in text
    return text


CALLS = {"scan": scan, "visible_patches": see, "cast_rays": cast}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
@pytest.mark.parametrize(
    ("status", "said"),
    [
        ("DEVICE_NOT_AVAILABLE", "was lost"),
        ("INVALID_COMMAND_QUEUE", "was lost"),
        ("OUT_OF_RESOURCES", "ran out of memory"),
        ("OUT_OF_HOST_MEMORY", "ran out of memory"),
        ("MEM_OBJECT_ALLOCATION_FAILURE", "ran out of memory"),
        ("INVALID_WORK_GROUP_SIZE", "failed"),
    ],
)
def test_a_launch_that_is_refused_is_told_with_its_kernel_and_cause(
    engine: OpenCLEngine, faults: SimpleNamespace, call: Callable[[OpenCLEngine], object], status: str, said: str
) -> None:
    refused = faults.refuse(pyopencl, "enqueue_nd_range_kernel", status)
    with refused, pytest.raises(DeviceError, match=said) as caught:
        call(engine)
    line = clear_line(caught.value)
    assert status in line
    assert "kernel " in line
    assert isinstance(caught.value, DeviceMemoryError) == (said == "ran out of memory")


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
@pytest.mark.parametrize("status", ["OUT_OF_RESOURCES", "DEVICE_NOT_AVAILABLE"])
def test_a_kernel_that_is_aborted_on_the_way_is_never_read_as_a_result(
    engine: OpenCLEngine, faults: SimpleNamespace, call: Callable[[OpenCLEngine], object], status: str
) -> None:
    """The queue finishes well and the arrays can be read: only the kernel's event tells."""
    with faults.watch() as kernels:
        expected = call(engine)
    assert kernels
    for kernel in set(kernels):
        with faults.abort(kernel, status) as seen, pytest.raises(DeviceError, match=kernel) as caught:
            call(engine)
        assert seen.aborted >= 1
        clear_line(caught.value)
    assert_equal(call(engine), expected)


@pytest.mark.slow
def test_a_kernel_aborted_while_the_tree_is_built_gives_no_tree(
    room: tuple[Scene, Patches], faults: SimpleNamespace
) -> None:
    device = open_device()
    with faults.watch() as kernels:
        OpenCLEngine(*room, device)
    assert kernels
    for kernel in set(kernels):
        with faults.abort(kernel, "DEVICE_NOT_AVAILABLE"), pytest.raises(DeviceError, match=kernel):
            OpenCLEngine(*room, device)


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_results_that_do_not_come_back_are_an_error(
    engine: OpenCLEngine, monkeypatch: pytest.MonkeyPatch, call: Callable[[OpenCLEngine], object]
) -> None:
    real = pyopencl.enqueue_map_buffer
    failed = SimpleNamespace(command_execution_status=-5)
    monkeypatch.setattr(pyopencl, "enqueue_map_buffer", lambda *a, **k: (real(*a, **k)[0], failed))
    with pytest.raises(DeviceError):
        call(engine)


def test_memory_that_runs_out_anywhere_is_an_error_and_what_was_held_comes_back(
    room: tuple[Scene, Patches], faults: SimpleNamespace
) -> None:
    engine = OpenCLEngine(*room, open_device())  # its own: frames of other tests' errors may still hold buffers
    expected = {name: call(engine) for name, call in CALLS.items()}
    held = engine._on.held_bytes
    refusals = (pyopencl, "Buffer"), (pyopencl, "enqueue_copy"), (pyopencl, "enqueue_map_buffer")
    for (target, routine), name in product((*refusals, (pyopencl.CommandQueue, "finish")), CALLS):
        with faults.refuse(target, routine, "MEM_OBJECT_ALLOCATION_FAILURE") as seen:
            try:
                got = CALLS[name](engine)
            except DeviceMemoryError as error:
                clear_line(error)
                assert seen.refused >= 1, (routine, name)
            else:
                assert seen.refused == 0, f"a refusal of {routine} went unnoticed by {name}"
                assert_equal(got, expected[name])
            assert seen.refused or routine not in {"Buffer", "finish"}
        assert_equal(CALLS[name](engine), expected[name])
    # Python 3.13 keeps frames of an error that is gone, and the buffers in them, until it collects cycles.
    gc.collect()
    assert engine._on.held_bytes == held


def assert_equal(got: object, expected: object) -> None:
    for name, value in vars(expected).items():
        np.testing.assert_array_equal(getattr(got, name), value, err_msg=name)


def test_a_driver_without_a_compiler_is_told_apart_from_a_faulty_program(
    device: Device, faults: SimpleNamespace
) -> None:
    refused = faults.refuse(pyopencl.Program, "build", "COMPILER_NOT_AVAILABLE")
    with refused, pytest.raises(DeviceError, match="has no compiler") as caught:
        device.program_from_source("kernel void a(global int *x) { x[0] = 1; }", title="a.cl", defines={"A": 1})
    clear_line(caught.value)


def test_memory_that_runs_out_in_the_compiler_is_a_memory_error(device: Device, faults: SimpleNamespace) -> None:
    refused = faults.refuse(pyopencl.Program, "build", "OUT_OF_HOST_MEMORY")
    with refused, pytest.raises(DeviceMemoryError, match=r"building b\.cl"):
        device.program_from_source("kernel void b(global int *x) { x[0] = 1; }", title="b.cl", defines={"B": 1})


def test_a_refused_program_is_not_kept_as_built(device: Device, faults: SimpleNamespace) -> None:
    source = "kernel void c(global int *x) { x[0] = 1; }"
    with faults.refuse(pyopencl.Program, "build", "OUT_OF_HOST_MEMORY"), pytest.raises(DeviceMemoryError):
        device.program_from_source(source, title="c.cl", defines={})
    out = np.zeros(1, dtype=np.int32)
    with device.outputs("test", {"x": out}) as buffers:
        device.program_from_source(source, title="c.cl", defines={}).run("c", (1,), buffers["x"])
    assert out[0] == 1


def test_an_interrupt_among_outputs_waits_for_the_kernels_that_write_to_them(device: Device) -> None:
    slow = "kernel void slow(global int *x) { int y = 1; for (int k = 0; k < 30000000; ++k) y = y * 5 + 1; x[0] = y; }"
    out = np.zeros(1, dtype=np.int32)
    program = device.program_from_source(slow, title="slow.cl", defines={})
    held = device.held_bytes
    with pytest.raises(KeyboardInterrupt), device.outputs("test", {"x": out}) as buffers:
        program.run("slow", (1,), buffers["x"])
        raise KeyboardInterrupt
    first = int(out[0])
    device.queue.finish()
    assert first != 0, "the array was let go while its kernel was still running"
    assert int(out[0]) == first
    assert device.held_bytes == held


def test_an_interrupt_among_inputs_waits_for_the_kernels_that_read_them(device: Device) -> None:
    slow = """kernel void slow(global const int *x, global int *y) {
        int z = 1; for (int k = 0; k < 30000000; ++k) z = z * 5 + 1; y[0] = z * 0 + x[0]; }"""
    given, out = np.full(1, 7, dtype=np.int32), device.upload("test", {"y": np.zeros(1, dtype=np.int32)})["y"]
    program, held = device.program_from_source(slow, title="slow.cl", defines={}), device.held_bytes
    with pytest.raises(KeyboardInterrupt), device.inputs("test", {"x": given}) as buffers:
        program.run("slow", (1,), buffers["x"], out)
        raise KeyboardInterrupt
    given[0] = 8
    device.read(out, got := np.zeros(1, dtype=np.int32))
    assert got[0] == 7, "the array was let go while its kernel was still running"
    assert device.held_bytes == held


@pytest.mark.parametrize("by", ["finish", "end of the device's life"])
def test_memory_in_large_pages_outlives_the_kernels_that_write_to_it(by: str) -> None:
    device = open_device()
    if device.kind != "cpu":
        pytest.skip("a device with its own memory: its driver keeps what kernels use")
    slow = "kernel void slow(global int *x) { int y = 1; for (int k = 0; k < 30000000; ++k) y = y * 5 + 1; x[0] = y; }"
    program = device.program_from_source(slow, title="slow.cl", defines={})
    buffer = device.allocate("test", 8 * 2**20, is_filled=True)
    memory = buffer._memory
    assert memory is not None and memory.ctypes.data % 128 == 0 and memory.nbytes == 8 * 2**20
    memory[:4] = 0
    program.run("slow", (1,), buffer)
    buffer.release()
    assert device.held_bytes == 0
    assert [kept is memory for kept in device.outlived] == [True]
    if by == "finish":
        device.finish("test")
        assert device.outlived == []
    else:
        del program, buffer, device
        gc.collect()
    assert memory[:4].any(), "the memory was let go while its kernel was still running"


def test_outputs_of_no_entries_are_fine(device: Device) -> None:
    nothing = np.empty((0, 4), dtype=np.float32)
    with device.outputs("nothing", {"nothing": nothing}) as buffers:
        assert buffers["nothing"].n_bytes == 0


def test_thousands_of_launches_without_reading_are_all_looked_at(device: Device, faults: SimpleNamespace) -> None:
    program = device.program_from_source("kernel void add(global int *x) { x[0] += 1; }", title="add.cl", defines={})
    sum_of = device.upload("test", {"x": np.zeros(1, dtype=np.int32)})["x"]
    got = np.zeros(1, dtype=np.int32)
    for _ in range(2500):
        program.run("add", (1,), sum_of)
    device.read(sum_of, got)
    assert got[0] == 2500
    with faults.abort("add", "OUT_OF_RESOURCES"), pytest.raises(DeviceMemoryError):
        for _ in range(2500):
            program.run("add", (1,), sum_of)
    device.finish("test")  # told once


@pytest.mark.slow
def test_who_opens_the_device_again_builds_nothing_again(room: tuple[Scene, Patches], faults: SimpleNamespace) -> None:
    expected = scan(OpenCLEngine(*room, open_device()))
    with faults.refuse(pyopencl.Program, "build", "BUILD_PROGRAM_FAILURE"):
        assert_equal(scan(OpenCLEngine(*room, open_device())), expected)


def test_a_context_in_which_a_kernel_failed_is_not_used_again(
    room: tuple[Scene, Patches], faults: SimpleNamespace
) -> None:
    device = open_device()
    engine = OpenCLEngine(*room, device)
    with faults.watch() as kernels:
        scan(engine)
    assert open_device().context == device.context
    with faults.abort(kernels[0], "OUT_OF_RESOURCES"), pytest.raises(DeviceError):
        scan(engine)
    assert open_device().context != device.context


# --------------------------------------------------------------------------------------------- choice and fallback
def test_no_device_falls_back_to_open3d_and_says_so(room: tuple[Scene, Patches], faults: SimpleNamespace) -> None:
    with faults.refuse(pyopencl, "get_platforms", "PLATFORM_NOT_FOUND_KHR"):
        engine = open_engine(*room)
        assert engine.name == "open3d"
        assert len(engine.warnings) == 1
        assert "Open3D instead" in engine.warnings[0]
        with pytest.raises(DeviceError, match="no OpenCL device") as caught:
            open_engine(*room, engine="opencl")
    clear_line(caught.value)


@pytest.mark.usefixtures("nothing_built_yet")
@pytest.mark.parametrize(
    ("target", "name", "status"),
    [
        (pyopencl, "get_platforms", "OUT_OF_HOST_MEMORY"),
        (pyopencl, "Context", "DEVICE_NOT_AVAILABLE"),
        (pyopencl, "CommandQueue", "OUT_OF_HOST_MEMORY"),
        (pyopencl.Program, "build", "BUILD_PROGRAM_FAILURE"),
        (pyopencl, "Buffer", "MEM_OBJECT_ALLOCATION_FAILURE"),
        (pyopencl, "enqueue_nd_range_kernel", "OUT_OF_RESOURCES"),
    ],
)
def test_a_device_that_does_not_open_falls_back_unless_it_was_asked_for(
    room: tuple[Scene, Patches],
    faults: SimpleNamespace,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    target: Any,
    name: str,
    status: str,
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))  # where build logs go
    with faults.refuse(target, name, status):
        engine = open_engine(*room)
        assert engine.name == "open3d"
        assert status in engine.warnings[0]
        assert "\n" not in engine.warnings[0]
        for asked in ({"engine": "opencl"}, {"device": "0"}):
            with pytest.raises(DeviceError) as caught:
                open_engine(*room, **asked)
            clear_line(caught.value)


def test_a_broken_driver_beside_a_working_one_is_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    working = pyopencl.get_platforms()[0]
    error = pyopencl.RuntimeError(pyopencl._cl._ErrorRecord("clGetDeviceIDs", -2, ""))

    class Broken:
        def get_devices(self) -> list[Any]:
            raise error

    monkeypatch.setattr(pyopencl, "get_platforms", lambda: [Broken(), working])
    assert open_device().label.startswith(working.get_devices()[0].name.strip())


# ------------------------------------------------------------------------------------------------ smaller batches
def test_batches_halve_until_they_fit_and_every_item_is_done_once(collections: list[str]) -> None:
    done: list[int] = []
    sizes: list[int] = []
    lines: list[str] = []

    def work(first: int, end: int) -> None:
        sizes.append(end - first)
        if end - first > 3:
            raise DeviceMemoryError("marks: 8 MiB requested, 4 MiB available, expected it to suffice; do this")
        done.extend(range(first, end))

    in_batches(23, 16, work, on_smaller=lines.append)
    assert done == list(range(23))
    assert sizes[:4] == [16, 8, 4, 2]
    assert len(collections) == 3
    assert len(lines) == 1
    assert "16 positions" in lines[0]
    assert "marks: 8 MiB requested" in lines[0]
    assert "\n" not in lines[0]


def test_one_item_that_does_not_fit_is_the_error_itself() -> None:
    tried: list[tuple[int, int]] = []

    def work(first: int, end: int) -> None:
        tried.append((first, end))
        raise DeviceMemoryError("full")

    with pytest.raises(DeviceMemoryError, match="full"):
        in_batches(5, 4, work, on_smaller=lambda _: None)
    assert tried == [(0, 4), (0, 2), (0, 1)]


def test_errors_other_than_memory_are_not_tried_again() -> None:
    tried: list[int] = []

    def work(first: int, end: int) -> None:
        tried.append(end - first)
        raise DeviceError("lost")

    with pytest.raises(DeviceError, match="lost"):
        in_batches(5, 4, work, on_smaller=lambda _: None)
    assert tried == [4]

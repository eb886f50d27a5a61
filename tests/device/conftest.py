"""What a driver can do wrong, played by wrapping pyopencl: its own exception types, with the real status codes."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import pyopencl
import pytest
from pyopencl import _cl
from tlsplan.main import main

from planner_core import self_check
from planner_core.device import Device, open_device, runtime
from planner_core.engine.opencl import OpenCLEngine
from planner_core.model import Patches, Scene
from planner_core.scene.patches import make_patches

CODES = {name: getattr(pyopencl.status_code, name) for name in dir(pyopencl.status_code) if name.isupper()}
_MEMORY = ("MEM_OBJECT_ALLOCATION_FAILURE", "OUT_OF_RESOURCES", "OUT_OF_HOST_MEMORY")


def driver_error(routine: str, status: str) -> pyopencl.Error:
    """The exception that pyopencl raises for a status: its C++ wrapper chooses the type by the code, like this."""
    code = CODES[status]
    kind = pyopencl.MemoryError if status in _MEMORY else pyopencl.LogicError if code <= -30 else pyopencl.RuntimeError
    return kind(_cl._ErrorRecord(routine, code, ""))


class Aborted:
    """An event of a kernel that the driver took on and then aborted: it says so here, and waiting says nothing."""

    def __init__(self, event: Any, status: str) -> None:
        self._event = event
        self.command_execution_status = CODES[status]

    def wait(self) -> None:
        self._event.wait()


@pytest.fixture
def nothing_built_yet(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a fresh process: what a driver does wrong comes to light where contexts and programs are made."""
    monkeypatch.setattr(runtime, "_contexts", {})


@contextmanager
def refuse(target: Any, name: str, status: str, *, times: int = 10**9) -> Iterator[SimpleNamespace]:
    """Calls of target.name fail with the status; `.refused` counts them."""
    real = getattr(target, name)
    seen = SimpleNamespace(refused=0)

    def wrapped(*arguments: Any, **named: Any) -> Any:
        if seen.refused < times:
            seen.refused += 1
            if name == "finish":  # kernels write to arrays that the caller gives up then: let them end first
                real(*arguments, **named)
            raise driver_error(f"cl{name}", status)
        return real(*arguments, **named)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(target, name, wrapped)
        yield seen


@contextmanager
def abort(kernel: str, status: str, *, more_than: int = 0) -> Iterator[SimpleNamespace]:
    """Launches of the kernel succeed, and their events say later that it was aborted; `.aborted` counts them.

    Only launches with more work-items than `more_than` along the last axis, which is that of positions.
    """
    real = pyopencl.enqueue_nd_range_kernel
    seen = SimpleNamespace(aborted=0)

    def wrapped(queue: Any, launched: Any, global_size: tuple[int, ...], *rest: Any, **named: Any) -> Any:
        event = real(queue, launched, global_size, *rest, **named)
        if launched.function_name != kernel or global_size[-1] <= more_than:
            return event
        seen.aborted += 1
        return Aborted(event, status)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pyopencl, "enqueue_nd_range_kernel", wrapped)
        yield seen


@contextmanager
def watch() -> Iterator[list[str]]:
    """Names of the kernels that are launched meanwhile."""
    real = pyopencl.enqueue_nd_range_kernel
    names: list[str] = []

    def wrapped(queue: Any, launched: Any, *rest: Any, **named: Any) -> Any:
        names.append(launched.function_name)
        return real(queue, launched, *rest, **named)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pyopencl, "enqueue_nd_range_kernel", wrapped)
        yield names


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    """Run tlsplan in this process, where the driver can be wrapped: exit code, standard output, standard error."""

    def run(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["tlsplan", *map(str, arguments)])
        with pytest.raises(SystemExit) as stopped:
            main()
        written = capsys.readouterr()
        return int(stopped.value.code or 0), written.out, written.err

    return run


@pytest.fixture(scope="session")
def faults() -> SimpleNamespace:
    """The faults above, each a context manager."""
    return SimpleNamespace(refuse=refuse, abort=abort, watch=watch)


@pytest.fixture(scope="session")
def room() -> tuple[Scene, Patches]:
    """A closed box of 2 x 4 x 6 m about the origin."""
    scene, _ = self_check.box()
    return scene, make_patches(scene, max_area_m2=0.5)


@pytest.fixture(scope="module")
def engine(room: tuple[Scene, Patches], needs_opencl: None) -> OpenCLEngine:
    """An engine on a device of its own: what it holds can be counted, and no failure leaves a trace in it."""
    return OpenCLEngine(*room, open_device())


@pytest.fixture(scope="module")
def device(needs_opencl: None) -> Device:
    """One of its own for each file: others are not to meet what was done to it."""
    return open_device()

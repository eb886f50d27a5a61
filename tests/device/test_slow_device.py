"""Devices with memory and a queue of their own: commands end long after they were queued, and the host must wait.

Played on the device at hand: before every kernel, the queue waits for an event that comes some milliseconds later, so
that nothing is done yet when a call returns; what is not waited for is read too early, and is other bytes.
"""

import threading
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyopencl
import pytest

from planner_core.device import Device, open_device
from planner_core.engine.in_parts import PartedEngine
from planner_core.engine.opencl import OpenCLEngine
from planner_core.engine.patch_mode import PatchMode
from planner_core.model import BeamTemplate, Patches, Scene

AT = np.array([[0.1, 0.2, 0.3], [-0.5, 0.4, 0.1], [0.4, -0.6, 0.2]])
TEMPLATE = BeamTemplate(
    azimuth_rad=np.radians(np.arange(0.0, 360.0, 4.0)),
    elevation_rad=np.radians(np.arange(-60.0, 61.0, 8.0)),
    range_min_m=0.0,
    range_max_m=10.0,
)


@pytest.fixture
def slow(needs_opencl: None, monkeypatch: pytest.MonkeyPatch) -> Iterator[SimpleNamespace]:
    """A device that is taken for a GPU; `.delayed` counts kernels, `.unfinished` those that were late."""
    device = open_device()
    device.kind = "gpu"
    real, seen = pyopencl.enqueue_nd_range_kernel, SimpleNamespace(device=device, delayed=0, unfinished=0)
    timers = []

    def late(queue: Any, *rest: Any, **named: Any) -> Any:
        gate = pyopencl.UserEvent(queue.context)
        pyopencl.enqueue_barrier(queue, wait_for=[gate])
        event = real(queue, *rest, **named)
        queue.flush()
        timers.append(threading.Timer(0.003, lambda: gate.set_status(pyopencl.command_execution_status.COMPLETE)))
        timers[-1].start()
        seen.delayed += 1
        seen.unfinished += event.command_execution_status != pyopencl.command_execution_status.COMPLETE
        return event

    monkeypatch.setattr(pyopencl, "enqueue_nd_range_kernel", late)
    yield seen
    for timer in timers:
        timer.join()


def results(device: Device, scene: Scene, patches: Patches) -> list[Any]:
    rays = np.random.default_rng(1).normal(size=(200, 3))
    engine = OpenCLEngine(scene, patches, device)
    parted = PartedEngine(scene, patches, device)
    found: list[Any] = [PatchMode(engine, scene, patches).see(TEMPLATE, AT)]
    for each in (engine, parted):
        found.append(each.scan(TEMPLATE, AT))
        found.append(each.visible_patches(TEMPLATE, AT))
        found.append(each.patch_returns(TEMPLATE, AT, moments=True))
        found.append(each.cast_rays(np.repeat(AT[:1], 200, axis=0), rays, range_max_m=np.inf))
    return found


def flat(item: Any) -> list[bytes]:
    parts: list[bytes] = []
    for value in vars(item).values():
        if isinstance(value, np.ndarray):
            parts.append(value.tobytes())
        elif hasattr(value, "__dataclass_fields__"):
            parts += flat(value)
    return parts


def test_results_wait_for_late_kernels_and_are_those_of_a_cpu(
    room: tuple[Scene, Patches], slow: SimpleNamespace
) -> None:
    """The memory of a GPU's results is its own, and copied; that of a CPU's is the array itself."""
    late = results(slow.device, *room)
    assert slow.unfinished > 0.9 * slow.delayed > 20, "nothing was late: the test shows nothing"
    at_once = results(open_device(), *room)
    for got, expected in zip(late, at_once, strict=True):
        assert flat(got) == flat(expected)
        assert flat(got)

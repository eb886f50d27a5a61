"""OpenCL devices: the choice of one, programs built from `kernels/`, buffers; the only place that talks to pyopencl.

Importing this package loads no pyopencl; the functions do, where they need it.
"""

from planner_core.device.choice import (
    DEVICE_VARIABLE,
    DeviceInfo,
    keep_fastest,
    list_devices,
    open_device,
    problem_of_device,
)
from planner_core.device.faults import in_batches
from planner_core.device.runtime import MEMORY_VARIABLE, Buffer, Device, Program, memory_allowed

__all__ = [
    "DEVICE_VARIABLE",
    "MEMORY_VARIABLE",
    "Buffer",
    "Device",
    "DeviceInfo",
    "Program",
    "in_batches",
    "keep_fastest",
    "list_devices",
    "memory_allowed",
    "open_device",
    "problem_of_device",
]

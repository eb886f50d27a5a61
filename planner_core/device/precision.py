"""Which floating-point numbers a device's kernels may use: sums are in float64 where there is any."""

from __future__ import annotations

from planner_core.device.runtime import Device


def has_float64(device: Device) -> bool:
    """Whether kernels may use double on `device`."""
    return "cl_khr_fp64" in device.queue.device.extensions.split()

"""Which floating-point numbers a device's kernels may use: metrics are sums in float64 where there is any."""

from __future__ import annotations

from planner_core.device import Device


def has_float64(device: Device) -> bool:
    """Whether kernels may use double on `device`."""
    return "cl_khr_fp64" in device.queue.device.extensions.split()

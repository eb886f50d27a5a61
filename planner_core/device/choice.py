"""The choice of an OpenCL device: by name, by number, by environment variable, or the one that suits best."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from planner_core.cache import keep, kept_file, read_kept
from planner_core.device import check, pocl
from planner_core.device.drivers import all_devices
from planner_core.device.faults import driver_errors
from planner_core.device.runtime import Device
from planner_core.device.sources import kernels_hash
from planner_core.errors import DeviceError

#: Names the device where a call names none: part of its name or its number in `list_devices`.
DEVICE_VARIABLE = "TLSPLAN_DEVICE"
_SCHEMA = "tlsplan/fastest-device/1"
#: Drivers to be had, for who has none, and for who has one that fails.
GET_ONE = "`pip install pocl-binary-distribution`, or the driver of your GPU's maker"
GET_ANOTHER = "install another driver: `pip install tlsplan[intel]`, or that of your GPU's maker"


@dataclass(frozen=True)
class DeviceInfo:
    """One OpenCL device as `list_devices` shows it."""

    index: int
    """Its number for `open_device`."""
    name: str
    platform: str
    version: str
    """Version of the platform's driver."""
    kind: str
    """`cpu`, `gpu` or `other`."""
    n_compute_units: int
    memory_bytes: int
    compiled_for: str = ""
    """The processor that its driver compiles for where it does not know this one; else empty."""
    problem: str = ""
    """Why it can't be used, and the remedy; empty where nothing is known against it."""


def list_devices() -> tuple[DeviceInfo, ...]:
    """All OpenCL devices in the order of their platforms; empty where there is none.

    Raises
    ------
    DeviceError
        pyopencl itself can't be loaded, or the driver fails to say what there is.
    """
    return tuple(_describe(index, device) for index, device in enumerate(all_devices()))


def open_device(name: str | None = None) -> Device:
    """Open a device whose kernels compute rightly, see `planner_core.device.check`.

    Parameters
    ----------
    name
        Part of the device's or its platform's name (any case), or its number in `list_devices`. None: what the
        environment variable TLSPLAN_DEVICE names, and where it is unset the one that was measured to be the fastest
        (`tlsplan tune`), else the first GPU, else the first device. Where that one can't be used, the next that can.

    Raises
    ------
    DeviceError
        No such device, it does not open, or its kernels don't run here: why, and the remedy.
    """
    wanted = name if name is not None else os.environ.get(DEVICE_VARIABLE) or None
    infos = list_devices()
    if not infos:
        raise DeviceError(
            f"no OpenCL device: got none, expected at least one; install a driver: {GET_ONE}, or scan "
            "without OpenCL (`--engine open3d`)"
        )
    if wanted is not None:
        return _open_checked(_find(wanted, infos))
    problems = []
    for info in in_order_of_preference(infos):
        try:
            return _open_checked(info)
        except DeviceError as error:
            problems.append(str(error))
    raise DeviceError("; ".join(problems))


def open_unchecked(index: int) -> Device:
    """Open the device of this number in `list_devices`, whatever its kernels do: for who checks it.

    Raises
    ------
    DeviceError
        No such device, it does not open, or it would end the process.
    """
    devices = all_devices()
    if index >= len(devices):
        raise DeviceError(f"OpenCL device: got {index}, expected a number below {len(devices)}; see `tlsplan doctor`")
    info = _describe(index, devices[index])
    if info.problem:
        raise DeviceError(f"OpenCL device {info.name}: {info.problem}")
    return Device(devices[index], label=f"{info.name} ({info.platform})", kind=info.kind)


def in_order_of_preference(infos: Sequence[DeviceInfo]) -> list[DeviceInfo]:
    """Devices as they are tried: the fastest by measurement first, then GPUs, then as listed."""
    fastest = fastest_measured(infos)
    return sorted(infos, key=lambda info: (info.index != fastest, info.kind != "gpu", info.index))


def fastest_measured(infos: Sequence[DeviceInfo]) -> int | None:
    """Number of the device that `keep_fastest` kept for just these devices; None where there is none."""
    file = _fastest_file(infos)
    try:
        index = None if file is None else read_kept(file, _SCHEMA).get("fastest")
    except (OSError, ValueError):
        return None
    return index if isinstance(index, int) and 0 <= index < len(infos) else None


def keep_fastest(infos: Sequence[DeviceInfo], index: int) -> None:
    """Let the device of this number be the default from now on, as long as all drivers stay as they are.

    Raises
    ------
    OSError
        The cache folder can't be written.
    """
    file = _fastest_file(infos)
    if file is not None:
        keep(file, {"schema": _SCHEMA, **_all_of(infos), "fastest": index})


def _fastest_file(infos: Sequence[DeviceInfo]) -> Path | None:
    return kept_file("fastest-device", _all_of(infos))


def _all_of(infos: Sequence[DeviceInfo]) -> dict[str, str]:
    devices = (
        f"{info.name}, {info.platform} {info.version} {info.compiled_for}, {info.n_compute_units}" for info in infos
    )
    return {"devices": "; ".join(devices), "kernels": kernels_hash()}


def problem_of_device(info: DeviceInfo, *, anew: bool = False) -> str:
    """Why a device can't be used, or nothing where its kernels compute rightly; `anew`: whatever is kept of it."""
    if info.problem:
        return info.problem
    try:
        return check.problem_of(open_unchecked(info.index), info.index, anew=anew)
    except DeviceError as error:
        return str(error)


def _open_checked(info: DeviceInfo) -> Device:
    device = open_unchecked(info.index)
    problem = check.problem_of(device, info.index)
    if problem:
        raise DeviceError(
            f"OpenCL device {device.label}: {problem}; {GET_ANOTHER}, or scan without OpenCL (`--engine open3d`)"
        )
    return device


def _find(wanted: str, infos: Sequence[DeviceInfo]) -> DeviceInfo:
    if wanted.isdecimal() and int(wanted) < len(infos):
        return infos[int(wanted)]
    for info in infos:
        if wanted.lower() in f"{info.name} {info.platform}".lower():
            return info
    there = "; ".join(f"{info.index} {info.name}" for info in infos)
    raise DeviceError(f"OpenCL device: got {wanted!r}, expected part of a name or a number of: {there}")


def _describe(index: int, device: Any) -> DeviceInfo:
    import pyopencl

    kinds = {pyopencl.device_type.CPU: "cpu", pyopencl.device_type.GPU: "gpu"}
    with driver_errors("describing", f"OpenCL device {index}"):
        platform = device.platform.name.strip()
        return DeviceInfo(
            index=index,
            name=device.name.strip(),
            platform=platform,
            version=device.platform.version.strip(),
            kind=next((name for flag, name in kinds.items() if device.type & flag), "other"),
            n_compute_units=int(device.max_compute_units),
            memory_bytes=int(device.global_mem_size),
            compiled_for=pocl.name_given(device) or "",
            problem=pocl.linker_problem() if platform == pocl.POCL else "",
        )

"""The choice of an OpenCL device: by name, by number, by environment variable, or the first GPU, else the first one."""

from __future__ import annotations

import os
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from planner_core.device.faults import driver_errors
from planner_core.device.runtime import Device
from planner_core.errors import DeviceError

#: Names the device where a call names none: part of its name or its number in `list_devices`.
DEVICE_VARIABLE = "TLSPLAN_DEVICE"
#: Name of PoCL's platform, in every version.
POCL = "Portable Computing Language"
#: The loader is there and no driver is (PLATFORM_NOT_FOUND_KHR); a driver is there and its device is not.
_NOTHING_THERE = frozenset({-1001, -1})
_LIBRARY_ROOTS = ("/usr/lib", "/usr/lib64", "/lib64")


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
    problem: str = ""
    """Why it can't be used, and the remedy; empty where nothing is known against it."""


def list_devices() -> tuple[DeviceInfo, ...]:
    """All OpenCL devices in the order of their platforms; empty where there is none.

    Raises
    ------
    DeviceError
        pyopencl itself can't be loaded, or the driver fails to say what there is.
    """
    return tuple(_describe(index, device) for index, device in enumerate(_all_devices()))


def open_device(name: str | None = None) -> Device:
    """Open a device.

    Parameters
    ----------
    name
        Part of the device's or its platform's name (any case), or its number in `list_devices`. None: what the
        environment variable TLSPLAN_DEVICE says, and where it is unset the first GPU, else the first device.

    Raises
    ------
    DeviceError
        No such device, or it does not open.
    """
    wanted = name if name is not None else os.environ.get(DEVICE_VARIABLE) or None
    devices = _all_devices()
    infos = [_describe(index, device) for index, device in enumerate(devices)]
    if not infos:
        raise DeviceError(
            "no OpenCL device: got none, expected at least one; install one, e.g. `pip install "
            "pocl-binary-distribution`, or scan without OpenCL (`--engine open3d`)"
        )
    if wanted is None:
        usable = [info for info in infos if not info.problem] or infos
        chosen = next((info for info in usable if info.kind == "gpu"), usable[0])
    else:
        chosen = _find(wanted, infos)
    if chosen.problem:
        raise DeviceError(f"OpenCL device {chosen.name}: {chosen.problem}")
    return Device(devices[chosen.index], label=f"{chosen.name} ({chosen.platform})", kind=chosen.kind)


def _find(wanted: str, infos: list[DeviceInfo]) -> DeviceInfo:
    if wanted.isdecimal() and int(wanted) < len(infos):
        return infos[int(wanted)]
    for info in infos:
        if wanted.lower() in f"{info.name} {info.platform}".lower():
            return info
    there = "; ".join(f"{info.index} {info.name}" for info in infos)
    raise DeviceError(f"OpenCL device: got {wanted!r}, expected part of a name or a number of: {there}")


def _all_devices() -> list[Any]:
    try:
        import pyopencl
    except (ImportError, OSError) as error:
        raise DeviceError(
            f"pyopencl can't be loaded ({str(error).splitlines()[0]}), expected a working one; see `tlsplan doctor`"
        ) from error
    with driver_errors("listing OpenCL devices", "the OpenCL loader"):
        try:
            platforms = pyopencl.get_platforms()
        except pyopencl.Error as error:
            if error.code in _NOTHING_THERE:
                return []
            raise
    devices = []
    for platform in platforms:
        try:
            devices.extend(platform.get_devices())
        except pyopencl.Error:
            # No device of this driver, or a broken driver beside one that works: others may serve.
            continue
    return devices


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
            problem=_linker_problem() if platform == POCL else "",
        )


def _linker_problem() -> str:
    """Return why PoCL can't link kernels here, or nothing.

    PoCL 3.0 calls the system's linker for every kernel it compiles and aborts the whole process where that fails, so
    the linker and the two libraries it is asked for have to be looked for beforehand.
    """
    compiler = any(shutil.which(name) for name in ("cc", "gcc", "clang"))
    libgcc = any(path.is_file() for root in _LIBRARY_ROOTS for path in Path(root).glob("gcc/*/*/libgcc.a"))
    libc = any(
        path.exists() for root in _LIBRARY_ROOTS for path in (Path(root, "libc.so"), *Path(root).glob("*/libc.so"))
    )
    if shutil.which("ld") and (compiler or (libgcc and libc)):
        return ""
    return (
        "PoCL links its kernels with the system's linker and C library, which are not here; "
        "run `apt-get install gcc libc6-dev`, or scan without OpenCL (`--engine open3d`)"
    )

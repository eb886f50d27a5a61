"""`tlsplan doctor`: what is here, what is missing, and how to get it."""

from __future__ import annotations

import ctypes
import importlib
import importlib.metadata
import platform
import sys
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import click

from ..options import json_option

if TYPE_CHECKING:
    from planner_core.device import DeviceInfo

PACKAGES = {
    "numpy": "numpy",
    "numba": "numba",
    "open3d-cpu" if (sys.platform, platform.machine()) == ("linux", "x86_64") else "open3d": "open3d",
    "pyopencl": "pyopencl",
    "pyvista": "pyvista",
    "matplotlib": "matplotlib",
    "usd-core": "pxr.Usd",
    "OpenImageIO": "OpenImageIO",
    "ifcopenshell": "ifcopenshell",
    "scipy": "scipy.sparse",
    "starlette": "starlette",
    "uvicorn": "uvicorn",
}
"""Distribution name -> module whose import proves that it works."""

SYSTEM_LIBRARIES = {
    "libusb-1.0.so.0": "libusb-1.0-0",
    "libGL.so.1": "libgl1",
    "libgomp.so.1": "libgomp1",
    "libEGL.so.1": "libegl1",
}
"""Shared library -> Debian/Ubuntu package."""


@dataclass(frozen=True)
class Finding:
    """One check. `remedy` is empty where `ok`, and where the detail names what to do."""

    subject: str
    ok: bool
    detail: str
    remedy: str = ""
    needed: bool = True


@click.command("doctor", epilog="Example:  tlsplan doctor")
@click.option("--clear-cache", is_flag=True, help="First remove the results that are kept between commands.")
@json_option
@click.pass_context
def command(ctx: click.Context, as_json: bool, clear_cache: bool) -> None:
    """Check packages, system libraries, OpenCL devices and the scan engine.

    Builds and runs the kernels on every device and checks their results. Reports what works, what does not, why, and
    what to do. Exit code 1 if something is missing, or if a plan would fall back to the host.
    """
    from .. import output

    if clear_cache:
        _forget()
    findings = [_python(), *_libraries(), *_packages(), *_devices(), *_engine(), _viewer(), _kept()]
    healthy = all(finding.ok for finding in findings if finding.needed)
    if as_json:
        output.as_json({"healthy": healthy, "findings": [asdict(finding) for finding in findings]})
    else:
        for finding in findings:
            mark = "ok     " if finding.ok else "PROBLEM" if finding.needed else "note   "
            output.say(f"{mark}  {finding.subject:<22} {finding.detail}")
            if finding.remedy:
                output.say(f"{'':<9}{'':<22} -> {finding.remedy}")
        output.say()
        output.say(
            "Everything that tlsplan needs is installed and works." if healthy else "Problems found: see PROBLEM above."
        )
    ctx.exit(0 if healthy else 1)


def _python() -> Finding:
    ok = sys.version_info >= (3, 11)
    detail = f"{platform.python_version()}, {platform.system()} {platform.machine()}"
    return Finding("Python", ok, detail, "" if ok else "use Python 3.11 or later")


def _libraries() -> list[Finding]:
    findings = []
    for library, package in SYSTEM_LIBRARIES.items() if platform.system() == "Linux" else ():
        try:
            ctypes.CDLL(library)
            findings.append(Finding(library, True, "loads"))
        except OSError as error:
            findings.append(Finding(library, False, str(error), f"apt-get install {package}"))
    return findings


def _packages() -> list[Finding]:
    findings = []
    for distribution, module in PACKAGES.items():
        try:
            version = importlib.metadata.version(distribution)
        except importlib.metadata.PackageNotFoundError:
            findings.append(Finding(distribution, False, "not installed", f"pip install {distribution}"))
            continue
        try:
            if module == "open3d":
                importlib.import_module("planner_core.engine.open3d").prepare_import()
            importlib.import_module(module)
            findings.append(Finding(distribution, True, version))
        except (ImportError, OSError) as error:
            detail = f"{version} is installed but does not load: {' '.join(str(error).split())}"
            findings.append(Finding(distribution, False, detail, "install the system libraries named above"))
    return findings


def _devices() -> list[Finding]:
    """Open every device, build and run kernels on it in a process of its own, and compare what they compute."""
    from planner_core.device import list_devices
    from planner_core.errors import PlannerError

    try:
        return [_device(info) for info in list_devices()]
    except PlannerError as error:
        return [Finding("OpenCL", False, str(error), needed=False)]


def _device(info: DeviceInfo) -> Finding:
    from planner_core.device import open_device, problem_of_device
    from planner_core.device.choice import GET_ANOTHER

    subject = f"OpenCL device {info.index}"
    detail = (
        f"{info.name}, {info.kind}, {info.n_compute_units} compute units, {info.memory_bytes / 2**30:.0f} GiB; "
        f"{info.platform} {info.version}"
    )
    if info.compiled_for:
        detail += f"; its compiler does not know this processor and compiles for {info.compiled_for} instead"
    problem = problem_of_device(info, anew=True)
    if problem:
        return Finding(subject, False, f"{detail}: {problem}", "" if info.problem else GET_ANOTHER, needed=False)
    device = open_device(str(info.index))
    detail += "; its kernels run and give correct results"
    if device.max_lanes < device.native_lanes:
        detail += f" in packets of {device.max_lanes} beams; those of {device.native_lanes} fail, though they would fit"
    return Finding(subject, True, detail)


def _engine() -> list[Finding]:
    """Scan a box of known size with the engine that a plan would use; one that falls back warns in the same words."""
    from planner_core.errors import PlannerError

    from .. import start_time

    try:
        start = start_time.start()
    except PlannerError as error:
        return [Finding("scan engine", False, str(error), "see the lines above; `--engine open3d` needs no OpenCL")]
    if start.wrong:
        wrong = f"{start.engine} gives wrong results: {start.wrong}"
        return [Finding("scan engine", False, wrong, "choose another device with --device")]
    if start.warnings:
        return [Finding("scan engine", False, f"{start.engine}: {' '.join(start.warnings)}")]
    return [Finding("scan engine", True, f"{start.engine}; the test scan of a box is correct"), *_tiles(), _start()]


def _start() -> Finding:
    """How long the engine takes to start: this process has just filled the caches of the driver."""
    from .. import start_time

    times_s = {"compiled before": start_time.cached_s(), "first use, compiling": start_time.first_use_s()}
    measured = [f"{what} {seconds:.1f} s" for what, seconds in times_s.items() if seconds is not None]
    if len(measured) < len(times_s):
        remedy = "run `python -m tlsplan.start_time` to see why"
        return Finding("start of the engine", False, "; ".join([*measured, "not measured"]), remedy, needed=False)
    return Finding("start of the engine", True, "; ".join(measured))


def _tiles() -> list[Finding]:
    from planner_core.device import open_device
    from planner_core.engine.tuning import shape_in_use

    from .tune import name_of

    used = shape_in_use(open_device())
    return [Finding("beam tiles", True, f"{name_of(used.shape)}; {used.origin}, {used.detail}", needed=False)]


def _forget() -> None:
    from planner_core.errors import RequirementError
    from planner_core.kept import forget_kept

    try:
        forget_kept()
    except OSError as error:
        raise RequirementError(
            f"{error.filename}: can't be removed ({error.strerror}), expected a file of yours; remove it by hand"
        ) from error


def _kept() -> Finding:
    from planner_core.kept import SIZE_VARIABLE, use_of_kept

    use = use_of_kept()
    if use.folder is None or not use.most_bytes:
        why = "there is no cache folder" if use.folder is None else f"{SIZE_VARIABLE} is 0"
        return Finding("kept results", False, f"none: {why}; every plan computes all", needed=False)
    most = f"of at most {use.most_bytes / 1e6:.0f} MB ({SIZE_VARIABLE})"
    files = f"{use.n_files} file{'' if use.n_files == 1 else 's'}"
    detail = f"{use.n_bytes / 1e6:.0f} MB in {files} {most} in {use.folder}; --clear-cache removes them"
    return Finding("kept results", True, detail, needed=False)


def _viewer() -> Finding:
    from viewer_web.server.app import BUILT_APP

    built = (BUILT_APP / "index.html").is_file()
    return Finding("viewer", built, "built" if built else "not built", "" if built else "run `make viewer`")

"""`tlsplan doctor`: what is here, what is missing, and how to get it."""

from __future__ import annotations

import ctypes
import importlib
import importlib.metadata
import platform
import sys
import time
from dataclasses import asdict, dataclass

import click

from ..options import json_option

PACKAGES = {
    "numpy": "numpy",
    "open3d": "open3d",
    "pyopencl": "pyopencl",
    "pyvista": "pyvista",
    "matplotlib": "matplotlib",
    "usd-core": "pxr.Usd",
    "OpenImageIO": "OpenImageIO",
    "ifcopenshell": "ifcopenshell",
    "trimesh": "trimesh",
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
    """One thing looked at. `remedy` is empty where `ok`."""

    subject: str
    ok: bool
    detail: str
    remedy: str = ""
    needed: bool = True


@click.command("doctor", epilog="Example:  tlsplan doctor")
@json_option
@click.pass_context
def command(ctx: click.Context, as_json: bool) -> None:
    """Check packages, system libraries, OpenCL devices and the scan engine; say how to get what is missing."""
    from .. import output

    findings = [_python(), *_libraries(), *_packages(), *_devices(), _engine(), _viewer()]
    healthy = all(finding.ok for finding in findings if finding.needed)
    if as_json:
        output.as_json({"healthy": healthy, "findings": [asdict(finding) for finding in findings]})
    else:
        for finding in findings:
            mark = "ok     " if finding.ok else "MISSING" if finding.needed else "note   "
            output.say(f"{mark}  {finding.subject:<22} {finding.detail}")
            if finding.remedy:
                output.say(f"{'':<9}{'':<22} -> {finding.remedy}")
        output.say()
        output.say("Everything that tlsplan needs is here." if healthy else "Something that tlsplan needs is missing.")
    ctx.exit(0 if healthy else 6)


def _python() -> Finding:
    ok = sys.version_info >= (3, 11)
    detail = f"{platform.python_version()}, {platform.system()} {platform.machine()}"
    return Finding("Python", ok, detail, "" if ok else "use Python 3.11 or later")


def _libraries() -> list[Finding]:
    findings = []
    for library, package in SYSTEM_LIBRARIES.items():
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
            importlib.import_module(module)
            findings.append(Finding(distribution, True, version))
        except (ImportError, OSError) as error:
            detail = f"{version} is installed but does not load: {' '.join(str(error).split())}"
            findings.append(Finding(distribution, False, detail, "install the system libraries named above"))
    return findings


def _devices() -> list[Finding]:
    from planner_core.device import list_devices
    from planner_core.errors import PlannerError

    remedy = "pip install pocl-binary-distribution, or install your GPU maker's OpenCL driver"
    try:
        devices = list_devices()
    except PlannerError as error:
        return [Finding("OpenCL", False, str(error), remedy, needed=False)]
    if not devices:
        return [Finding("OpenCL", False, "no device; Open3D will scan instead, slower", remedy, needed=False)]
    return [
        Finding(
            f"OpenCL device {d.index}",
            not d.problem,
            f"{d.name}, {d.kind}, {d.n_compute_units} compute units, {d.memory_bytes / 2**30:.0f} GiB; "
            f"{d.platform} {d.version}",
            d.problem,
            needed=False,
        )
        for d in devices
    ]


def _engine() -> Finding:
    """Scan a box of known size with the engine that a plan would use: proves compiler, kernels and driver."""
    import numpy as np

    from planner_core.errors import PlannerError
    from planner_core.scan.engine import open_engine
    from planner_core.scene.build import scene_from_arrays
    from planner_core.scene.patches import make_patches

    corners = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-2.0, 2.0) for z in (-3.0, 3.0)])
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)]
    faces += [(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
    try:
        started_s = time.perf_counter()
        scene = scene_from_arrays(corners, np.array(faces))
        engine = open_engine(scene, make_patches(scene, max_area_m2=0.1))
        axes = np.array([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
        hits = engine.cast_rays(np.zeros((3, 3)), axes, range_max_m=10.0)
        elapsed_s = time.perf_counter() - started_s
    except PlannerError as error:
        return Finding("scan engine", False, str(error), "see the lines above; `--engine open3d` needs no OpenCL")
    right = np.allclose(hits.range_m, [1.0, 2.0, 3.0], atol=1e-5)
    detail = f"{engine.name} on {engine.device}; first scan after {elapsed_s:.2f} s"
    if right:
        return Finding("scan engine", True, detail)
    wrong = f"{detail}, but ranges {hits.range_m.tolist()} instead of [1, 2, 3]"
    return Finding("scan engine", False, wrong, "this driver computes wrongly: choose another device with --device")


def _viewer() -> Finding:
    from viewer_web.server.app import BUILT_APP

    built = (BUILT_APP / "index.html").is_file()
    return Finding("viewer", built, "built" if built else "not built", "" if built else "run `make viewer`")

"""Off-screen windows of VTK: which kind opens on this machine, and one of it.

VTK left alone tries X first, complains on stderr where there is none, and ends the whole process where there is neither
EGL nor OSMesa. So a child process tries the kinds first, once a run; what ends is the child.
"""

from __future__ import annotations

import functools
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from planner_core.errors import MissingPackageError

WINDOWS = {"win32": ("vtkWin32OpenGLRenderWindow",), "darwin": ("vtkCocoaRenderWindow",)}.get(
    sys.platform, ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow")
)
"""VTK's classes, the better first: EGL (any driver, also Mesa's software one) and OSMesa; tried on Linux alone."""

_TIME_LIMIT_S = 300.0
"""For the trial: loading VTK from a cold, slow disk, or on a busy machine, takes tens of seconds."""

_TRIAL = """
import sys
sys.modules["numpy"] = None
from vtkmodules import vtkRenderingOpenGL2
from vtkmodules.vtkRenderingCore import vtkRenderer
window = getattr(vtkRenderingOpenGL2, sys.argv[1])()
window.SetOffScreenRendering(True)
window.SetSize(8, 8)
window.AddRenderer(vtkRenderer())
window.Render()
sys.exit(0 if window.SupportsOpenGL() else 1)
"""
"""Without NumPy, which VTK loads where it is there: that alone takes a third of the time."""


@functools.cache
def window_class() -> str:
    """Name of VTK's window class to draw with off-screen.

    Raises
    ------
    MissingPackageError
        No kind of window opens; the message names what to install.
    """
    reasons = []
    for name in WINDOWS:
        reason = _try_window(name)
        if reason is None:
            return name
        reasons.append(f"{name}: {reason}")
    raise MissingPackageError(
        f"pictures need an off-screen OpenGL window, none opens here ({'; '.join(reasons)}); "
        "install EGL with a driver (Debian: libegl1 libgl1-mesa-dri) or libosmesa6"
    )


def _try_window(name: str) -> str | None:
    """Why no window of this class opens, None where one does."""
    command = [sys.executable, "-c", _TRIAL, name]
    try:
        done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=_TIME_LIMIT_S)
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"could not be tried ({type(error).__name__})"
    if done.returncode < 0:
        return f"its trial ended by signal {-done.returncode}"
    if done.returncode > 0:
        last = done.stderr.strip().splitlines()[-1:]
        return last[0] if last and "Error:" in last[0] else "OpenGL does not start"
    return None


@contextmanager
def offscreen_window() -> Iterator[Any]:
    """Give a window of VTK without a screen, closed at the end.

    One window draws all pictures of a report: opening one and compiling its shaders takes half as long as a picture.

    Raises
    ------
    MissingPackageError
        PyVista, VTK or an off-screen window is missing.
    """
    name = window_class()
    try:
        # Not `pyvista.Plotter`: its modules take three times as long to import as all that pictures need.
        import pyvista  # noqa: F401
        from vtkmodules import vtkRenderingOpenGL2
    except ImportError as error:
        raise MissingPackageError(
            f"pictures need the package pyvista, which can't be imported ({error}): pip install pyvista"
        ) from error
    window = getattr(vtkRenderingOpenGL2, name)()
    window.SetOffScreenRendering(True)
    window.SetMultiSamples(0)  # who draws finer than is shown has smooth edges
    try:
        yield window
    finally:
        window.Finalize()

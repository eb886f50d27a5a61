"""Plans whose pictures nobody looks at, small or left out: in this process, or in a module's run by this program.

At their full size the pictures of a small plan take longer than the plan, and small still half as long; tests/export
and tests/plan_folder look at them.
`python small_pictures.py MODULE ARGUMENT...` is `python -m MODULE ARGUMENT...` with small pictures; `begin_without`
begins such a command without any.
"""

from __future__ import annotations

import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest


def draw_small(patch: pytest.MonkeyPatch) -> None:
    from planner_core.plan_folder import pictures  # a while to import, for tests that draw nothing
    from planner_core.plan_folder.drawing import png_canvas

    patch.setattr(png_canvas, "DPI", 29)
    patch.setattr(pictures, "CAP_CELLS", 80)
    patch.setattr(pictures, "OVERSAMPLING", 1)


def draw_blank(patch: pytest.MonkeyPatch) -> None:
    """Leave the pictures out of reports: all else is written."""
    from planner_core.plan_folder.folder import write_plan_folder

    patch.setitem(write_plan_folder.__kwdefaults__, "pictures", False)


def begin_without(command: list[str], **options: Any) -> subprocess.Popen[bytes]:
    """Begin `python FLAG -m MODULE ARGUMENT...` as `subprocess.Popen` does, without pictures in reports."""
    interpreter, [flag, *module_and_arguments] = command[:2], command[2:]
    assert flag == "-m"
    return subprocess.Popen([*interpreter, __file__, "--none", *module_and_arguments], **options)


if __name__ == "__main__":
    # Python puts a program's folder first: numba, which looks for the package `coverage`, would find tests/coverage.
    sys.path[:] = [entry for entry in sys.path if entry != str(Path(__file__).resolve().parent)]
    with pytest.MonkeyPatch.context() as own:
        draws = sys.argv[1] != "--none"
        (draw_small if draws else draw_blank)(own)
        sys.argv = sys.argv[1 if draws else 2 :]
        runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)

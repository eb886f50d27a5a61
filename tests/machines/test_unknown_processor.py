"""A processor that PoCL's compiler does not know: nothing builds there without our remedy, all is well with it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from planner_core.device import list_devices, pocl

_MACHINE = Path(__file__).with_name("unknown_processor")
_OPEN = """
from planner_core.device import list_devices, open_device, problem_of_device
from planner_core.device.pocl import POCL
from planner_core.engine.tuning import tile_shape
info = next(info for info in list_devices() if info.platform == POCL)
print(info.compiled_for)
problem = problem_of_device(info)
print(problem)
print("" if problem else tile_shape(open_device(str(info.index)))[2])
"""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not any(info.platform == pocl.POCL and "PoCL 3.0-rc2" in info.version for info in list_devices()),
        reason="another PoCL than that of pyopencl's wheel, or none",
    ),
]


def on_that_machine(tmp_path: Path, **variables: str) -> list[str]:
    """What a process there says of PoCL's device: processor compiled for, what is wrong, lanes. No cache is shared."""
    own = {name: str(tmp_path / name) for name in ("POCL_CACHE_DIR", "TLSPLAN_CACHE", "XDG_CACHE_HOME")}
    done = subprocess.run(
        [sys.executable, "-c", _OPEN],
        capture_output=True,
        text=True,
        check=True,
        timeout=900,
        env={
            **os.environ,
            **own,
            "PYTHONPATH": str(_MACHINE),
            "PYOPENCL_NO_CACHE": "1",
            "TMPDIR": str(tmp_path),  # for the compiler's log
            **variables,
        },
    )
    return done.stdout.split("\n")[:3]


def test_without_the_remedy_no_kernel_builds(tmp_path: Path) -> None:
    compiled_for, problem, _ = on_that_machine(tmp_path, UNAIDED="1")
    assert compiled_for == ""
    assert "unknown target CPU 'generic'" in problem


def test_with_the_remedy_all_kernels_build_and_compute_rightly(tmp_path: Path) -> None:
    compiled_for, problem, lanes = on_that_machine(tmp_path)
    assert compiled_for == pocl.level_of(pocl.processor_flags())
    assert compiled_for
    assert problem == ""
    assert lanes == ("16" if compiled_for == pocl.HIGHEST_LEVEL else "8")


@pytest.mark.campaign
def test_a_zen_4_taken_for_a_zen_3_is_compiled_for_what_it_has(tmp_path: Path) -> None:
    if pocl.level_of(pocl.processor_flags()) != pocl.HIGHEST_LEVEL:
        pytest.skip("a processor without AVX-512")
    assert on_that_machine(tmp_path, NAME="znver3") == [pocl.HIGHEST_LEVEL, "", "16"]


@pytest.mark.campaign
def test_kernels_compiled_for_less_than_the_processor_has_are_narrow(tmp_path: Path) -> None:
    if pocl.level_of(pocl.processor_flags()) != pocl.HIGHEST_LEVEL:
        pytest.skip("a processor without AVX-512")
    assert on_that_machine(tmp_path, LEVEL="x86-64-v3") == ["x86-64-v3", "", "8"]

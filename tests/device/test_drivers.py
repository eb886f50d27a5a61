"""Where the loader looks for drivers: Intel's runtime is found where it is installed, and nothing is left behind."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from planner_core.device import drivers


@pytest.mark.skipif(drivers.intel_library() is None, reason="Intel's runtime is not installed (make intel)")
def test_intels_runtime_is_found_before_and_after_open3d_is_loaded() -> None:
    for first in ("", "from planner_core.engine.open3d import import_open3d; import_open3d(); "):
        names = "print([info.platform for info in list_devices()])"
        lines = f"{first}from planner_core.device import list_devices; {names}"
        done = subprocess.run([sys.executable, "-c", lines], capture_output=True, text=True, check=True, timeout=240)
        assert "Intel(R) OpenCL" in done.stdout, lines


@pytest.fixture
def first_call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A loader that was not asked yet, a system with one driver, and Intel's runtime."""
    for name in drivers._USERS_VARIABLES:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(drivers, "_loader_was_asked", False)
    vendors = tmp_path / "vendors"
    vendors.mkdir()
    (vendors / "gpu.icd").write_text("libgpu.so.1\n")
    (vendors / "README").write_text("no driver")
    monkeypatch.setattr(drivers, "_SYSTEM_VENDORS", vendors)
    monkeypatch.setattr(drivers, "intel_library", lambda: Path("/somewhere/libintelocl.so"))
    return vendors


@pytest.mark.usefixtures("first_call")
def test_the_loader_is_shown_the_systems_drivers_and_intels_runtime_once() -> None:
    with drivers._drivers_shown():
        folder = Path(os.environ["OCL_ICD_VENDORS"])
        shown = {file.name: file.read_text() for file in folder.iterdir()}
    assert shown == {"gpu.icd": "libgpu.so.1\n", "zz-tlsplan-intel.icd": "/somewhere/libintelocl.so\n"}
    assert sorted(shown)[0] == "gpu.icd", "the system's come first"
    assert not folder.exists()
    assert "OCL_ICD_VENDORS" not in os.environ
    with drivers._drivers_shown():
        assert "OCL_ICD_VENDORS" not in os.environ, "the loader reads it at its first call only"


@pytest.mark.usefixtures("first_call")
@pytest.mark.parametrize("variable", ["OCL_ICD_VENDORS", "OPENCL_VENDOR_PATH", "OCL_ICD_FILENAMES"])
def test_who_told_the_loader_where_to_look_is_left_alone(variable: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(variable, "/mine")
    with drivers._drivers_shown():
        assert os.environ[variable] == "/mine"
        assert os.environ.get("OCL_ICD_VENDORS") in (None, "/mine")


def test_nothing_is_shown_where_there_is_no_runtime_or_the_system_names_it(
    first_call: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (first_call / "intel.icd").write_text("/opt/intel/lib/libintelocl.so\n")
    with drivers._drivers_shown():
        assert "OCL_ICD_VENDORS" not in os.environ
    (first_call / "intel.icd").unlink()
    monkeypatch.setattr(drivers, "_loader_was_asked", False)
    monkeypatch.setattr(drivers, "intel_library", lambda: None)
    with drivers._drivers_shown():
        assert "OCL_ICD_VENDORS" not in os.environ


@pytest.mark.usefixtures("first_call")
def test_a_full_disk_costs_the_runtime_and_nothing_else(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(drivers.tempfile, "mkdtemp", full)
    with drivers._drivers_shown():
        assert "OCL_ICD_VENDORS" not in os.environ


@pytest.mark.skipif(
    not Path("/proc/self/task").exists() or len(os.sched_getaffinity(0)) != os.cpu_count() or os.cpu_count() == 1,
    reason="PoCL binds on Linux, and all of the machine's cores must be ours to see it",
)
@pytest.mark.parametrize("own", [None, "0"])
def test_pocls_workers_are_bound_to_cores_unless_the_user_says_otherwise(own: str | None) -> None:
    environment = {name: value for name, value in os.environ.items() if name != "POCL_AFFINITY"}
    environment |= {} if own is None else {"POCL_AFFINITY": own}
    lines = """
import os
before = set(os.listdir("/proc/self/task"))
from planner_core.device import open_device
device = open_device("Portable")
held = [os.sched_getaffinity(int(task)) for task in set(os.listdir("/proc/self/task")) - before]
alone = {core for cores in held if len(cores) == 1 for core in cores}
print(len(alone) == device.n_compute_units, len(alone))
"""
    done = subprocess.run([sys.executable, "-c", lines], capture_output=True, text=True, check=True, env=environment)
    assert done.stdout.split() == (["True", str(os.cpu_count())] if own is None else ["False", "0"])

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
    monkeypatch.setattr(drivers, "_loader_was_called", False)
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
    monkeypatch.setattr(drivers, "_loader_was_called", False)
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


@pytest.mark.opencl
@pytest.mark.parametrize(
    ("variables", "n_usable", "affinity"),
    [
        ({}, os.cpu_count(), "1"),
        ({"POCL_AFFINITY": "0"}, os.cpu_count(), "0"),
        ({"POCL_MAX_PTHREAD_COUNT": "1"}, os.cpu_count(), None),
        ({}, 0, None),
    ],
    ids=["all cores", "the user's choice", "the user's number of workers", "some cores"],
)
def test_pocls_workers_are_to_be_bound_where_all_cores_are_ours_unless_the_user_decides(
    variables: dict[str, str], n_usable: int, affinity: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("POCL_AFFINITY", "POCL_MAX_PTHREAD_COUNT"):
        monkeypatch.setenv(name, "")  # so that it is afterwards as it was
        monkeypatch.delenv(name)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(drivers, "n_usable_cores", lambda: n_usable)
    assert drivers.all_devices()
    assert os.environ.get("POCL_AFFINITY") == affinity


@pytest.mark.slow
@pytest.mark.skipif(
    not Path("/proc/self/task").exists() or len(os.sched_getaffinity(0)) != os.cpu_count() or os.cpu_count() == 1,
    reason="PoCL binds on Linux, and all of the machine's cores must be ours to see it",
)
@pytest.mark.parametrize(
    ("told", "is_bound"), [({}, True), ({"POCL_AFFINITY": "0"}, False), ({"POCL_MAX_PTHREAD_COUNT": "1"}, False)]
)
def test_pocls_workers_are_bound_to_cores_unless_the_user_says_otherwise(told: dict[str, str], is_bound: bool) -> None:
    device, alone = _cores_of_workers(told)
    assert alone == (device if is_bound else 0)


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "sched_setaffinity") or os.cpu_count() == 1, reason="needs a core to keep off")
def test_workers_keep_to_the_cores_that_the_process_was_given() -> None:
    last = (os.cpu_count() or 1) - 1
    _, alone = _cores_of_workers({}, begin=f"import os; os.sched_setaffinity(0, {{{last}}})", of=f"cores != {{{last}}}")
    assert alone == 0


def _cores_of_workers(told: dict[str, str], begin: str = "", of: str = "len(cores) == 1") -> tuple[int, int]:
    """Compute units of PoCL's device, and how many of the process' new threads are held to cores so."""
    names = ("POCL_AFFINITY", "POCL_MAX_PTHREAD_COUNT")
    environment = {name: value for name, value in os.environ.items() if name not in names}
    lines = f"""
import os
{begin}
before = set(os.listdir("/proc/self/task"))
from planner_core.device import open_device
device = open_device("Portable")
held = [os.sched_getaffinity(int(task)) for task in set(os.listdir("/proc/self/task")) - before]
print(device.n_compute_units, sum({of} for cores in held))
"""
    command = [sys.executable, "-c", lines]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment | told)
    n_units, n_alone = done.stdout.split()
    return int(n_units), int(n_alone)

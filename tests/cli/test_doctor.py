"""What `tlsplan doctor` says of devices."""

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from tlsplan import start_time
from tlsplan.commands import doctor

from planner_core.device import Device, list_devices

pytestmark = pytest.mark.opencl


@pytest.mark.slow
def test_an_installation_is_healthy_unless_something_that_is_needed_is_not(
    tlsplan: Callable[..., "subprocess.CompletedProcess[str]"], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(start_time, "first_use_s", lambda: 12.34)  # compiling all kernels takes that long
    done = tlsplan("doctor", "--json")
    found = json.loads(done.stdout)
    findings = {finding["subject"]: finding for finding in found["findings"]}
    assert [subject for subject, one in findings.items() if one["needed"] and not one["ok"]] == []
    assert done.returncode == 0 and found["healthy"]
    assert findings["OpenCL device 0"]["detail"].endswith("its kernels run and give correct results")
    assert "the test scan of a box is correct" in findings["scan engine"]["detail"]
    assert findings["start of the engine"]["detail"].endswith("first use, compiling 12.3 s")
    monkeypatch.setattr(start_time, "start", lambda: start_time.Start(1.0, "opencl", (), "ranges are off"))
    monkeypatch.setattr(doctor, "_devices", list)
    broken = tlsplan("doctor", "--json")
    assert broken.returncode == 1 and not json.loads(broken.stdout)["healthy"]


def test_what_is_kept_is_counted_and_cleared(
    tlsplan: Callable[..., "subprocess.CompletedProcess[str]"], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for part in ("_libraries", "_packages", "_devices", "_engine"):
        monkeypatch.setattr(doctor, part, list)
    assert "note     kept results           none: TLSPLAN_CACHE_SIZE is 0" in tlsplan("doctor").stdout
    monkeypatch.setenv("TLSPLAN_CACHE", str(tmp_path))
    monkeypatch.setenv("TLSPLAN_CACHE_SIZE", "3GB")
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "samples-1").write_bytes(bytes(2_000_000))
    assert "2 MB in 1 file of at most 3000 MB (TLSPLAN_CACHE_SIZE)" in tlsplan("doctor").stdout
    assert "0 MB in 0 files" in tlsplan("doctor", "--clear-cache").stdout
    assert not [*(tmp_path / "results").iterdir()]


def test_a_device_whose_wide_kernels_fail_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def narrowed(device: Device, index: int, *, anew: bool = False) -> str:
        device.native_lanes, device.max_lanes = 16, 8
        return ""

    info = list_devices()[0]
    monkeypatch.setattr("planner_core.device.check.problem_of", narrowed)
    finding = doctor._device(info)
    assert finding.ok
    assert finding.detail.endswith(" in packets of 8 beams; those of 16 fail, though they would fit")

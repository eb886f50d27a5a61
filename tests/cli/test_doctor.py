"""What `tlsplan doctor` says of devices."""

import pytest
from tlsplan.commands import doctor

from planner_core.device import Device, list_devices

pytestmark = pytest.mark.opencl


def test_a_device_whose_wide_kernels_fail_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def narrowed(device: Device, index: int, *, anew: bool = False) -> str:
        device.native_lanes, device.max_lanes = 16, 8
        return ""

    info = list_devices()[0]
    assert "in packets of" not in doctor._device(info).detail
    monkeypatch.setattr("planner_core.device.check.problem_of", narrowed)
    finding = doctor._device(info)
    assert finding.ok
    assert finding.detail.endswith(" in packets of 8 beams; those of 16 fail, though they would fit")

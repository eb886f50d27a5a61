"""The default OpenCL device: `make test` installs one, so its absence is a failure."""

import pytest

from planner_core.device import Device, open_device


@pytest.fixture(scope="session")
def device() -> Device:
    return open_device()

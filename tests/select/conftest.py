"""What tests of walks share; lets the tests of this folder import the modules that lie beside them."""

import sys
from pathlib import Path

import pytest

from planner_core.device import list_devices
from planner_core.errors import DeviceError
from planner_core.select.swap_walks import Terrain, Walks, open_walks

_FOLDER = str(Path(__file__).parent)
sys.path.insert(0, _FOLDER)
try:
    import joined_instances  # noqa: F401 - from here on they are known by their names
    import numpy_walks  # noqa: F401
    import selection_instances  # noqa: F401
finally:
    sys.path.remove(_FOLDER)


def has_cpu_device() -> bool:
    """Whether there is an OpenCL device that walks are done on."""
    try:
        return any(info.kind == "cpu" and not info.problem for info in list_devices())
    except DeviceError:
        return False


@pytest.fixture(params=["device", "host"], scope="session")
def walks_on(request):
    """Call with a terrain: walks on the device, or on the host."""
    if request.param == "device" and not has_cpu_device():
        pytest.skip("no OpenCL device that is a CPU")

    def open_on(terrain: Terrain) -> Walks:
        return open_walks(terrain, host=request.param == "host")

    return open_on

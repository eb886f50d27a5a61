"""For tests of kernels on a machine that has a GPU, pytest, hypothesis and pyopencl, and neither Open3D nor loaders.

`bench_gpu.py` puts it in the place of tests/conftest.py. What needs an absent package is skipped and counted.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from planner_core.device import Device, open_device
from planner_core.errors import MissingPackageError

sys.path.insert(0, str(Path(__file__).parent))  # tests import slow_cases.py by its name

settings.register_profile(
    "tlsplan", deadline=None, derandomize=True, max_examples=10, suppress_health_check=HealthCheck
)
settings.load_profile("tlsplan")


@pytest.fixture(scope="session")
def needs_opencl() -> None:
    """There is a device, or nothing here runs."""


@pytest.fixture(scope="session")
def device() -> Device:
    """The GPU."""
    return open_device()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """Skip what needs a package that is not there."""
    try:
        return (yield)
    except (ImportError, MissingPackageError) as error:
        pytest.skip(f"not brought along: {str(error).splitlines()[0]}")


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup() -> Iterator[object]:
    """As above, for what a test is given."""
    try:
        return (yield)
    except (ImportError, MissingPackageError) as error:
        pytest.skip(f"not brought along: {str(error).splitlines()[0]}")

"""Makes the soak's modules importable by the tests beside them, as they are when it is run as a program."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def soak() -> Iterator[object]:
    """The module `soak_watertight`."""
    folder = str(Path(__file__).parent)
    sys.path.insert(0, folder)
    import soak_watertight

    yield soak_watertight
    sys.path.remove(folder)

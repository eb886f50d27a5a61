"""The command line as a fixture, for tests that run it in this process."""

from __future__ import annotations

import pytest
from in_process import Tlsplan, run_here


@pytest.fixture(scope="session")
def tlsplan() -> Tlsplan:
    """Run `tlsplan` with arguments (and `env`) as a process would: what it returns, says and leaves on disk.

    Reports have blank pictures unless `draws`.
    """
    return run_here

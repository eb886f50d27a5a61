"""What holds for all tests: none of them reads or changes what `tlsplan tune` has kept for the user who runs them."""

import os
from collections.abc import Iterator

import pytest


@pytest.fixture(scope="session", autouse=True)
def own_cache_folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    before = os.environ.get("TLSPLAN_CACHE")
    os.environ["TLSPLAN_CACHE"] = str(tmp_path_factory.mktemp("tlsplan-cache"))
    yield
    if before is None:
        del os.environ["TLSPLAN_CACHE"]
    else:
        os.environ["TLSPLAN_CACHE"] = before

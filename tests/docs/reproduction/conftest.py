"""Figures of the paper, drawn small."""

from collections.abc import Iterator

import pytest
from paper_figures import charts


@pytest.fixture(scope="session", autouse=True)
def coarse_charts() -> Iterator[None]:
    """Draw charts in few pixels: nobody looks at them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(charts, "DPI", 40)
        yield

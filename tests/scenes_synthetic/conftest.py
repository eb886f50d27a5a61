"""Scenes that several test files look at, generated once a session: the paper's take seconds."""

from __future__ import annotations

import pytest

import scenes_synthetic
from scenes_synthetic.model import SyntheticScene


@pytest.fixture(scope="session")
def built() -> dict[str, SyntheticScene]:
    """Scenes by name, with the default seed: the paper's, and what tests add."""
    return {name: scenes_synthetic.build(name) for name in scenes_synthetic.PAPER}

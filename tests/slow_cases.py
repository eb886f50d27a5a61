"""Cases of parametrized tests that `make test` leaves out: those whose lines of product code its other cases run."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def all_slow_but(quick: Iterable[Any], values: Iterable[Any]) -> list[Any]:
    """Return `values` for `parametrize`, those that are not in `quick` marked slow; a tuple is one case."""
    return [
        value
        if value in quick
        else pytest.param(*(value if isinstance(value, tuple) else [value]), marks=pytest.mark.slow)
        for value in values
    ]

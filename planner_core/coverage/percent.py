"""Coverage in words: one rule, so that a share reads the same wherever it is told. The viewer has it in figures.ts."""

from __future__ import annotations

import math


def reached_percent(share: float, required: float) -> str:
    """Return a share in percent with one decimal; rounded down where it would read as what is required and is not."""
    words = f"{100 * share:.1f}"
    if share < required - 1e-9 and float(words) >= 100 * required:
        return f"{math.floor(1000 * share) / 10:.1f}"
    return words

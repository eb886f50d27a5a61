"""Figures of requirements in words: `spacing 6 mm`, `incidence 65°`, for messages and reports."""

from __future__ import annotations

import math
from dataclasses import fields

from planner_core.model import OverlapMeasure, OverlapOf, PointLimits


def limits_in_words(limits: PointLimits, seen_from: int = 1) -> str:
    """Limits as a user states them, such as `spacing 6 mm, range 20 m, 2 stations`; empty where there are none."""
    parts = [
        f"{name_of(field.name)} {figure_in_words(field.name, limit)}"
        for field in fields(limits)
        if (limit := getattr(limits, field.name)) is not None
    ]
    return ", ".join([*parts, f"{seen_from} stations"] if seen_from > 1 else parts)


def name_of(limit: str) -> str:
    """`spacing` of `spacing_m`, and so on: a limit's name without its unit."""
    return limit.rsplit("_", 1)[0]


def figure_in_words(limit: str, figure: float) -> str:
    """`figure` of the limit named, a field of `PointLimits`, with a unit that suits its size."""
    if limit.endswith("_rad"):
        return f"{math.degrees(figure):.3g}°"
    if figure < 0.1:
        return f"{1000 * figure:.3g} mm"
    return f"{figure:.3g} m"


def overlap_noun(measure: str, of: str) -> str:
    """Return what a share is one of: `overlap`, or where it is not measured as usual, `Jaccard overlap of what is seen
    as required`.
    """
    noun = "Jaccard overlap" if measure == OverlapMeasure.JACCARD else "overlap"
    return noun if of == OverlapOf.ALL_SEEN else f"{noun} of what is seen as required"


def overlap_defined(measure: str, of: str) -> str:
    """Say what overlap is a share of: `the smaller of both shares, of all that is seen`."""
    share = "share of what either sees (Jaccard)" if measure == OverlapMeasure.JACCARD else "smaller of both shares"
    return f"{share}, of {'all that' if of == OverlapOf.ALL_SEEN else 'what'} is seen" + (
        "" if of == OverlapOf.ALL_SEEN else " as required"
    )


def area_in_words(area_m2: float) -> str:
    """Square metres with as many digits as say something."""
    return f"{area_m2:.0f} m2" if area_m2 >= 100 else f"{area_m2:.1f} m2" if area_m2 >= 1 else f"{area_m2:.2f} m2"

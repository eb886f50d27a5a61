"""Values of plan.json: texts, metres, areas, shares, words, as its schema has them and as they are rounded."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field, WithJsonSchema

from planner_core.documents import Number, Whole, words_of
from planner_core.model import (
    REASONS,
    Doors,
    Glass,
    UpAxis,
)
from planner_core.scene.repair import MAX_COORDINATE_M

#: Areas and shares are rounded where they are written; no area in m2 is larger.
_ROUNDING, _MOST = 1e-6, 1e12


def rounded(digits: int) -> AfterValidator:
    """Micrometres for lengths: a file shows no more than is meant. What was read does not change by it."""
    return AfterValidator(lambda value: round(value, digits) + 0.0)


Text = Annotated[str, Field(min_length=1)]
Metres = Annotated[Number, Field(ge=-MAX_COORDINATE_M, le=MAX_COORDINATE_M)]
Point = tuple[Metres, Metres, Metres]
Corner = tuple[Metres, Metres]
Rectangle = tuple[Corner, Corner]
"""Lowest and highest (x, y)."""
Area = Annotated[Number, Field(ge=-_ROUNDING, le=_MOST), rounded(6), WithJsonSchema({"type": "number", "minimum": 0})]
_SHARE = {"type": "number", "minimum": 0, "maximum": 1}
Required = Annotated[Number, Field(ge=0.0, le=1.0)]
"""A share with all its digits: what was required has to be read back as it was, or another plan comes of it."""
Share = Annotated[Number, Field(ge=0.0, le=1 + _ROUNDING), rounded(9), WithJsonSchema(_SHARE)]
Strength = Annotated[Number, Field(ge=0.0, le=_MOST)]
Count = Annotated[Whole, Field(ge=0)]
Seconds = Annotated[Number, Field(ge=0.0), rounded(1)]
GlassWord = Annotated[Glass, words_of(Glass)]
DoorsWord = Annotated[Doors, words_of(Doors)]
UpAxisWord = Annotated[UpAxis, words_of(UpAxis)]
Reason = Annotated[str, Field(examples=list(REASONS), description="docs/method/unseen.md defines the reasons.")]
FloorId = Annotated[str, Field(description="Id of a floor; empty: of none.")]
ElementNumber = Annotated[Count, Field(description="Number of the element in the scene.")]
SeenFrom = Annotated[Whole, Field(ge=1, description="Stations that must each meet the limits for a surface to count.")]

"""Values of documents: texts, metres, areas, shares, words, as schemas have them and as they are rounded in files."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field, GetCoreSchemaHandler, PlainSerializer, WithJsonSchema
from pydantic_core import CoreSchema, core_schema

from planner_core.documents import Number, Whole, words_of
from planner_core.model.choices import (
    Doors,
    Glass,
    NetworkKind,
    Objective,
    OverlapMeasure,
    OverlapOf,
    PreAlignment,
    Role,
    Scope,
    UpAxis,
)
from planner_core.model.unseen import REASONS

MAX_COORDINATE_M = 1e9
"""Coordinates beyond this are damage, not places: the Earth's circumference is 4e7 m."""

#: Areas and shares are rounded where they are written; no area in m2 is larger.
_ROUNDING, _MOST = 1e-6, 1e12


def rounded(digits: int) -> PlainSerializer:
    """Micrometres for lengths: a file shows no more than is meant."""
    return PlainSerializer(lambda value: round(value, digits) + 0.0, return_type=float)


@dataclass(frozen=True)
class UnknownAsNull:
    """Of a figure from 0 to `most` that is NaN where it is not known: null in documents."""

    digits: int
    most: float

    def __get_pydantic_core_schema__(self, _: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_after_validator_function(
            lambda value: math.nan if value is None else value,
            handler.generate_schema(Annotated[Number, Field(ge=0.0, le=self.most)] | None),
            serialization=core_schema.plain_serializer_function_ser_schema(
                lambda value: None if math.isnan(value) else round(value, self.digits) + 0.0
            ),
        )


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
StrengthIfKnown = Annotated[float, UnknownAsNull(9, _MOST)]
ProbabilityIfKnown = Annotated[float, UnknownAsNull(6, 1.0 + _ROUNDING), Field(json_schema_extra={"default": None})]
Count = Annotated[Whole, Field(ge=0)]
Seconds = Annotated[Number, Field(ge=0.0), rounded(1)]
GlassWord = Annotated[Glass, words_of(Glass)]
DoorsWord = Annotated[Doors, words_of(Doors)]
UpAxisWord = Annotated[UpAxis, words_of(UpAxis)]
NetworkWord = Annotated[NetworkKind, words_of(NetworkKind, "joined", "loops")]
ObjectiveWord = Annotated[Objective, words_of(Objective)]
OverlapMeasureWord = Annotated[OverlapMeasure, words_of(OverlapMeasure)]
OverlapOfWord = Annotated[OverlapOf, words_of(OverlapOf)]
PreAlignmentWord = Annotated[PreAlignment, words_of(PreAlignment)]
RoleWord = Annotated[Role, words_of(Role)]
ScopeWord = Annotated[Scope, words_of(Scope)]
Reason = Annotated[str, Field(examples=list(REASONS), description="docs/method/unseen.md defines the reasons.")]
FloorId = Annotated[str, Field(description="Id of a floor; empty: of none.")]
ElementNumber = Annotated[Count, Field(description="Number of the element in the scene.")]
SeenFrom = Annotated[Whole, Field(ge=1, description="Stations that must each meet the limits for a surface to count.")]

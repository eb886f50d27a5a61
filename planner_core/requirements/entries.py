"""The requirements file as one model: entries, their units, what they may be. See docs/formats/requirements.md.

What is left out is None, and follows the requirements of the whole; a limit that is `any` is infinite.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import StrEnum
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, WithJsonSchema

from planner_core.documents import Entries, ShortEntries, YesNo, key_of, shown
from planner_core.errors import RequirementError
from planner_core.model import NetworkKind, OverlapMeasure, OverlapOf, PreAlignment, Scope
from planner_core.positions.outlines import MOST_CORNERS, checked_outline
from planner_core.requirements.deliverables import DELIVERABLES, deliverable_named
from planner_core.requirements.quantities import angle_rad, coordinate_m, count, length_m, plain_number, share
from planner_core.requirements.site import SiteEntries

_MOST_NAMES, _MOST_LETTERS = 1000, 200
_FIGURE = r"([0-9]+([.,][0-9]*)?|[.,][0-9]+)([eE][+-]?[0-9]+)?"
_INCHES = r"([0-9]+([.][0-9]*)?|([0-9]+[\s-]+)?[0-9]+\s*/\s*[1-9][0-9]*)\s*(in|inch|inches|\")"
#: With what stands before it being whole feet, or the whole inches or numerator of a fraction, where inches follow.
_LENGTH = (
    r"(µm|μm|um|mm|cm|m|km|in|inch|inches|\"|ft|ftUS|foot|feet|'|US survey f(oo|ee)t|(milli|centi)?met(re|er)s?"
    rf"|(ft|foot|feet|')\s*-?\s*{_INCHES}|([\s-]+[0-9]+)?\s*/\s*[1-9][0-9]*\s*(in|inch|inches|\"))"
)
_ANGLE = r"(deg|degrees?|°|rad|radians?|gon|grad)"


def _or_none(read: Callable[[Any], float | None]) -> BeforeValidator:
    """Null is as if left out."""
    return BeforeValidator(lambda value: None if value is None else read(value))


def _limit(read: Callable[[Any], float]) -> BeforeValidator:
    """`any`: no limit, where the whole has one."""
    return _or_none(
        lambda value: math.inf if isinstance(value, str) and value.strip().casefold() == "any" else read(value)
    )


def _forms(number: dict[str, Any], unit: str, *more: Any) -> WithJsonSchema:
    """Bare numbers that can't be misread, numbers with a unit, what else is taken, null."""
    text = {"type": "string", "pattern": rf"^\s*[+]?{_FIGURE}\s*{unit}\s*$"}
    return WithJsonSchema({"anyOf": [{"type": "number", **number}, text, *({"const": each} for each in more), _NULL]})


def _shares(*more: Any) -> WithJsonSchema:
    figure = r"([1-9][0-9]?([.,][0-9]*)?|100([.,]0*)?" + ("|0)" if more else ")")
    numbers = [{"exclusiveMinimum": 0, "exclusiveMaximum": 1}, {"exclusiveMinimum": 1, "maximum": 100}]
    text = {"type": "string", "pattern": rf"^\s*{figure}\s*(%|percent|per cent)\s*$"}
    return WithJsonSchema(
        {"anyOf": [*({"type": "number", **each} for each in numbers), text, *({"const": each} for each in more), _NULL]}
    )


_NULL = {"type": "null"}


def _name(value: object) -> str:
    if isinstance(value, int | float) and not isinstance(value, bool):
        value = str(value)
    if not isinstance(value, str) or not value.strip() or len(value) > _MOST_LETTERS or not value.isprintable():
        raise RequirementError(
            f"got {shown(value)}, expected a name of at most {_MOST_LETTERS} letters; put it in quotes"
        )
    return value.strip()


def _names(value: object) -> object:
    """A name, or a list of names."""
    if value is None or (isinstance(value, list | tuple) and 1 <= len(value) <= _MOST_NAMES):
        return value
    if isinstance(value, list | tuple):
        raise RequirementError(f"got {shown(value)}, expected 1 to {_MOST_NAMES} names; leave it out for all")
    return [value]


def _network(value: object) -> NetworkKind | None:
    if value is None:
        return None
    try:
        return NetworkKind(value.strip().casefold() if isinstance(value, str) else "")
    except ValueError:
        raise RequirementError(
            f"got {shown(value)}, expected one of {', '.join(NetworkKind)}; leave it out for {NetworkKind.CONNECTED}"
        ) from None


def _choice(kind: type[StrEnum]) -> BeforeValidator:
    """One of the words of `kind`; as in names of entries, capitals, spaces and hyphens do not matter."""

    def read(value: object) -> object:
        if value is None:
            return None
        word = key_of(value).replace("_", "-") if isinstance(value, str) else ""
        if word not in list(kind):
            raise RequirementError(f"got {shown(value)}, expected one of {', '.join(kind)}; leave it out for the first")
        return kind(word)

    return BeforeValidator(read)


def _scope(value: object) -> Scope | None:
    if value is None:
        return None
    try:
        return Scope(value.strip().casefold() if isinstance(value, str) else "")
    except ValueError:
        raise RequirementError(f"got {shown(value)}, expected one of {', '.join(Scope)}") from None


def _zones(value: object) -> object:
    if value is not None and not isinstance(value, list | tuple):
        raise RequirementError(
            f"got {shown(value)}, expected a list of zones, each with name and outline; begin each with a dash"
        )
    return value


_Name = Annotated[
    str,
    BeforeValidator(_name),
    WithJsonSchema({"anyOf": [{"type": "string", "pattern": r"\S", "maxLength": _MOST_LETTERS}, {"type": "number"}]}),
]
_Names = Annotated[
    tuple[_Name, ...],
    BeforeValidator(
        _names, json_schema_input_type=_Name | Annotated[list[_Name], Field(min_length=1, max_length=1000)]
    ),
]
_Coordinate = Annotated[
    float,
    BeforeValidator(coordinate_m),
    WithJsonSchema(
        {"anyOf": [{"type": "number"}, {"type": "string", "pattern": rf"^\s*[+-]?{_FIGURE}\s*{_LENGTH}?\s*$"}]}
    ),
]
_Outline = Annotated[
    tuple[tuple[_Coordinate, _Coordinate], ...],
    Field(json_schema_extra={"minItems": 3, "maxItems": MOST_CORNERS}),
    AfterValidator(checked_outline),
]
_Share = Annotated[
    float | None,
    _or_none(
        lambda value: 0.0 if isinstance(value, str) and value.strip().casefold() == "none" else share(value, zero=True)
    ),
    _shares("none", 0),
]
# Nobody asks for 0.1 mm between points or of noise, so that numbers below 0.1 are metres.
_FINE = {"exclusiveMinimum": 0, "maximum": 0.1}


class PartEntries(Entries):
    """Requirements of the whole, and of a part."""

    coverage: _Share = None
    """Share of the scannable area, e.g. 95 % or 0.95; none, of a part: it is an obstacle, nothing is required of it."""
    spacing: Annotated[
        float | None,
        _limit(lambda value: length_m(value, bare=(0.0, 0.1), most=1.0, example="6 mm")),
        _forms(_FINE, _LENGTH, "any"),
    ] = None
    """Maximum distance between neighbouring points, e.g. 6 mm; a bare number is metres."""
    range: Annotated[
        float | None,
        _limit(lambda value: length_m(value, bare=(1.0, 10_000.0), most=10_000.0, example="20 m")),
        _forms({"minimum": 1, "maximum": 10_000}, _LENGTH, "any"),
    ] = None
    """Maximum range, e.g. 20 m; a bare number is metres."""
    incidence: Annotated[
        float | None, _limit(angle_rad), _forms({"exclusiveMinimum": 2, "maximum": 90}, _ANGLE, "any")
    ] = None
    """Maximum angle between beam and surface normal, e.g. 65 deg; a bare number is degrees."""
    noise: Annotated[
        float | None,
        _limit(lambda value: length_m(value, bare=(0.0, 0.1), most=1.0, example="2 mm")),
        _forms(_FINE, _LENGTH, "any"),
    ] = None
    """Maximum one sigma of range noise, e.g. 2 mm; a bare number is metres."""
    seen_from: Annotated[
        int | None,
        _or_none(count),
        WithJsonSchema({"anyOf": [{"type": "integer", "minimum": 1, "maximum": 100}, _NULL]}),
    ] = None
    """Minimum number of stations that each meet the limits."""


class FloorEntries(PartEntries, ShortEntries):
    """Requirements of a floor, or only its coverage."""

    name: _Name | None = None
    classes: _Names | None = None


class ClassEntries(PartEntries, ShortEntries):
    """Requirements of elements of a class or name, or only their coverage."""

    name: _Name | None = None
    floors: _Names | None = None


class ZoneEntries(PartEntries):
    """Requirements of a part given by outline, heights, floors or classes."""

    model_config = ConfigDict(
        json_schema_extra={"anyOf": [{"required": [key]} for key in ("outline", "heights", "floors", "classes")]}
    )

    name: _Name | None = None
    outline: _Outline | None = None
    """Corners [x, y], coordinates of the building."""
    heights: tuple[_Coordinate, _Coordinate] | None = None
    """Lowest and highest z, as the building has it."""
    floors: _Names | None = None
    classes: _Names | None = None


class RequirementsFile(PartEntries):
    """Requirements of a survey. Reading takes a little more than this schema (capitals, spaces and hyphens in names of
    entries, numbers as text) and checks what is beyond it: outlines that cross themselves, names that are there twice.
    """

    model_config = ConfigDict(json_schema_extra={"minProperties": 1})

    deliverable: Annotated[
        str | None,
        BeforeValidator(lambda value: None if value is None else deliverable_named(str(value)).name),
        WithJsonSchema({"enum": [*DELIVERABLES, None]}),
    ] = None
    """Deliverable whose limits and overlap hold where this file gives none, e.g. survey."""
    reflectivity: Annotated[float | None, _or_none(lambda value: share(value, example="80 %")), _shares()] = None
    """Of the surfaces met head on, for noise, e.g. 80 %."""
    overlap: Annotated[float | None, _or_none(lambda value: share(value, zero=True, example="30 %")), _shares(0)] = None
    """Minimum overlap of a link between stations, e.g. 30 %."""
    overlap_measure: Annotated[
        OverlapMeasure | None, _choice(OverlapMeasure), WithJsonSchema({"enum": [*map(str, OverlapMeasure), None]})
    ] = None
    """What both stations see, as a share of what the one sees that sees more (smaller-share), or of what either sees
    (jaccard)."""
    overlap_of: Annotated[
        OverlapOf | None, _choice(OverlapOf), WithJsonSchema({"enum": [*map(str, OverlapOf), None]})
    ] = None
    """Surface that overlap is counted on: all-seen, or seen-as-required, where a station meets the limits of all."""
    network: Annotated[
        NetworkKind | None,
        BeforeValidator(_network),
        WithJsonSchema({"enum": [*map(str, NetworkKind), "joined", "loops", None]}),
    ] = None
    """How stations are connected."""
    link_strength: Annotated[
        float | None,
        _or_none(lambda value: plain_number(value, least=0.0, most=1.0)),
        WithJsonSchema({"type": ["number", "null"], "minimum": 0, "maximum": 1}),
    ] = None
    """Least strength of a link."""
    link_probability: Annotated[
        float | None, _or_none(lambda value: share(value, zero=True, example="99 %")), _shares(0)
    ] = None
    """Least probability with which the scans of a link register, e.g. 99 %; 0: none."""
    pre_alignment: Annotated[
        PreAlignment | None, _choice(PreAlignment), WithJsonSchema({"enum": [*map(str, PreAlignment), None]})
    ] = None
    """Where registration starts: tracked, manual, level or none; left out: as the scanner has it."""
    doors_change: YesNo | None = None
    """Whether links have to hold with open doors shut, too."""
    targets: YesNo | None = None
    """Whether targets join what no common surface does; left out: with stations outdoors (`--join outside`)."""
    scope: Annotated[Scope | None, BeforeValidator(_scope), WithJsonSchema({"enum": [*map(str, Scope), None]})] = None
    """What of the building counts, and where stations stand: interior, exterior, all, or auto."""
    planned_floors: _Names | None = None
    """Ids or names of the floors to plan; left out: all."""
    floors: dict[_Name, FloorEntries] | None = None
    classes: dict[_Name, ClassEntries] | None = None
    zones: Annotated[tuple[ZoneEntries, ...] | None, BeforeValidator(_zones)] = None
    site: SiteEntries | None = None

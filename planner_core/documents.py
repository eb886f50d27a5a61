"""What the models of documents have in common: plan.json, requirements, scanner files, reviews.

Each is one pydantic model in the group that owns it. Reading validates by it; `make docs` makes its JSON Schema in
docs/formats of it. What does not fit is reported in one line, by its place in the document.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from difflib import get_close_matches
from enum import StrEnum
from functools import cache
from typing import Annotated, Any, TypeVar

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    PlainSerializer,
    TypeAdapter,
    ValidationError,
    WithJsonSchema,
    model_validator,
    with_config,
)

from planner_core.errors import PlannerError, RequirementError

Number = Annotated[
    float, Field(strict=True, allow_inf_nan=False), PlainSerializer(lambda value: value + 0.0, return_type=float)
]
"""Finite; whole numbers too, true and false not. -0.0 is written as 0.0."""
Whole = Annotated[int, Field(strict=True)]
YesNo = Annotated[bool, Field(strict=True)]
_Class = TypeVar("_Class")

_SHOWN_CHARACTERS = 60
_EXPECTED = {
    "string_type": "text",
    "string_unicode": "Unicode text",
    "float_type": "a finite number",
    "finite_number": "a finite number",
    "int_type": "a whole number",
    "bool_type": "true or false",
    "list_type": "a list",
    "tuple_type": "a list",
    "dict_type": "keys with values",
    "model_type": "keys with values",
    "dataclass_type": "keys with values",
    "model_attributes_type": "keys with values",
    "greater_than": "more than {gt:g}",
    "greater_than_equal": "{ge:g} or more",
    "less_than_equal": "at most {le:g}",
    "literal_error": "{expected}",
    "enum": "{expected}",
    "string_too_short": "text of one character or more",
    "too_short": "at least {min_length}",
    "too_long": "at most {max_length}",
    "string_pattern_mismatch": "text that matches {pattern}",
}


class Document(BaseModel):
    """A mapping of a document. Keys that it does not know are ignored: newer versions may write them."""

    model_config = ConfigDict(use_attribute_docstrings=True, populate_by_name=True, frozen=True)

    @classmethod
    def of(cls, value: object) -> dict[str, Any]:
        """Return the file's entry for an object with attributes of these names, as plain dicts and lists."""
        return cls.model_validate(value, from_attributes=True).model_dump(mode="json", by_alias=True)


def document(kind: type[_Class]) -> type[_Class]:
    """Make a dataclass a mapping of a document, as `Document` is: its fields' types and docstrings are the schema."""
    return with_config(ConfigDict(use_attribute_docstrings=True))(kind)


def to_document(value: object) -> dict[str, Any]:
    """Return the file's entry for such a dataclass, as plain dicts and lists."""
    kind: Any = type(value)
    entry: dict[str, Any] = _adapter(kind).dump_python(value, mode="json", by_alias=True)
    return entry


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    return TypeAdapter(kind)


class Entries(Document):
    """A mapping that people write: capitals, spaces and hyphens in keys do not matter, unknown keys are refused."""

    model_config = ConfigDict(extra="forbid")

    @model_validator(mode="before")
    @classmethod
    def _by_known_keys(cls, value: object) -> object:
        if not isinstance(value, Mapping):
            return value
        known = [field.alias or name for name, field in cls.model_fields.items()]
        found: dict[str, Any] = {}
        for key, entry in value.items():
            name = key_of(str(key))
            if name not in known:
                near = get_close_matches(name, known, n=1, cutoff=0.6)
                hint = f"did you mean {near[0]}?" if near else f"known are {', '.join(known)}"
                raise RequirementError(f"got the unknown entry {shown(key)}, expected a known one; {hint}")
            if name in found:
                raise RequirementError(f"got {name} twice, expected it once; leave one out")
            found[name] = entry
        return found

    def given(self) -> set[str]:
        """Return the keys that say something: null is as if left out."""
        return {name for name in self.model_fields_set if getattr(self, name) is not None}


def _or_its_first(schema: dict[str, Any]) -> None:
    entries = dict(schema)
    schema.clear()
    schema["anyOf"] = [entries, next(iter(entries["properties"].values()))]


class ShortEntries(Entries):
    """Entries, or in their place only the value of the first of them."""

    model_config = ConfigDict(json_schema_extra=_or_its_first)

    @model_validator(mode="before")
    @classmethod
    def _of_first(cls, value: object) -> object:
        return value if isinstance(value, Mapping) else {next(iter(cls.model_fields)): value}


def key_of(text: str) -> str:
    """Return a key as documents have it: `Seen-From` is `seen_from`."""
    return "_".join(text.casefold().replace("-", " ").replace("_", " ").split())


def read_as(
    model: type[_Class], value: object, where: str, *, remedy: str, error: type[PlannerError] = RequirementError
) -> _Class:
    """Validate a document.

    Parameters
    ----------
    where
        What messages begin with, up to the place in the document: `contract.yaml: `, `site.`.
    remedy
        What to do, where what does not fit does not say so itself.

    Raises
    ------
    PlannerError
        `error`, in one line: the first value that does not fit, by its place, and what was expected there.
    """
    try:
        kind: Any = model
        read: _Class = _adapter(kind).validate_python(value)
        return read
    except ValidationError as refused:
        found = refused.errors(include_url=False)[0]
        place, message = _place(found["loc"], value), _message(found, remedy)
        raise error(f"{where}{place}: {message}" if place else f"{where.rstrip(': .')}: {message}") from refused


def is_deeper(document: object, levels: int) -> bool:
    """Whether lists and mappings are inside each other more than so often: what walks them recurses."""
    level = [document]
    for _ in range(levels):
        level = [inner for each in level for inner in _inside(each)]
        if not level:
            return False
    return True


def _inside(value: object) -> list[Any]:
    return list(value.values()) if isinstance(value, dict) else value if isinstance(value, list) else []


def shown(value: object) -> str:
    """`value` as a message may hold it: short, and in one line."""
    try:
        text = repr(value)
    except ValueError:  # a whole number of more digits than Python writes
        text = "a number of thousands of digits"
    return text if len(text) <= _SHOWN_CHARACTERS else text[:_SHOWN_CHARACTERS] + " ..."


def words_of(kind: type[StrEnum], *earlier: str) -> WithJsonSchema:
    """Schema of a choice: its words, and those of earlier versions."""
    return WithJsonSchema({"enum": [*(str(each) for each in kind), *earlier], "type": "string"})


def schema_text(model: type[BaseModel], name: str) -> str:
    """Return the JSON Schema of a document as text of a file; `name` as in `tlsplan:plan:1`."""
    schema = {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": name, **model.model_json_schema()}
    written = model.model_json_schema(mode="serialization").get("$defs", {})
    for kind, of in schema.get("$defs", {}).items():
        _add_computed(of, written[kind])
    return json.dumps(_untitled(schema), indent=2, ensure_ascii=False) + "\n"


def _add_computed(of: dict[str, Any], written: Mapping[str, Any]) -> None:
    """Add the properties that are written and not read: computed from the others."""
    for name, value in written.get("properties", {}).items():
        if value.get("readOnly"):
            of["properties"][name] = {key: each for key, each in value.items() if key != "readOnly"}
            if "default" not in value:
                of["required"].append(name)


def _message(found: Any, remedy: str) -> str:
    own = found.get("ctx", {}).get("error")
    if isinstance(own, PlannerError):  # raised by a validator of ours: the whole message
        return str(own)
    if found["type"] == "missing" and isinstance(found["loc"][-1], int):
        return f"got {shown(found['input'])}, expected a longer list; {remedy}"
    if found["type"] == "missing":
        return f"got no {found['loc'][-1]}, expected all that is needed; {remedy}"
    expected = _EXPECTED.get(
        found["type"], found["msg"].removeprefix("Input should be ").replace("{", "{{").replace("}", "}}")
    )
    got = f"{len(found['input'])} of them" if found["type"] in ("too_short", "too_long") else shown(found["input"])
    return f"got {got}, expected {' '.join(expected.format(**found.get('ctx', {})).split())}; {remedy}"


def _place(steps: tuple[int | str, ...], document: Any) -> str:
    """The way to a value, as `registration.links[3].a`. Steps that the document lacks name branches of a union."""
    place = ""
    for step in steps:
        if isinstance(document, list | tuple) and isinstance(step, int) and step < len(document):
            document, place = document[step], f"{place}[{step}]"
        elif isinstance(document, Mapping) and step in document:
            text = str(step) if str(step).isprintable() else repr(step)
            document, place = document[step], f"{place}.{text}" if place else text
    return place


#: pydantic leaves limits behind a validator by names of its own.
_LIMITS = {"gt": "exclusiveMinimum", "ge": "minimum", "lt": "exclusiveMaximum", "le": "maximum"}


def _untitled(schema: Any, *, is_properties: bool = False) -> Any:
    """Without the titles that pydantic makes of names, and with limits as JSON Schema names them."""
    if isinstance(schema, list):
        return [_untitled(each) for each in schema]
    if not isinstance(schema, dict):
        return schema
    return {
        key if is_properties else _LIMITS.get(key, key): _untitled(
            _in_json(value) if key == "description" and not is_properties else value,
            is_properties=key in ("properties", "$defs") and not is_properties,
        )
        for key, value in schema.items()
        if key != "title" or is_properties
    }


def _in_json(docstring: Any) -> Any:
    """A docstring in words of JSON."""
    return re.sub(r"\bNone\b", "null", docstring) if isinstance(docstring, str) else docstring

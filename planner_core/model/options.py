"""Settings of a planning method as text: ("spatial.step_m", "0.1") pairs -> `Method`, and back.

For what is written and read: the command line's `--set NAME=VALUE`, and `method_options` of plan.json. Names are those
of the dataclasses' fields, with a dot between a part and its field; values are text, read as the field's type.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, is_dataclass, replace
from difflib import get_close_matches
from typing import Any, TypeVar

from planner_core.errors import RequirementError
from planner_core.model.methods import METHODS, Method

_Settings = TypeVar("_Settings")


def method_of(name: str, options: Iterable[tuple[str, str]] = ()) -> Method:
    """Return the method of that name, with options.

    Raises
    ------
    RequirementError
        There is none of that name; and as `with_options`.
    """
    if name not in METHODS:
        raise RequirementError(f"method: got {name!r}, expected one of {', '.join(METHODS)}")
    method = METHODS[name]()
    given = list(options)
    if given and not fields(method):
        raise RequirementError(
            f"option {given[0][0]}: got it with method {name}, which has none; use method proven or paper"
        )
    return with_options(method, given)


def options_of(method: Method) -> dict[str, str]:
    """Options that make `method` what it is: those that differ from their defaults, as `method_of` takes them."""
    defaults = dict(option_list(METHODS[method.name]()))
    return {name: as_text(value) for name, value in option_list(method) if value != defaults[name]}


def as_text(value: Any) -> str:
    """A value of an option as `with_options` reads it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        return ",".join(as_text(part) for part in value)
    return str(value).lower().removesuffix(".0")


def with_options(settings: _Settings, options: Iterable[tuple[str, str]]) -> _Settings:
    """Return `settings` with some fields replaced, all of them at once: those that depend on each other fit together.

    Raises
    ------
    RequirementError
        An unknown name, a name given twice, a value that is not of the field's type, or what the dataclass refuses.
    """
    changed: _Settings = _replaced(settings, dict(_once(options)), known=[name for name, _ in option_list(settings)])
    return changed


def option_list(settings: object, prefix: str = "") -> list[tuple[str, Any]]:
    """Names and values of all options of a settings dataclass, in the order of its fields."""
    found: list[tuple[str, Any]] = []
    for field in fields(settings):  # type: ignore[arg-type]
        value = getattr(settings, field.name)
        if is_dataclass(value):
            found += option_list(value, f"{prefix}{field.name}.")
        else:
            found.append((prefix + field.name, value))
    return found


def _once(options: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    seen: dict[str, str] = {}
    for name, value in options:
        if name in seen:
            raise RequirementError(f"option {name}: got {seen[name]!r} and {value!r}, expected it once; leave one out")
        seen[name] = value
    return list(seen.items())


def _replaced(settings: Any, options: dict[str, str], *, known: list[str], prefix: str = "") -> Any:
    changes: dict[str, Any] = {}
    parts: dict[str, dict[str, str]] = {}
    names = {field.name for field in fields(settings)}
    for name, text in options.items():
        head, _, rest = name.partition(".")
        if head not in names or bool(rest) != is_dataclass(getattr(settings, head)):
            raise _unknown(prefix + name, known)
        if rest:
            parts.setdefault(head, {})[rest] = text
        else:
            kind = next(str(field.type) for field in fields(settings) if field.name == head)
            changes[head] = _read(prefix + name, text, getattr(settings, head), kind)
    for head, inner in parts.items():
        changes[head] = _replaced(getattr(settings, head), inner, known=known, prefix=f"{prefix}{head}.")
    return replace(settings, **changes)


def _unknown(name: str, known: list[str]) -> RequirementError:
    near = get_close_matches(name, known, n=3)
    expected = f"perhaps {' or '.join(near)}" if near else f"expected one of {', '.join(known)}"
    return RequirementError(f"option {name}: there is none of that name, {expected}")


def _read(name: str, text: str, default: Any, annotation: str) -> Any:
    """`text` as what the field's annotation allows."""
    kind, _, or_none = annotation.partition(" | ")
    if or_none and text.lower() == "none":
        return None
    try:
        if kind == "bool":
            return {"yes": True, "true": True, "no": False, "false": False}[text.lower()]
        if kind == "int":
            return int(text)
        if kind == "float":
            return float(text)
        if kind.startswith("tuple"):
            return tuple(float(part) for part in text.split(","))
    except (ValueError, KeyError):
        what = {"bool": "yes or no", "int": "a whole number", "float": "a number"}.get(kind, "numbers, comma-separated")
        raise RequirementError(f"option {name}: got {text!r}, expected {what}; the default is {default}") from None
    return text

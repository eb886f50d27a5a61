"""Checks of single values of a scanner file: text, numbers, counts, whole steps. Value -> checked value, or one line.

Every refusal is a `RequirementError` that names the file, what it says, what was expected and what to do.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Collection
from typing import Any

from planner_core.errors import RequirementError

#: Steps that first and last may be apart by more or less than a whole number: decimal fractions of a degree.
_STEP_SLACK = 1e-6
_REMEDY = "compare docs/formats/scanner.md"
#: Of a value that is told again in a message.
_SHOWN_CHARACTERS = 60


def bad(where: str, got: str, expected: str, remedy: str = _REMEDY) -> RequirementError:
    """Return the error to raise; `where` is the file or the scanner's name."""
    return RequirementError(f"scanner {where}: got {got}, expected {expected}; {remedy}")


def shown(value: object) -> str:
    """`value` as a message may hold it: short, and in one line."""
    try:
        text = repr(value)
    except ValueError:  # a whole number of more digits than Python writes
        text = "a number of thousands of digits"
    return text if len(text) <= _SHOWN_CHARACTERS else text[:_SHOWN_CHARACTERS] + " ..."


def one_line(name: str) -> str:
    """A path or name as a message may hold it: line breaks and what else can't be printed as question marks."""
    return "".join(character if character.isprintable() else "?" for character in name)


def listed(names: Collection[object]) -> str:
    """Keys of a file as a message may hold them: sorted, in one line."""
    return shown(", ".join(sorted(map(str, names)))).strip("'\"") or "nothing"


def json_object(text: str, where: str) -> dict[str, Any]:
    """Parse a file's text, which has to be one JSON object."""
    try:
        spec = json.loads(text)
    except json.JSONDecodeError as error:
        raise bad(where, f"not JSON (line {error.lineno}: {error.msg})", "a JSON object") from error
    except (ValueError, RecursionError) as error:  # whole numbers of thousands of digits; a thousand brackets
        raise bad(where, "numbers or brackets beyond what JSON readers take", "a JSON object") from error
    if not isinstance(spec, dict):
        raise bad(where, shown(spec), "a JSON object")
    return spec


def check_keys(
    value: Any, what: str, where: str, *, needed: Collection[str], optional: Collection[str] = ()
) -> dict[str, Any]:
    """Return `value`, an object with all of `needed` and nothing beside them and `optional`; `what` is its key."""
    prefix = f"{what}: " if what else ""
    if not isinstance(value, dict):
        raise bad(where, f"{prefix}{shown(value)}", "an object with " + ", ".join(sorted(needed)))
    if missing := sorted(set(needed) - value.keys()):
        raise bad(where, f"{prefix}no {', '.join(missing)}", "all of " + ", ".join(sorted(needed)))
    if unknown := sorted(value.keys() - set(needed) - set(optional)):
        raise bad(where, f"{prefix}unknown {listed(unknown)}", "only " + ", ".join(sorted({*needed, *optional})))
    return value


def text(value: object, key: str, where: str) -> str:
    """Return a text that is not blank, and that other programs can have."""
    if not (isinstance(value, str) and value.strip() and _is_utf8(value)):
        raise bad(where, f"{key} = {shown(value)}", "a text")
    return value


def _is_utf8(value: str) -> bool:
    """Half a character (a lone surrogate) is none in UTF-8."""
    try:
        value.encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True


def number(value: object, key: str, where: str) -> float:
    """Return a finite number; True and False are none."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= sys.float_info.max:
        raise bad(where, f"{key} = {shown(value)}", "a finite number")
    return float(value)


def measure(value: object, key: str, where: str, *, above: float, most: float) -> float:
    """Return a number in above < number <= most: what a figure with a unit may be at all."""
    found = number(value, key, where)
    if not above < found <= most:
        raise bad(where, f"{key} = {found:g}", f"more than {above:g} and at most {most:g}; mind the unit")
    return found


def count(value: object, key: str, where: str, most: int) -> int:
    """Return a whole number from 1 to `most`."""
    found = number(value, key, where)
    if found != int(found) or not 1 <= found <= most:
        raise bad(where, f"{key} = {found:g}", f"a whole number from 1 to {most}")
    return int(found)


def whole_steps(span_deg: float, step_deg: float, key: str, where: str, *, most: int) -> int:
    """Return how often `step_deg` fits in `span_deg`: a whole number of times, or it is refused."""
    if not step_deg > 0 or span_deg / step_deg >= most:
        raise bad(where, f"{key}.step = {step_deg:g}", f"a positive angle, less than {most} steps")
    steps = span_deg / step_deg
    if abs(steps - round(steps)) > _STEP_SLACK * max(1.0, steps):
        got = f"{key}.step = {step_deg:g}, {steps:.6g} times in {span_deg:g} degrees"
        raise bad(where, got, "a whole number of steps; change the step or give a count")
    return round(steps)

"""Tables that people bring along as text: control points, station lists. A file -> its text, or what is wrong."""

from __future__ import annotations

import re
from pathlib import Path

from planner_core.errors import PlannerError
from planner_core.model import LengthUnit
from planner_core.model.site_frame import unit_named

_LONGEST_NAME = 200
"""Of a column that may name a unit: the search for one takes the square of it."""
_IN_BRACKETS = re.compile(r"[\[(](.*?)[\])]")
_AFTER_NAME = re.compile(
    r"(.*?[a-z].*?)[\s_\-]+((?:us[\s_\-]?)?(?:survey[\s_\-]?)?(?:ft|foot|feet)|m|met(?:er|re)s?|ft[\s_\-]?us|usft)",
    re.IGNORECASE,
)


def column_unit(name: str) -> tuple[str, LengthUnit | None]:
    """Part a column's name, `E_ftUS`, `Easting (US survey feet)`, `x [m]`, from its unit; None: it names none."""
    bare = name.strip()
    if len(bare) > _LONGEST_NAME:
        return bare, None
    bracketed = _IN_BRACKETS.search(bare)
    unit = None if bracketed is None else unit_named(bracketed[1])
    bare = _IN_BRACKETS.sub("", bare).strip()
    after = _AFTER_NAME.fullmatch(bare)
    return (bare, unit) if after is None else (after[1], unit or unit_named(after[2]))


def text_of(path: Path, what: str, error_type: type[PlannerError]) -> str:
    """Read a text in UTF-8, with or without a byte order mark.

    Parameters
    ----------
    what
        What is expected in the file, for messages: `control points`.
    error_type
        Of what is raised.

    Raises
    ------
    PlannerError
        Of `error_type`: there is no such file, it can't be read, or it is in another encoding, with the line.
    """
    try:
        raw = path.read_bytes()
    except FileNotFoundError:
        raise error_type(f"{path}: no such file, expected {what}; check the path") from None
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise error_type(f"{path}: can't be read ({reason}), expected {what}; check the file") from error
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1  # `object` is without the mark that `raw` may begin with
        raise error_type(
            f"{path}, line {line}: byte 0x{error.object[error.start]:02x} is not UTF-8, expected {what} in UTF-8; save "
            "the file as UTF-8 (in Excel as 'CSV UTF-8'), or write its names without accents"
        ) from error

"""Tables that people bring along as text: control points, station lists. A file -> its text, or what is wrong."""

from __future__ import annotations

from pathlib import Path

from planner_core.errors import PlannerError


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

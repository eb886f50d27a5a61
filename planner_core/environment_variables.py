"""Values of environment variables: sizes of memory such as `8GB`, limits, and the date of what is written.

Raises `EnvironmentVariableError` where a value is none of these.
"""

from __future__ import annotations

import math
import os
import re
from datetime import UTC, datetime

from planner_core.errors import EnvironmentVariableError

#: https://reproducible-builds.org/specs/source-date-epoch: packages read it, too, and fail where it is no whole number.
DATE_VARIABLE = "SOURCE_DATE_EPOCH"
_SIZE = re.compile(r"(\d+(?:\.\d+)?) ?(MB|GB|MiB|GiB)", re.IGNORECASE)
_UNITS = {"mb": 10**6, "gb": 10**9, "mib": 2**20, "gib": 2**30}


def memory_from_env(variable: str, *, or_none: bool = False) -> int | None:
    """Bytes that a variable names; None where it is not set. or_none : 0 is one of its values."""
    text = os.environ.get(variable, "").strip()
    if not text:
        return None
    if or_none and text == "0":
        return 0
    parts = _SIZE.fullmatch(text)
    n_bytes = float(parts[1]) * _UNITS[parts[2].lower()] if parts is not None else 0.0
    if not 1 <= n_bytes < math.inf:
        raise _wrong(variable, text, f"a size such as 8GB or 500MB{', or 0 for none' if or_none else ''}")
    return int(n_bytes)


def limit_from_env(variable: str, unit: str) -> float | None:
    """A limit, 0 for none, that a variable names; None where it is not set."""
    text = os.environ.get(variable, "").strip()
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 <= value < math.inf:
        raise _wrong(variable, text, f"{unit}, or 0 for no limit")
    return value


def date_from_env() -> datetime | None:
    """The date that `DATE_VARIABLE` names; None where it is not set."""
    text = os.environ.get(DATE_VARIABLE)
    if text is None:
        return None
    try:
        return datetime.fromtimestamp(int(text if text.isascii() and text.isdecimal() else "none"), UTC)
    except (ValueError, OverflowError, OSError) as error:
        raise _wrong(DATE_VARIABLE, text, "whole seconds since 1970-01-01, up to the year 9999") from error


def _wrong(variable: str, text: str, expected: str) -> EnvironmentVariableError:
    return EnvironmentVariableError(f"{variable}: got {text[:40]!r}, expected {expected}; correct or unset it")

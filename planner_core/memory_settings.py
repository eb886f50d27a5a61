"""Sizes of memory that the environment names, such as `8GB`."""

from __future__ import annotations

import os
import re

from planner_core.errors import RequirementError

_SIZE = re.compile(r"(\d+(?:\.\d+)?) ?(MB|GB|MiB|GiB)", re.IGNORECASE)
_UNITS = {"mb": 10**6, "gb": 10**9, "mib": 2**20, "gib": 2**30}


def memory_from_env(variable: str) -> int | None:
    """Bytes that a variable of the environment names; None where it is not set.

    Raises
    ------
    RequirementError
        It is no size.
    """
    text = os.environ.get(variable, "").strip()
    if not text:
        return None
    parts = _SIZE.fullmatch(text)
    if parts is None or float(parts[1]) == 0:
        raise RequirementError(f"{variable}: got {text!r}, expected a size such as 8GB or 500MB; correct or unset it")
    return int(float(parts[1]) * _UNITS[parts[2].lower()])

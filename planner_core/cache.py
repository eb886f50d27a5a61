"""What is found out once on a machine and kept for its user: small JSON documents in one folder.

A document is named by a hash of what it holds for (device, driver, kernels ...): where one of these changes, no file is
found. A file that can't be read counts as none, and one that can't be written is never an error of the work at hand.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from planner_core.errors import RequirementError

#: Names the folder, in place of `tlsplan` in the user's cache folder.
CACHE_VARIABLE = "TLSPLAN_CACHE"


def cache_folder() -> Path | None:
    """TLSPLAN_CACHE, else `tlsplan` in the user's cache folder; None where the environment names no home."""
    own = os.environ.get(CACHE_VARIABLE)
    if own:
        return Path(own)
    shared = os.environ.get("XDG_CACHE_HOME")
    if shared and Path(shared).is_absolute():  # by the specification relative ones are ignored
        return Path(shared) / "tlsplan"
    home = os.environ.get("HOME")
    return Path(home) / ".cache" / "tlsplan" if home else None


def kept_file(kind: str, holds_for: Mapping[str, str]) -> Path | None:
    """Where the document of a kind that holds for these facts is kept, whether it is there or not."""
    folder = cache_folder()
    if folder is None:
        return None
    key = "\n".join(holds_for.values())
    return folder / f"{kind}-{hashlib.sha256(key.encode()).hexdigest()[:16]}.json"


def read_kept(file: Path, schema: str) -> dict[str, Any]:
    """Return the document of a file.

    Raises
    ------
    OSError
        It is not there, or can't be read.
    ValueError
        It is no JSON document of this schema.
    """
    document: Any = json.loads(file.read_text(encoding="utf-8"))
    if not isinstance(document, dict) or document.get("schema") != schema:
        raise ValueError(f"no document of {schema}")
    return document


def no_folder() -> RequirementError:
    """Return the refusal of an answer that has no place to be kept."""
    return RequirementError(
        f"cache folder: got none, expected HOME, XDG_CACHE_HOME or {CACHE_VARIABLE} to be set; set {CACHE_VARIABLE}"
    )


def check_keeps() -> None:
    """Refuse, before any work, an answer that could not be kept: a file is written and removed.

    Raises
    ------
    RequirementError
        There is no cache folder, or it can't be written.
    """
    folder = cache_folder()
    if folder is None:
        raise no_folder()
    trial = folder / f"trial-{os.getpid()}.json"
    try:
        keep(trial, {})
        trial.unlink()
    except OSError as error:
        raise RequirementError(
            f"{folder}: can't be written ({error.strerror}), expected a writable cache folder for the result; set "
            f"{CACHE_VARIABLE} to one"
        ) from error


def keep(file: Path, document: Mapping[str, Any]) -> None:
    """Write a document, whole or not at all.

    Raises
    ------
    OSError
        The folder can't be made or written.
    """
    beside = file.with_name(f".{file.name}.{os.getpid()}")
    file.parent.mkdir(parents=True, exist_ok=True)
    try:
        beside.write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
        beside.replace(file)
    finally:
        beside.unlink(missing_ok=True)

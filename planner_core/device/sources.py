"""Texts of the OpenCL kernels, as the driver compiles them, and their hash."""

from __future__ import annotations

import hashlib
import re
from functools import cache
from importlib import resources

_INCLUDE = re.compile(r'^\s*#include\s+"([\w.]+)"\s*$')


@cache
def kernel_source(file: str) -> str:
    """Text of `kernels/<file>` with our own includes expanded, each once: no include path is needed to build it.

    Read once a process: every launch asks for its program by this text, and reading took a third of a scan's time.
    """
    return expand_includes(_read(file), file)


def expand_includes(text: str, file: str, seen: set[str] | None = None) -> str:
    """Replace `#include "x"` by the text of `kernels/x`, the first time; keep line numbers for the compiler."""
    seen = {file} if seen is None else seen
    lines = [f'#line 1 "{file}"']
    for number, line in enumerate(text.splitlines(), 1):
        include = _INCLUDE.match(line)
        if include is None:
            lines.append(line)
            continue
        if (name := include[1]) not in seen:
            seen.add(name)
            lines.append(expand_includes(_read(name), name, seen))
        lines.append(f'#line {number + 1} "{file}"')
    return "\n".join(lines)


@cache
def kernels_hash() -> str:
    """Hash of all kernel sources: what was found out with others holds no longer."""
    digest = hashlib.sha256()
    for source in sorted(resources.files("planner_core.kernels").iterdir(), key=lambda entry: entry.name):
        if source.name.endswith((".cl", ".h")):
            digest.update(source.name.encode())
            digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def _read(file: str) -> str:
    return (resources.files("planner_core.kernels") / file).read_text(encoding="utf-8")

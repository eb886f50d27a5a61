"""Patterns of names: `*` stands for any letters, none too, and `?` for any one; all else is what it is."""

from __future__ import annotations

from fnmatch import fnmatchcase


def fits(pattern: str, name: str) -> bool:
    """Whether the whole of a name is as a pattern says, capitals and all."""
    return fnmatchcase(name, pattern.replace("[", "[[]"))

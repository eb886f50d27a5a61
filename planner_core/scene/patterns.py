"""Patterns of names and classes: `*` stands for any letters, none too, and `?` for any one; all else is what it is."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches
from fnmatch import fnmatchcase

import numpy as np

from planner_core.model import BoolArray, Element

#: Before a pattern that is of names alone.
_NAME = "name="
#: Most classes named in a message to a user whose own matched nothing.
_MOST_NAMED = 12


def fits(pattern: str, name: str) -> bool:
    """Whether the whole of a name matches a pattern, capitals and all."""
    return fnmatchcase(name, pattern.replace("[", "[[]"))


def elements_named(elements: Sequence[Element], pattern: str) -> BoolArray:
    """(E,) bool: elements whose class or name fits, capitals or not; without `*`, also those of classes below it.

    `IfcFurnishingElement` is IfcFurniture too, `IfcWall*` is only classes that are written so, `name=*chair*` only
    names.
    """
    wanted = pattern.casefold()
    only_names = wanted.startswith(_NAME)
    wanted = wanted.removeprefix(_NAME)

    def is_meant(element: Element) -> bool:
        if fits(wanted, element.name.casefold()):
            return True
        classes = () if only_names else (element.kind, *element.parents)
        return any(
            each.casefold() == wanted or (each == element.kind and fits(wanted, each.casefold())) for each in classes
        )

    found: dict[tuple[str, str], bool] = {}
    for element in elements:
        if (element.kind, element.name) not in found:
            found[element.kind, element.name] = is_meant(element)
    return np.array([found[element.kind, element.name] for element in elements], dtype=np.bool_)


def known_classes(elements: Sequence[Element], pattern: str) -> str:
    """Classes that a user may have meant, the nearest alone where one is near."""
    kinds = sorted({element.kind for element in elements})
    near = get_close_matches(pattern, kinds, n=1, cutoff=0.75)
    if near:
        return near[0]
    return "one of " + ", ".join(kinds[:_MOST_NAMED]) + (" ..." if len(kinds) > _MOST_NAMED else "")

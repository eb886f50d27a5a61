"""Faults of an IFC file that IfcOpenShell does not report, found before it makes shapes.

Some end the process which asks it: it hangs or crashes on an element whose GlobalId is no text, on a shape that is a
part of itself, and on chains so long that its stack runs out; a few shapes placed in each other a few times each take
it years. References are followed in the file's text: an instance names those that it is made of, so that no valid file
has a way back.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.errors import SceneError, grouped
from planner_core.model import BoolArray, FloatArray, Int64Array

MOST_IN_A_CHAIN = 2000
"""Instances that name one another in a row. The longest in real files are chains of cuts, of some hundreds."""
MOST_IN_A_SHAPE = 1e8
"""Instances of one element's shape, counted as often as they are placed in it."""
_HEAD = re.compile(rb"\s*=\s*(\w+)\s*\(\s*(''|[^,)]{0,20})")
_NO_LOCATION = re.compile(rb"#(\d+)\s*=\s*(IFCAXIS2PLACEMENT[23]D)\s*\(\s*[$*]", re.IGNORECASE)
_MOST_DIGITS = 18
_NAMED = 3


def check_ids(path: Path, bare: bytes, ids: set[int]) -> None:
    """Refuse an element whose first attribute, its GlobalId, is no text.

    Parameters
    ----------
    bare : the file's text without the contents of strings. ids : numbers of the elements whose shapes are wanted.

    Raises
    ------
    SceneError
        Names the element, and how many more there are.
    """
    wrong = []
    for match in re.finditer(rb"#(\d{1,18})" + _HEAD.pattern, bare) if ids else ():
        if match.group(3) != b"''" and int(match.group(1)) in ids:
            wrong.append((match.group(1).decode(), match.group(2).decode(), match.group(3).decode("ascii", "replace")))
    if wrong:
        number, kind, got = wrong[0]
        more = f" (and {grouped(len(wrong) - 1)} more)" if len(wrong) > 1 else ""
        raise SceneError(
            f"{path.name}: the GlobalId of #{number} ({kind}){more} is {got}, expected a text of 22 characters; give "
            "it one, or export the file again."
        )


def check_openings(path: Path, relations: list[Any]) -> None:
    """Refuse an IfcRelVoidsElement whose opening is none, or is placed nowhere: IfcOpenShell leaves that one uncut."""
    for relation in relations:
        opening = relation.RelatedOpeningElement
        if opening is not None and not opening.is_a("IfcFeatureElementSubtraction"):
            raise SceneError(
                f"{path.name}: #{relation.id()} ({relation.is_a()}) cuts #{opening.id()} ({opening.is_a()}) out of an "
                "element, expected an opening; repair it, or export the file again."
            )
        placement = None if opening is None else opening.ObjectPlacement
        if placement is not None and placement.is_a("IfcLocalPlacement") and placement.RelativePlacement is None:
            raise SceneError(
                f"{path.name}: #{placement.id()} (IfcLocalPlacement) of opening #{opening.id()} lacks "
                "RelativePlacement, which its schema requires; repair it, or export the file again."
            )


def unplaced(path: Path, products: list[Any]) -> tuple[str, ...]:
    """A line about products that nothing places, in a file that places others; none where there are none."""
    lacking = [product for product in products if product.ObjectPlacement is None]
    if not lacking or len(lacking) == len(products):
        return ()
    names = ", ".join(f"{product.is_a()} {product.Name or product.GlobalId}" for product in lacking[:_NAMED])
    more = f" and {grouped(len(lacking) - _NAMED)} more" if len(lacking) > _NAMED else ""
    some = "1 product has" if len(lacking) == 1 else f"{grouped(len(lacking))} products have"
    return (
        f"{path.name}: {some} no placement (ObjectPlacement), so each is taken as drawn from the file's origin: "
        f"{names}{more}; correct the file if they belong elsewhere.",
    )


def check_places(path: Path, bare: bytes) -> None:
    """Refuse axes without a location: IfcOpenShell puts a storey there at its origin, and leaves an opening uncut."""
    if found := _NO_LOCATION.search(bare):
        raise SceneError(
            f"{path.name}: #{int(found[1])} ({found[2].decode().upper()}) lacks Location, which its schema requires; "
            "repair it, or export the file again."
        )


def check_references(path: Path, bare: bytes, ids: set[int]) -> None:
    """Refuse elements that are made of themselves, of too long a chain, or of too many parts; as `check_ids`."""
    graph = _graph(bare)
    if graph is None or not ids:
        return
    needed = _reached(graph, np.isin(graph.numbers, np.fromiter(ids, np.int64, len(ids))))
    depth, n_parts = _peeled(graph)
    if (endless := np.flatnonzero(needed & (depth < 0))).size:
        in_loop = _in_loop(graph, int(endless[0]))
        raise SceneError(
            f"{path.name}: {_title(graph, bare, in_loop)} is made of itself, expected references that lead to other "
            "instances; repair it, or export the file again."
        )
    if (long := np.flatnonzero(needed & (depth > MOST_IN_A_CHAIN))).size:
        raise SceneError(
            f"{path.name}: {_title(graph, bare, int(long[0]))} stands on a chain of more than "
            f"{grouped(MOST_IN_A_CHAIN)} instances, expected fewer; repair it, or export the file again."
        )
    elements = np.flatnonzero(np.isin(graph.numbers, np.fromiter(ids, np.int64, len(ids))))
    if (many := elements[n_parts[elements] > MOST_IN_A_SHAPE]).size:
        worst = int(many[0])
        raise SceneError(
            f"{path.name}: the shape of {_title(graph, bare, worst)} has {n_parts[worst]:.1g} parts placed in each "
            f"other, expected at most {MOST_IN_A_SHAPE:.0e}; leave it out, or export the file again."
        )


# ------------------------------------------------------------------------------------------------ references
@dataclass(frozen=True)
class _Graph:
    """Instances, and which names which. numbers : (N,) sorted. place : (N,) of `#` in the text. owner, named : (E,)."""

    numbers: Int64Array
    place: Int64Array
    owner: Int64Array
    named: Int64Array


def _graph(bare: bytes) -> _Graph | None:
    """Of all references between instances that are there; None where there is no instance."""
    text = np.frombuffer(bare + b" " * (_MOST_DIGITS + 2), dtype=np.uint8)
    at = np.flatnonzero(text == ord("#"))
    number, end, reads = np.zeros(at.size, np.int64), at + 1, np.ones(at.size, dtype=bool)
    for _ in range(_MOST_DIGITS):
        digit = text[end].astype(np.int64) - ord("0")
        reads &= (digit >= 0) & (digit <= 9)
        if not reads.any():
            break
        number = np.where(reads, number * 10 + digit, number)
        end = end + reads
    is_number = end > at + 1
    at, number, end = at[is_number], number[is_number], end[is_number]
    is_blank = np.isin(text, np.frombuffer(b" \t\r\n", dtype=np.uint8))
    for _ in range(64):
        blank = is_blank[end]
        if not blank.any():
            break
        end = np.minimum(end + blank, text.size - 1)
    defines = text[end] == ord("=")
    if not defines.any():
        return None
    of_definition = np.cumsum(defines) - 1
    refers = ~defines & (of_definition >= 0)
    owner_number = number[defines][of_definition[refers]]
    numbers, first = np.unique(number[defines], return_index=True)
    owner, named = np.searchsorted(numbers, owner_number), np.searchsorted(numbers, number[refers])
    is_there = numbers[np.minimum(named, numbers.size - 1)] == number[refers]
    return _Graph(numbers, at[defines][first], owner[is_there], named[is_there])


def _reached(graph: _Graph, start: BoolArray) -> BoolArray:
    """(N,) bool: what `start` (N,) names, what that names, and so on, `start` included."""
    order = np.argsort(graph.owner, kind="stable")
    first = np.searchsorted(graph.owner[order], np.arange(start.size + 1))
    reached = start.copy()
    front = np.flatnonzero(start)
    for _ in range(MOST_IN_A_CHAIN + 1):  # enough to come upon a chain that is too long
        if not front.size:
            break
        edges = order[_ranges(first[front], first[front + 1])]
        front = np.unique(graph.named[edges])
        front = front[~reached[front]]
        reached[front] = True
    return reached


def _peeled(graph: _Graph) -> tuple[Int64Array, FloatArray]:
    """(N,) length of the longest chain below each instance, -1 where that is endless; (N,) parts below it, counted.

    Chains are followed for one more than `MOST_IN_A_CHAIN`: what is left then counts as long.
    """
    n = graph.numbers.size
    order = np.argsort(graph.named, kind="stable")
    first = np.searchsorted(graph.named[order], np.arange(n + 1))
    n_open = np.bincount(graph.owner, minlength=n)
    depth, n_parts = np.full(n, -1, dtype=np.int64), np.ones(n)
    front, level = np.flatnonzero(n_open == 0), 0
    while front.size:
        if level > MOST_IN_A_CHAIN:
            depth[depth < 0] = level
            break
        depth[front] = level
        n_edges = first[front + 1] - first[front]
        owners = graph.owner[order[_ranges(first[front], first[front + 1])]]
        np.add.at(n_parts, owners, np.repeat(n_parts[front], n_edges))
        np.subtract.at(n_open, owners, 1)
        front = np.unique(owners)
        front, level = front[n_open[front] == 0], level + 1
    return depth, n_parts


def _in_loop(graph: _Graph, start: int) -> int:
    """An instance on a way that leads back to where it begins, from one whose ways have no end."""
    depth, _ = _peeled(graph)
    onwards = {int(o): int(m) for o, m in zip(graph.owner, graph.named, strict=True) if depth[o] < 0 and depth[m] < 0}
    seen: set[int] = set()
    while start not in seen:
        seen.add(start)
        start = onwards[start]
    return start


def _ranges(first: Int64Array, last: Int64Array) -> Int64Array:
    """Whole numbers of [first, last) of each, one after the other."""
    lengths = last - first
    starts = np.cumsum(lengths) - lengths
    each: Int64Array = np.arange(int(lengths.sum())) + np.repeat(first - starts, lengths)
    return each


def _title(graph: _Graph, bare: bytes, instance: int) -> str:
    place = int(graph.place[instance])
    number = str(graph.numbers[instance])
    head = _HEAD.match(bare, place + 1 + len(number))
    return f"#{number} ({head.group(1).decode()})" if head else f"#{number}"

"""Links of stations on a drawing: how well two scans hold together, and which of them a floor shows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from planner_core.model import FloatArray, Link

WEAK, COUNTS, STRONG = 0, 1, 2
STRONG_TIMES = 4.0
"""A link this many times as strong as required is drawn as strong."""
#: Links of less than this share of the required overlap are not drawn: they would hide the others.
_LEAST_SHARE = 0.5


@dataclass(frozen=True, eq=False)
class StationPoint:
    """A station on a drawing. number : in the disc. at_m : (2,) in plan."""

    floor: str
    number: int
    at_m: FloatArray


def link_class(link: Link, min_overlap: float, min_strength: float) -> int | None:
    """`WEAK`, `COUNTS` or `STRONG`; None: not worth drawing. A strength that is NaN is neither weak nor strong."""
    if link.counts(min_overlap, min_strength):
        return STRONG if link.strength >= STRONG_TIMES * min_strength else COUNTS
    return WEAK if link.overlap >= _LEAST_SHARE * min_overlap else None


def links_on(
    floor: str, spots: Mapping[str, StationPoint], links: Iterable[Link], min_overlap: float, min_strength: float
) -> tuple[tuple[FloatArray, FloatArray, FloatArray], dict[str, tuple[int, ...]]]:
    """Find what the drawing of a floor shows of links.

    Returns ends (K, 2, 2) in plan of the links among its stations, by class; and of each of its stations that links to
    stations of other floors, their numbers.
    """
    ends: tuple[list[FloatArray], ...] = ([], [], [])
    elsewhere: dict[str, list[int]] = {}
    for link in links:
        a, b, kind = link.a, link.b, link_class(link, min_overlap, min_strength)
        if kind is None or a not in spots or b not in spots:
            continue
        if spots[a].floor == floor == spots[b].floor:
            ends[kind].append(np.stack([spots[a].at_m, spots[b].at_m]))
        elif kind > WEAK:
            for here, other in ((a, b), (b, a)):
                if spots[here].floor == floor:
                    elsewhere.setdefault(here, []).append(spots[other].number)
    weak, counting, strong = (np.array(part).reshape(-1, 2, 2) for part in ends)
    return (weak, counting, strong), {name: tuple(sorted(numbers)) for name, numbers in elsewhere.items()}

"""Rooms of a floor plan, and its floor: what walls and their openings enclose; names from the texts inside.

Plan coordinates, metres; outlines are shapely polygons.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

LEAST_ROOM_M2 = 0.8
"""Shafts are smaller."""
SEAL_M, TRACED_SEAL_M = 0.02, 0.06
"""Walls and openings that miss each other by twice this are closed: of exact drawings, and of those that are traced."""
_SPAN_M, _WIDE_SPAN_M, _ENCLOSED_SHARE, _SLAB_EDGE_M = 4.0, 12.0, 0.6, 0.1
"""Walls twice as far apart are of one building; those that enclose less than a share of what they span are open, and
have a floor between walls that are up to twice the wider span apart, with an edge about so straight."""
_NUMBER = re.compile(r"^[A-Za-z]{0,3}[-. ]?\d[\w.\-/]{0,7}$")
_NUMBERED = re.compile(r"^([A-Za-z]{0,3}[-. ]?\d[\w.\-/]{0,7})[ :]+([^\d\s].*)$")
"""A number and a name in one line."""
_DECIMAL = re.compile(r"[.,]\d+\s*$")
_MEASURE = re.compile(
    r"(\d\s*(m²|m2|m\^2|qm|sq\.?\s?(ft|m)|sf\b|м²|м2|кв|㎡|平))|^[\d.,\s'\"xX×/+\-:°%]+$"
    r"|^(a|f|u|h|rh|lh|ch|fl|bf|okff|okrd|s)\s*[=:]?\s*[\d.,]+\s*m?²?$",
    re.IGNORECASE,
)
"""Areas, heights and dimensions, which rooms carry beside their names."""
_DOOR_SIZE = re.compile(r"^\d\d(6[68]|70|80)$")
"""Width and height of doors in feet and inches: 2668 is 2'6\" by 6'8\"."""
_LONGEST_NAME = 60


@dataclass(frozen=True)
class RoomOutline:
    """outline : shapely Polygon. name : mostly a number; long_name : mostly what the room is for."""

    outline: Any
    name: str
    long_name: str


@dataclass(frozen=True)
class PlacedText:
    """A text of the drawing and the middle of its box, metres."""

    text: str
    x: float
    y: float


def sealed(walls: Any, openings: Any, seal_m: float) -> Any:
    """Walls and openings (shapely areas) together, wider by `seal_m` on all sides, so that they close."""
    return shapely.buffer(shapely.union_all([walls, openings]), seal_m, join_style="mitre")


def enclosed_by(solid: Any, seal_m: float) -> Any:
    """What walls and openings enclose, sealed, with courts; shapely area."""
    whole = shapely.buffer(_without_holes(solid), -seal_m, join_style="mitre")
    return shapely.simplify(whole, 1e-3)


def slab_of(enclosed: Any) -> Any:
    """The area of floor and ceiling: what walls enclose; where that is little of what they span, all of that.

    enclosed : as of `enclosed_by`, and returned itself where it is enough. Some drawings show walls alone, and fronts
    of glass as nothing: indoors is between the walls all the same.
    """
    spanned = _closed(enclosed, _SPAN_M)
    if enclosed.area >= _ENCLOSED_SHARE * spanned.area:
        return enclosed
    buildings = [shapely.intersection(enclosed, part) for part in shapely.get_parts(spanned)]
    whole = [_closed(building, _WIDE_SPAN_M) for building in buildings]
    return shapely.simplify(shapely.union_all([enclosed, *whole]), _SLAB_EDGE_M)


def _closed(area: Any, reach_m: float) -> Any:
    """Fill what lies between parts of an area up to twice that far apart, and holes."""
    return _without_holes(shapely.union_all([area, shapely.buffer(shapely.buffer(area, reach_m), -reach_m)]))


def _without_holes(area: Any) -> Any:
    return shapely.union_all([shapely.Polygon(part.exterior) for part in shapely.get_parts(area)])


def rooms_of(walls: Any, openings: Any, texts: Sequence[PlacedText], seal_m: float = SEAL_M) -> list[RoomOutline]:
    """Rooms, from the lowest corner: the holes of walls and openings (shapely areas) together."""
    solid = sealed(walls, openings, seal_m)
    holes = []
    for polygon in shapely.get_parts(solid):
        if polygon.geom_type != "Polygon":
            continue
        for ring in polygon.interiors:
            # What stands free inside, such as a column, is a polygon of its own.
            inside = shapely.difference(shapely.Polygon(ring), solid)
            free = shapely.buffer(inside, seal_m, join_style="mitre")
            holes += [part for part in shapely.get_parts(free) if part.geom_type == "Polygon"]
    rooms = [hole for hole in holes if hole.area >= LEAST_ROOM_M2]
    rooms.sort(key=lambda room: tuple(np.round(shapely.bounds(room), 3).tolist()))
    are_door_sizes = sum(bool(_DOOR_SIZE.match(text.text)) for text in texts) > len(rooms) // 2
    texts = [text for text in texts if not (are_door_sizes and _DOOR_SIZE.match(text.text))]
    where = shapely.points([[text.x, text.y] for text in texts]) if texts else np.empty(0, dtype=object)
    named = []
    for number, room in enumerate(rooms, 1):
        inside = shapely.contains(room, where) if len(where) else np.empty(0, dtype=np.bool_)
        name, long_name = _names([texts[row] for row in np.flatnonzero(inside).tolist()])
        named.append(RoomOutline(shapely.simplify(room, 1e-3), name or f"{number}", long_name))
    return named


def _names(texts: Sequence[PlacedText]) -> tuple[str, str]:
    """Number and name of a room by the texts inside it, read from the top; of many alike, the first."""
    lines = [
        part
        for text in sorted(texts, key=lambda text: (-text.y, text.x))
        for line in text.text.splitlines()
        for part in (_NUMBERED.match(line) or re.match("(.*)", line)).groups()  # type: ignore[union-attr]
    ]
    numbers = [line for line in lines if _NUMBER.match(line) and not _DECIMAL.search(line)]
    words = [
        line
        for line in lines
        if line not in numbers and not _MEASURE.search(line) and sum(sign.isalpha() for sign in line) > 1
    ]
    return (numbers[0] if numbers else ""), " ".join(words[:2])[:_LONGEST_NAME]

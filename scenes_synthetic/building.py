"""The fabric of a building: walls with openings, slabs, doors, windows, stairs, railings, as named parts.

Metres. A wall or slab is a box given by two corners; what is cut out of it is a `Hole` through its thickness.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scenes_synthetic.model import Hole, Part, PiercedBox
from scenes_synthetic.solids import Point, Solid, box, join, pierced_box, place, prism, rectilinear

_LINING_M = 0.05
_LEAF_THICKNESS_M = 0.04
_LEAF_GAP_M = 0.01
_FRAME_WIDTH_M = 0.07
_FRAME_DEPTH_M = 0.08
_PANE_M = 0.02
_WIDEST_PANE_M = 1.2


@dataclass(frozen=True)
class Opening:
    """A door or window opening in a wall: where it starts along the wall (absolute x or y), and its size."""

    name: str
    start_m: float
    width_m: float
    height_m: float
    sill_m: float = 0.0
    """Above the wall's foot; 0 is a door."""


def wall(name: str, storey: int, low_m: Point, high_m: Point, openings: Sequence[Opening] = ()) -> Part:
    """Build a wall along its longer horizontal side."""
    along = _along(low_m, high_m)
    holes = []
    for opening in openings:
        low, high = list(low_m), list(high_m)
        low[along], high[along] = opening.start_m, round(opening.start_m + opening.width_m, 6)
        low[2] = round(low_m[2] + opening.sill_m, 6)
        high[2] = round(low[2] + opening.height_m, 6)
        holes.append(Hole(opening.name, (low[0], low[1], low[2]), (high[0], high[1], high[2])))
    recipe = PiercedBox(low_m, high_m, tuple(holes))
    return Part(name, "IfcWall", storey, recipe.solid(), recipe)


def slab(name: str, storey: int, low_m: Point, high_m: Point, holes: Sequence[Hole] = (), *, lowest: bool) -> Part:
    """Build a floor slab; `lowest` marks the one on the ground."""
    recipe = PiercedBox(low_m, high_m, tuple(holes))
    kind = "BASESLAB" if lowest else "FLOOR"
    return Part(name, "IfcSlab", storey, recipe.solid(), recipe, predefined_type=kind)


def flat_roof(name: str, storey: int, low_m: Point, high_m: Point) -> Part:
    """Build a roof slab."""
    recipe = PiercedBox(low_m, high_m)
    return Part(name, "IfcRoof", storey, recipe.solid(), recipe, predefined_type="FLAT_ROOF")


def parapet(name: str, storey: int, low_m: Point, high_m: Point, thickness_m: float) -> Part:
    """Build a low wall that runs round a roof."""
    hole = (
        (low_m[0] + thickness_m, low_m[1] + thickness_m, low_m[2]),
        (high_m[0] - thickness_m, high_m[1] - thickness_m, high_m[2]),
    )
    return Part(name, "IfcWall", storey, pierced_box(low_m, high_m, [hole]), predefined_type="PARAPET")


def door(name: str, storey: int, hole: Hole, *, towards: str, hinge: str, open_deg: float) -> Part:
    """Build a door in its opening: a lining as deep as the wall, and a leaf.

    towards : side to which it swings: `+x`, `-x`, `+y`, `-y`. hinge : `left` or `right`, seen from that side.
    open_deg : 0 shut to 90 wide open.
    """
    width, depth, height = _size(hole)
    inner = width - 2 * _LINING_M
    opening = ((_LINING_M, -depth, 0.0), (width - _LINING_M, 0.0, height - _LINING_M))
    lining = pierced_box((0.0, -depth, 0.0), (width, 0.0, height), [opening])
    reach = inner - 2 * _LEAF_GAP_M
    foot, head = _LEAF_GAP_M, height - _LINING_M - _LEAF_GAP_M
    if hinge == "right":
        leaf = box((0.0, -_LEAF_THICKNESS_M, foot), (reach, 0.0, head))
        pivot, turn = _LINING_M + _LEAF_GAP_M, open_deg
    else:
        leaf = box((-reach, -_LEAF_THICKNESS_M, foot), (0.0, 0.0, head))
        pivot, turn = width - _LINING_M - _LEAF_GAP_M, -open_deg
    solid = join([lining, place(leaf, (pivot, 0.0, 0.0), turn_deg=turn)])
    return Part(name, "IfcDoor", storey, _face(solid, hole, towards), fills=hole.name, predefined_type="DOOR")


def window(name: str, storey: int, hole: Hole) -> Part:
    """Build a fixed window in the middle of the wall: a frame, a mullion where it is wide, opaque panes."""
    width, depth, height = _size(hole)
    n_panes = 2 if width > _WIDEST_PANE_M else 1
    frame = _FRAME_WIDTH_M
    pane_width = (width - frame * (n_panes + 1)) / n_panes
    x = np.cumsum([0.0, *([frame, pane_width] * n_panes), frame])
    y = np.array([-_FRAME_DEPTH_M, -_PANE_M, _PANE_M, _FRAME_DEPTH_M]) / 2 - depth / 2
    z = [0.0, frame, height - frame, height]
    filled = np.ones((x.size - 1, 3, 3), dtype=bool)
    filled[1::2, ::2, 1] = False
    solid = rectilinear(x, y, z, filled=filled)
    towards = "+y" if _along(hole.low_m, hole.high_m) == 0 else "-x"
    return Part(name, "IfcWindow", storey, _face(solid, hole, towards), fills=hole.name, predefined_type="WINDOW")


def _along(low_m: Point, high_m: Point) -> int:
    return 0 if high_m[0] - low_m[0] >= high_m[1] - low_m[1] else 1


def _size(hole: Hole) -> tuple[float, float, float]:
    """Width along the wall, depth through it, height. The walls here are thinner than any opening is wide."""
    size = [high - low for low, high in zip(hole.low_m, hole.high_m, strict=True)]
    return max(size[:2]), min(size[:2]), size[2]


def _face(solid: Solid, hole: Hole, towards: str) -> Solid:
    """Place a solid made for x from 0 along the wall and y from -depth to 0, its +y turned to the side `towards`."""
    low, high = hole.low_m, hole.high_m
    origin, turn = {
        "+y": ((low[0], high[1], low[2]), 0.0),
        "-x": ((low[0], low[1], low[2]), 90.0),
        "-y": ((high[0], low[1], low[2]), 180.0),
        "+x": ((high[0], high[1], low[2]), 270.0),
    }[towards]
    return place(solid, origin, turn_deg=turn)


def stairs(
    name: str, storey: int, *, foot_m: Point, width_m: float, rise_m: float, n_risers: int, going_m: float
) -> Part:
    """Build a straight flight that climbs along +y from its left front corner `foot_m` to the slab `rise_m` above.

    The slab's edge is the last step, so there are `n_risers - 1` treads, each `going_m` deep.
    """
    x, y, z = foot_m
    riser = rise_m / n_risers
    n_treads = n_risers - 1
    below_m = 0.2  # of the soffit, measured down from the inner corners of the steps
    end = y + n_treads * going_m
    outline = [(y, z), (y + below_m * going_m / riser, z), (end, z + n_treads * riser - below_m)]
    for tread in range(n_treads, 0, -1):
        outline += [(y + tread * going_m, z + tread * riser), (y + (tread - 1) * going_m, z + tread * riser)]
    solid = prism(outline, axis="x", low_m=x, high_m=x + width_m)
    return Part(name, "IfcStair", storey, solid, predefined_type="STRAIGHT_RUN_STAIR")


def railing(name: str, storey: int, start_m: Point, end_m: Point, *, height_m: float = 1.0) -> Part:
    """Build a hand rail on balusters between two points at floor height, along x or y."""
    start, end = np.asarray(start_m), np.asarray(end_m)
    run = end - start
    n_balusters = max(2, round(float(np.abs(run).sum()) / 0.25) + 1)
    half, rail = 0.012, 0.025
    posts = []
    for share in np.linspace(0.02, 0.98, n_balusters):
        px, py, pz = start + share * run
        posts.append(box((px - half, py - half, pz), (px + half, py + half, pz + height_m - 2 * rail)))
    low, high = np.minimum(start, end) - rail, np.maximum(start, end) + rail
    foot = float(start[2]) + height_m
    top = box((float(low[0]), float(low[1]), foot - 2 * rail), (float(high[0]), float(high[1]), foot))
    return Part(name, "IfcRailing", storey, join([top, *posts]), predefined_type="BALUSTRADE")

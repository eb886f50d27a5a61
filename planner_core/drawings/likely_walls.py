"""Walls and windows of drawings whose layers are not named: by their shape alone.

Of the thin faces between lines these are none of walls: those that together are wide, as tiles, treads and hatches are;
small groups, as letters and fittings; and leaves of doors. Two or more faces side by side, of one length, are a window.

    ====+-----------+====
    wall|===========|        panes: lines along the wall between its faces
    ====+-----------+====

Plan coordinates, metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from planner_core.drawings.walls import GRID_M, THICKEST_M, mean_width_m, polygons_of, segments_of, thin_faces
from planner_core.model import FloatArray

_THICKEST_M, _THINNEST_M = 0.5, 0.06
_WIDE_M, _PATTERN_SHARE = 0.62, 0.5
"""Areas in which circles of this diameter fit are patterns where thin faces make them up."""
_SHORTEST_M = 0.5
"""Groups of faces are longer."""
_WINDOW_M = (0.35, 6.0)
_SAME_M = 0.03
_POST_M = 0.05
_GLAZING_M = 0.16
"""Frames are less deep."""
_APART_M, _GROUP_SHARE = 8.0, 0.1
"""Legends and scale bars lie this far from the plan, and are smaller beside it."""
_FILLED_TIMES = 3.0
"""Filled walls count so many times more: who fills anything long and thin in a plan, fills walls."""
_LEAST_SHARE = 0.25
"""Walls reach over this share of a drawing's longer side."""


@dataclass(frozen=True)
class LikelyWalls:
    """area : shapely MultiPolygon of walls. windows : shapely polygons of windows in them, of no wall.

    filled_m2 : of the walls, what is filled.
    """

    area: Any
    windows: tuple[Any, ...]
    filled_m2: float = 0.0

    @property
    def reach_m(self) -> float:
        """Longer side of what walls enclose."""
        if self.area.is_empty:
            return 0.0
        low_x, low_y, high_x, high_y = shapely.bounds(self.area).tolist()
        return float(max(high_x - low_x, high_y - low_y))


def likely_walls(lines: Sequence[FloatArray], filled: Any) -> LikelyWalls:
    """Walls among lines (K, 2) and filled areas (shapely) of any content."""
    faces = [face for face in thin_faces(lines, thickest_m=_THICKEST_M) if mean_width_m(face) >= 0.5 * _THINNEST_M]
    panes = _windows(faces)
    of_window = shapely.union_all(panes)
    solid = [part for part in shapely.get_parts(filled) if _THINNEST_M <= mean_width_m(part) <= THICKEST_M]
    rest = [face for face in faces if shapely.intersection(face, of_window).area < 0.5 * face.area]
    kept = _without_patterns([face for face in rest if mean_width_m(face) >= _THINNEST_M])
    area = _long_groups(shapely.union_all([*kept, *solid], grid_size=GRID_M))
    glazing = [face for face in kept if _is_between_caps(face, area)]
    area = _long_groups(shapely.difference(area, shapely.buffer(shapely.union_all(glazing), GRID_M)))
    filled_m2 = float(shapely.intersection(area, shapely.union_all(solid)).area)
    return LikelyWalls(area, tuple(_in_rows([*panes, *glazing], area)), filled_m2)


def likely_layer(of_layers: Sequence[LikelyWalls], extent_m: float) -> int | None:
    """The layer with most walls, filled ones first; None: none has walls that reach over a part of the drawing."""
    areas = [
        walls.area.area + _FILLED_TIMES * walls.filled_m2 if walls.reach_m >= _LEAST_SHARE * extent_m else 0.0
        for walls in of_layers
    ]
    best = int(np.argmax(areas)) if areas else 0
    return best if areas and areas[best] > 0.0 else None


def lines_side_by_side(lines: Sequence[FloatArray]) -> list[Any]:
    """Groups of two or more straight lines side by side from end to end, as panes are drawn; shapely multilines."""
    segments = segments_of(lines)
    along = segments[:, 1] - segments[:, 0]
    length = np.hypot(along[:, 0], along[:, 1])
    fits = (length >= _WINDOW_M[0]) & (length <= _WINDOW_M[1])
    segments, along, length = segments[fits], along[fits] / length[fits, None], length[fits]
    if len(segments) < 2:
        return []
    strings = shapely.linestrings(segments)
    a, b = shapely.STRtree(strings).query(strings, predicate="dwithin", distance=_THICKEST_M)
    a, b = a[a < b], b[a < b]
    turned = (along[a] * along[b]).sum(axis=1) < 0.0
    other = np.where(turned[:, None, None], segments[b][:, ::-1], segments[b])
    apart = other - segments[a]
    shift = (apart * along[a][:, None]).sum(axis=2)
    aside = apart[..., 1] * along[a][:, :1] - apart[..., 0] * along[a][:, 1:]
    beside = (np.abs(shift) <= _POST_M).all(axis=1) & (np.abs(aside) > GRID_M).all(axis=1)
    beside &= np.abs(aside[:, 0] - aside[:, 1]) <= _SAME_M
    n_groups, group = connected_components(
        coo_array((np.ones(int(beside.sum())), (a[beside], b[beside])), shape=(len(segments),) * 2), directed=False
    )
    order = np.argsort(group, kind="stable")
    groups = np.split(order, np.cumsum(np.bincount(group, minlength=n_groups))[:-1])
    return [shapely.multilinestrings(strings[members]) for members in groups if members.size > 1]


def _without_patterns(faces: list[Any]) -> list[Any]:
    whole = shapely.union_all(faces, grid_size=GRID_M)
    wide = shapely.buffer(shapely.buffer(whole, -0.5 * _WIDE_M), 0.5 * _WIDE_M)
    if wide.is_empty:
        return faces
    return [face for face in faces if shapely.intersection(face, wide).area < _PATTERN_SHARE * face.area]


def _long_groups(area: Any) -> Any:
    parts = [
        part
        for part in shapely.get_parts(polygons_of(area))
        if max(shapely.bounds(part)[2:] - shapely.bounds(part)[:2]) >= _SHORTEST_M
    ]
    near = shapely.get_parts(shapely.union_all(shapely.buffer(parts, 0.5 * _APART_M)))
    areas = np.array([sum(part.area for part in parts if shapely.intersects(part, group)) for group in near])
    groups = shapely.union_all(near[areas >= _GROUP_SHARE * areas.max(initial=0.0)])
    return shapely.MultiPolygon([part for part in parts if shapely.intersects(part, groups)])


def _windows(faces: Sequence[Any]) -> list[Any]:
    """Groups of two or more slender rectangles side by side, of one length and together as thick as a wall."""
    boxes = [shapely.oriented_envelope(face) for face in faces]
    slender = []
    for row, box in enumerate(boxes):
        if box.geom_type != "Polygon" or faces[row].area < 0.9 * box.area:
            continue
        corners = shapely.get_coordinates(box)[:4]
        sides = np.hypot(*(np.roll(corners, -1, axis=0) - corners)[:2].T)
        if sides.min() <= 0.3 and _WINDOW_M[0] <= sides.max() <= _WINDOW_M[1]:
            slender.append((row, float(sides.max())))
    if len(slender) < 2:
        return []
    rows = [row for row, _ in slender]
    tree = shapely.STRtree([faces[row] for row in rows])
    a, b = tree.query([faces[row] for row in rows], predicate="dwithin", distance=GRID_M)
    length = np.array([length for _, length in slender])
    a, b = a[a < b], b[a < b]
    beside = np.array(
        [
            abs(length[i] - length[j]) <= _SAME_M
            and _shared_m(boxes[rows[i]], boxes[rows[j]]) >= 0.9 * length[i]
            and shapely.intersection(boxes[rows[i]], boxes[rows[j]]).area < 0.1 * boxes[rows[i]].area
            for i, j in zip(a.tolist(), b.tolist(), strict=True)
        ],
        dtype=np.bool_,
    )
    n_groups, group = connected_components(
        coo_array((np.ones(int(beside.sum())), (a[beside], b[beside])), shape=(len(rows),) * 2), directed=False
    )
    found = []
    for number in range(n_groups):
        members = np.flatnonzero(group == number)
        box = shapely.oriented_envelope(shapely.union_all([faces[rows[k]] for k in members.tolist()]))
        if 2 <= members.size <= 6 and mean_width_m(box) <= _THICKEST_M:
            found.append(box)
    return found


def _in_rows(windows: Sequence[Any], walls: Any) -> list[Any]:
    """Windows of walls, those in a row with posts between them as one."""
    groups = shapely.get_parts(
        shapely.union_all([shapely.buffer(each, _POST_M, join_style="mitre") for each in windows])
    )
    rows = []
    for group in groups:
        inside = [each for each in windows if shapely.intersects(each, group)]
        box = shapely.oriented_envelope(shapely.union_all(inside))
        is_row = mean_width_m(box) <= 1.5 * max(mean_width_m(each) for each in inside)
        rows += [box] if is_row else inside
    return [each for each in rows if shapely.distance(each, walls) <= 2 * _POST_M]


def _is_between_caps(face: Any, walls: Any) -> bool:
    """Whether a slender face lies between ends of thicker walls, as glazing does: in their middle, not along them.

    wall ==+      +== wall
           |------|             face
         ==+      +==
    """
    box = shapely.oriented_envelope(face)
    if box.geom_type != "Polygon" or face.area < 0.9 * box.area:
        return False
    corners = shapely.get_coordinates(box)[:4]
    sides = np.hypot(*(np.roll(corners, -1, axis=0) - corners)[:2].T)
    if sides[0] < sides[1]:
        corners, sides = np.roll(corners, -1, axis=0), sides[::-1]
    length, width = sides.tolist()
    if width > _GLAZING_M or not _WINDOW_M[0] <= length <= _WINDOW_M[1]:
        return False
    along, across = (corners[1] - corners[0]) / length, (corners[3] - corners[0]) / width
    middle = corners.mean(axis=0)
    for sign in (-1.0, 1.0):
        end = middle + sign * (0.5 * length + 2 * _SAME_M) * along
        sideways = np.array([[-1.0], [1.0]]) * across
        beside = shapely.points(end + (0.5 * width + _SAME_M) * sideways)
        beyond = shapely.points(end + THICKEST_M * sideways)
        if not shapely.intersects(walls, beside).all() or shapely.intersects(walls, beyond).all():
            return False
    return True


def _shared_m(a: Any, b: Any) -> float:
    """Length of the side that two rectangles have in common."""
    return float(shapely.intersection(shapely.buffer(a, _SAME_M), b).area / _SAME_M)

"""What a draft leaves uncovered that candidates could see, largest first, with the pieces it lies in.

Input a `Survey` and patches (local frame, metres); output `LeftSurface`s. Why the rest is not seen from anywhere does
not depend on the stations: the plan's own reasons stay true for it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.coverage.patch_reasons import Surfaces, surfaces_of
from planner_core.coverage.pieces import connected_pieces
from planner_core.model import BoolArray, Int32Array, Int64Array, Survey, UnseenPiece

#: Surfaces of less are not listed, as in plan.json.
MIN_LISTED_M2 = 0.01
#: Elements that are examined, the largest areas first; and pieces listed of a surface.
N_ELEMENTS, N_PIECES = 50, 5
#: No further element is examined once there are so many patches, of some 25 microseconds each.
_ENOUGH_PATCHES = 20_000


@dataclass(frozen=True)
class LeftSurface:
    """Surface of one element, in one room, that counts for one floor. Fields as in `UnseenSurface`."""

    element: int
    room: int
    floor: str
    area_m2: float
    n_pieces: int
    pieces: tuple[UnseenPiece, ...]


def left_surfaces(survey: Survey, left: BoolArray) -> tuple[LeftSurface, ...]:
    """List surfaces of patches that are `left`, (P,) bool: of the `N_ELEMENTS` elements of which most is left."""
    part = surfaces_of(survey, _of_largest(survey, np.flatnonzero(left).astype(np.int32)))
    key = np.column_stack([part.element, part.room, part.floor])
    groups, which = np.unique(key, axis=0, return_inverse=True)
    group = which.ravel().astype(np.int64)
    area_m2 = np.bincount(group, weights=part.area_m2, minlength=len(groups))
    piece = connected_pieces(survey.scene, survey.patches, part.patch, group)
    order = np.argsort(group, kind="stable")
    ends = np.cumsum(np.bincount(group, minlength=len(groups)))
    return tuple(
        _surface(survey, part, groups[number], piece, order[ends[number - 1] if number else 0 : ends[number]])
        for number in np.argsort(-area_m2, kind="stable").tolist()
        if area_m2[number] >= MIN_LISTED_M2
    )


def _of_largest(survey: Survey, patch: Int32Array) -> Int32Array:
    """Patches (K,) of the elements and floors of which most area is among patches (N,); `_ENOUGH_PATCHES` or few more.

    With few stations nearly all of a building is left, and nobody reads a list of all of it.
    """
    triangle = np.searchsorted(survey.patches.first_patch, patch, side="right") - 1
    n_floors = len(survey.floors) + 1  # floor -1 is number 0
    key = (
        survey.scene.element_of_triangle[triangle].astype(np.int64) * n_floors + survey.floor_of_triangle[triangle] + 1
    )
    n_keys = len(survey.scene.elements) * n_floors
    area_m2 = np.bincount(key, weights=survey.patches.area_m2[patch], minlength=n_keys)
    largest = np.argsort(-area_m2, kind="stable")[:N_ELEMENTS]
    before = np.cumsum(np.bincount(key, minlength=n_keys)[largest])
    n_examined = 1 + int(np.searchsorted(before, _ENOUGH_PATCHES))
    kept = np.zeros(n_keys, dtype=np.bool_)
    kept[largest[:n_examined]] = True
    of_largest: Int32Array = patch[kept[key]]
    return of_largest


def _surface(survey: Survey, part: Surfaces, group: Int64Array, piece: Int64Array, rows: Int64Array) -> LeftSurface:
    names, of_row = np.unique(piece[rows], return_inverse=True)
    size_m2 = np.bincount(of_row.ravel(), weights=part.area_m2[rows], minlength=names.size)
    largest = np.argsort(-size_m2, kind="stable")[:N_PIECES]
    element, room, floor = group.tolist()
    return LeftSurface(
        element=element,
        room=room,
        floor=survey.floors[floor].id if floor >= 0 else "",
        area_m2=float(part.area_m2[rows].sum()),
        n_pieces=int(names.size),
        pieces=tuple(_piece(part.take(rows[of_row.ravel() == number])) for number in largest.tolist()),
    )


def _piece(part: Surfaces) -> UnseenPiece:
    corners_m = part.corners_m.reshape(-1, 3)
    centroid_m = (part.area_m2[:, None] * part.centroid_m).sum(axis=0) / part.area_m2.sum()
    nearest = int(((part.centroid_m - centroid_m) ** 2).sum(axis=1).argmin())
    return UnseenPiece(
        area_m2=float(part.area_m2.sum()),
        n_patches=int(part.patch.size),
        centroid_m=centroid_m,
        box_m=np.stack([corners_m.min(axis=0), corners_m.max(axis=0)]),
        patch=int(part.patch[nearest]),
    )

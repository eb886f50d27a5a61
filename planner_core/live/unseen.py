"""What a draft leaves uncovered that candidates could see, largest first, with the pieces it lies in.

Input a `Survey` and patches (local frame, metres); output `LeftSurface`s. Why the rest is not seen from anywhere does
not depend on the stations: the plan's own reasons stay true for it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.model import BoolArray, Int64Array, Survey, UnseenPiece
from planner_core.reasons.pieces import connected_pieces
from planner_core.reasons.surfaces import Surfaces, surfaces_of

#: Surfaces of less are not listed, as in plan.json; more than these are not either, nor pieces of one surface.
MIN_LISTED_M2 = 0.01
N_SURFACES, N_PIECES = 50, 5


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
    """List the surfaces of patches that are `left`, (P,) bool: the largest `N_SURFACES`."""
    patches = np.flatnonzero(left).astype(np.int32)
    surfaces = surfaces_of(survey, patches)
    key = np.column_stack([surfaces.element, surfaces.room, surfaces.floor])
    groups, group, _ = np.unique(key, axis=0, return_inverse=True, return_counts=True)
    group = group.ravel().astype(np.int64)
    area_m2 = np.bincount(group, weights=surfaces.area_m2, minlength=len(groups))
    largest = np.argsort(-area_m2, kind="stable")[:N_SURFACES]
    largest = largest[area_m2[largest] >= MIN_LISTED_M2]
    # Pieces are only looked for in what is listed: with few stations nearly all of a building is left.
    listed = np.flatnonzero(np.isin(group, largest))
    part, group = surfaces.take(listed), group[listed]
    piece = connected_pieces(survey.scene, survey.patches, part.patch, group)
    return tuple(
        _surface(survey, part, groups[number], float(area_m2[number]), piece, np.flatnonzero(group == number))
        for number in largest.tolist()
    )


def _surface(
    survey: Survey, part: Surfaces, group: Int64Array, area_m2: float, piece: Int64Array, rows: Int64Array
) -> LeftSurface:
    names, of_row = np.unique(piece[rows], return_inverse=True)
    size_m2 = np.bincount(of_row.ravel(), weights=part.area_m2[rows], minlength=names.size)
    largest = np.argsort(-size_m2, kind="stable")[:N_PIECES]
    element, room, floor = group.tolist()
    return LeftSurface(
        element=element,
        room=room,
        floor=survey.floors[floor].id if floor >= 0 else "",
        area_m2=area_m2,
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

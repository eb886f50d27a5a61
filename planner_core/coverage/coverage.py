"""Coverage: which patches a set of positions sees together, and how much area that is.

Input `Visibility` rows and patch areas (m^2). F1 of the paper counts patches; we weight them by area as well, since
patches differ in size by up to a factor of two and more on small triangles.

References
----------
López et al. 2023, Eq. 1 (F1: number of distinct patches reached by any position of the set).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from planner_core.errors import RequirementError
from planner_core.model import (
    BoolArray,
    Coverage,
    FloatArray,
    Floor,
    Int32Array,
    Int64Array,
    Patches,
    Survey,
    UnseenElement,
    Visibility,
)
from planner_core.model.stored_rows import PatchColumn, StoredVisibility, visibility_budget

#: Unseen parts of elements smaller than this are slivers, not something to go back for.
MIN_UNSEEN_M2 = 0.01
_ENTRIES_A_PIECE = 4_000_000
_Value = TypeVar("_Value", bound=np.generic)


def stacked_rows(first: Visibility, second: Visibility) -> Visibility:
    """Rows of both, those of the second behind those of the first."""
    column = PatchColumn(visibility_budget())
    for rows in (first, second):
        for _, patch in rows.pieces():
            column.add(patch)
    return column.rows(np.concatenate([first.starts, first.starts[-1] + second.starts[1:]]), first.n_patches)


def taken_along(
    starts: Int64Array, values: NDArray[_Value], rows: Sequence[int] | Int64Array
) -> tuple[Int64Array, NDArray[_Value]]:
    """Starts, and values (M,) along compressed rows, of rows in the order given."""
    chosen = np.asarray(rows, dtype=np.int64)
    size = np.diff(starts)[chosen]
    begins = np.concatenate([[0], np.cumsum(size)]).astype(np.int64)
    out = np.empty(begins[-1], dtype=values.dtype)
    # Piece by piece: places of all entries would take four times the memory of the rows.
    piece = np.unique(np.searchsorted(begins, np.arange(0, begins[-1] + _ENTRIES_A_PIECE, _ENTRIES_A_PIECE)))
    for first, end in pairwise(np.minimum(piece, size.size).tolist()):
        shift = np.repeat(starts[chosen[first:end]] - begins[first:end], size[first:end])
        out[begins[first] : begins[end]] = values[shift + np.arange(begins[first], begins[end])]
    return begins, out


def take_rows(visibility: Visibility, rows: Sequence[int] | Int64Array) -> Visibility:
    """Rows of `visibility` in the order given."""
    if isinstance(visibility, StoredVisibility):
        chosen = np.asarray(rows, dtype=np.int64)
        column = PatchColumn(visibility_budget())
        for position in chosen.tolist():
            column.add(visibility.row(position))
        begins = np.concatenate([[0], np.cumsum(np.diff(visibility.starts)[chosen])]).astype(np.int64)
        return column.rows(begins, visibility.n_patches)
    starts, patch = taken_along(visibility.starts, visibility.patch, rows)
    return Visibility(starts=starts, patch=patch, n_patches=visibility.n_patches)


def kept_rows(visibility: Visibility, kept: BoolArray) -> Visibility:
    """Rows of the entries (M,) bool alone."""
    starts = np.concatenate([[0], np.cumsum(kept)])[visibility.starts].astype(np.int64)
    return Visibility(starts=starts, patch=visibility.patch[kept], n_patches=visibility.n_patches)


def times_seen(visibility: Visibility) -> Int32Array:
    """(P,) int32: number of positions that see each patch."""
    return visibility.n_seers().astype(np.int32)


def floor_of_patch(patches: Patches, floor_of_triangle: Int32Array) -> Int32Array:
    """(P,) int32: the floor that each patch counts for; -1 none."""
    return np.repeat(floor_of_triangle, np.diff(patches.first_patch)).astype(np.int32)


def coverage_of(area_m2: FloatArray, achievable: BoolArray, seen: BoolArray, part: BoolArray) -> Coverage:
    """Coverage of the patches of `part`, all arrays (P,). What is not achievable does not count as covered."""
    return Coverage(
        achievable_area_m2=float(area_m2[achievable & part].sum()),
        total_area_m2=float(area_m2[part].sum()),
        covered_area_m2=float(area_m2[achievable & seen & part].sum()),
    )


def coverage_by_floor(
    area_m2: FloatArray, achievable: BoolArray, seen: BoolArray, floor: Int32Array, n_floors: int
) -> tuple[Coverage, ...]:
    """Coverage of each floor's patches; floor : (P,) int32."""
    return tuple(coverage_of(area_m2, achievable, seen, floor == index) for index in range(n_floors))


def covered_and_own_area_m2(
    visibility: Visibility, area_m2: FloatArray, *, scope: BoolArray, seen_from: int = 1
) -> tuple[FloatArray, FloatArray]:
    """(N,) area that each position sees, whatever it belongs to, and (N,) area of scope that needs it.

    scope : (P,) bool, the patches that coverage counts: in scope and scannable. seen_from : positions that must see a
    patch for it to be covered: where just so many do, each is needed.
    """
    needed = scope & (times_seen(visibility) == seen_from)
    row = np.repeat(np.arange(visibility.n_positions), np.diff(visibility.starts))
    weight = area_m2[visibility.patch]
    alone = weight * needed[visibility.patch]
    n = visibility.n_positions
    covered, own = (np.bincount(row, weights=area, minlength=n).astype(np.float64) for area in (weight, alone))
    return covered, own


def unseen_elements(
    survey: Survey, achievable: BoolArray, seen: BoolArray, area_m2: FloatArray
) -> tuple[UnseenElement, ...]:
    """Elements with achievable area left unseen, by floor, largest first; slivers are left out."""
    scene, floors = survey.scene, survey.floors
    triangle = survey.patches.triangle_of_patch
    # One number an element and floor; floor -1 is number 0.
    n_floors = len(floors) + 1
    key = scene.element_of_triangle[triangle].astype(np.int64) * n_floors + survey.floor_of_triangle[triangle] + 1
    n_keys = len(scene.elements) * n_floors
    possible = np.bincount(key, weights=area_m2 * achievable, minlength=n_keys)
    missed = np.bincount(key, weights=area_m2 * (achievable & ~seen), minlength=n_keys)
    listed = np.flatnonzero(missed >= MIN_UNSEEN_M2)
    listed = listed[np.argsort(-missed[listed], kind="stable")]
    return tuple(
        UnseenElement(
            element=int(number // n_floors),
            floor=_floor_id(floors, int(number % n_floors) - 1),
            unseen_area_m2=float(missed[number]),
            achievable_area_m2=float(possible[number]),
        )
        for number in listed
    )


def _floor_id(floors: tuple[Floor, ...], index: int) -> str:
    return floors[index].id if index >= 0 else ""


def planned_floors(floors: tuple[Floor, ...], wanted: tuple[str, ...]) -> tuple[int, ...]:
    """Indices of the floors that `wanted` names by id or name (upper and lower case alike); all where it is empty.

    Raises
    ------
    RequirementError
        A floor that is not there, or no floor at all.
    """
    if not floors:
        raise RequirementError(
            "floors: none found, expected a level surface of at least 1 m2 with 1.5 m of clear space above it; "
            "check the model's units and up axis, see `tlsplan floors`"
        )
    if not wanted:
        return tuple(range(len(floors)))
    found = set()
    for name in wanted:
        at = [i for i, floor in enumerate(floors) if name.casefold() in (floor.id.casefold(), floor.name.casefold())]
        if not at:
            there = ", ".join(f"{floor.id} ({floor.name})" for floor in floors)
            raise RequirementError(f"floor: got {name!r}, expected one of {there}; `tlsplan floors` lists them")
        found.update(at)
    return tuple(sorted(found))


def scope_of(floor_of_patch: Int32Array, floors: tuple[int, ...], n_floors: int) -> BoolArray:
    """(P,) bool: patches that the overall figures are about: all, or those of the planned floors where some are not."""
    if len(floors) == n_floors:
        return np.ones(floor_of_patch.size, dtype=bool)
    return np.isin(floor_of_patch, np.array(floors, dtype=np.int32))

"""How large a scene is: its longest side, and whether anything that is built can be as large or as small.

Input a `Scene` (metres); output metres. A wrong unit makes a house kilometres long, and planning it hours or patches
without number: it is refused before that.

Models carry strays: a symbol left at the origin of a national grid, a tree copied to the wrong place. A box around
everything would then be kilometres long and its centre would lie in empty land. So faces are weighed, and the bulk is
where nearly all of the surface lies, whatever single faces lie elsewhere.
"""

from __future__ import annotations

import math

import numpy as np

from planner_core.errors import SceneError
from planner_core.model import BoolArray, FloatArray, Scene
from planner_core.model.arrays import area_normals, bounds_of, lengths
from planner_core.scene.array_rows import chunks

LONGEST_M, SHORTEST_M = 1000.0, 0.5
"""Extents outside these are hardly a building to scan: the unit is probably another."""
MAX_LENGTH_M = 20_000.0
"""Nothing that is scanned from tripods in one survey is longer; tunnels of some kilometres are."""
MAX_WIDTH_M = 1000.0
"""Nothing built is this large in all three directions: tunnels are thin, airports flat. A house read in metres that is
drawn in millimetres is, from its first storey on."""
MAX_PLAN_M2 = 50e6
"""Levels of more than that are no site of one survey: an airport of 4 km by 3 km, with slabs of two sides, has half."""
UNITS_M = {"m": 1.0, "mm": 0.001, "cm": 0.01, "in": 0.0254, "ft": 0.3048, "km": 1000.0}
"""What `--units` takes, in metres; what is drawn most often comes first."""
_HOUSE_M, _SHORTEST_ROOM_M = 10.0, 1.5
"""Length of a house, and of the smallest room."""
STRAY_DISTANCE_M = 20_000.0
"""Faces further than this from the bulk are strays: no site that is scanned from tripods is as large. It is far below
the 100 km that the scan engine takes, and far above any part of a site that somebody could miss."""
BULK_SHARE = 0.95
"""Share of the weight that is the bulk. What lies far from it has less than a twentieth of the surface."""
NEAR_M = 50.0
"""What lies this near to the bulk is always near: a building's neighbours, its antennas, its cellars."""
_LARGEST_WEIGHT_M2 = 100.0
"""A face weighs as its area, up to this: no single terrain face or stray sliver outweighs a building."""


def extent_m(scene: Scene) -> FloatArray:
    """(3,) float64; of the bulk where the whole is too long, since a stray face makes a house kilometres long."""
    whole_m: FloatArray = np.ptp(scene.vertices_m, axis=0)
    if whole_m.max() <= LONGEST_M:
        return whole_m
    corners_m = scene.vertices_m[scene.triangles]
    near = corners_m[~is_outside(corners_m, fence_m(corners_m))].reshape(-1, 3)
    return np.asarray(np.ptp(near, axis=0), dtype=np.float64)


def likely_unit(longest_m: float, metres_per_unit: float) -> str | None:
    """Return the unit that a scene of such a length is probably drawn in, as `--units` takes it; None: no unit.

    metres_per_unit : what it was read in. Of the units that make it a building, the one that makes it nearest to a
    house.
    """
    lengths = {unit: longest_m / metres_per_unit * size_m for unit, size_m in UNITS_M.items()}
    possible = [unit for unit, length_m in lengths.items() if _SHORTEST_ROOM_M <= length_m <= LONGEST_M]
    return min(possible, key=lambda unit: abs(math.log(lengths[unit] / _HOUSE_M)), default=None)


def check_extent(scene: Scene) -> None:
    """Refuse a scene that can't be planned at the size it has.

    Raises
    ------
    SceneError
        Its size, and the unit to pass instead.
    """
    size_m = extent_m(scene)
    source = scene.source
    unit = f"{source.unit_name}s" if source.metres_per_unit == 1.0 else f"units of {source.metres_per_unit:g} m"
    read = f"{source.path.name or 'scene'}: read in {unit} it measures"
    check_size(read, size_m, source.metres_per_unit)
    if size_m.max() > LONGEST_M and (plan_m2 := _plan_m2(scene)) > MAX_PLAN_M2:
        raise SceneError(
            f"{read} {_sides(size_m)} m and its surfaces cover {plan_m2 / 1e6:.0f} km2 seen from above, expected "
            f"{MAX_PLAN_M2 / 1e6:.0f} km2 at most; {_remedy(float(size_m.max()), source.metres_per_unit)}."
        )


def check_size(read: str, size_m: FloatArray, metres_per_unit: float) -> None:
    """Refuse a size (3,) that no building has; `read` is what the line begins with, up to the size."""
    longest_m = float(size_m.max())
    if SHORTEST_M <= longest_m <= MAX_LENGTH_M and size_m.min() <= MAX_WIDTH_M:
        return
    raise SceneError(
        f"{read} {_sides(size_m)} m, expected {SHORTEST_M:g} m to {MAX_LENGTH_M / 1000:g} km, and less than "
        f"{MAX_WIDTH_M / 1000:g} km in one direction; {_remedy(longest_m, metres_per_unit)}."
    )


def face_weights(corners_m: FloatArray) -> FloatArray:
    """(T,) float64, how much each triangle (T, 3, 3) counts for telling where the bulk is; not all of them 0.

    Faces longer than `STRAY_DISTANCE_M` have a corner astray and count nothing, unless most faces are so long (which
    is a wrong unit).
    """
    cross = area_normals(corners_m)
    weight: FloatArray = np.minimum(0.5 * lengths(cross), _LARGEST_WEIGHT_M2)
    low_m, high_m = bounds_of(corners_m)
    too_long = (high_m - low_m).max(axis=1) > STRAY_DISTANCE_M
    if too_long.mean() < 0.5:
        weight = np.where(too_long, 0.0, weight)
    return weight if weight.any() else np.ones(weight.size)


def weighted_quantile(values: FloatArray, weight: FloatArray, share: float) -> float:
    """Smallest of `values` (N,) such that it and the smaller ones have `share` of the weight."""
    order = np.argsort(values, kind="stable")
    below = np.cumsum(weight[order])
    at = int(np.searchsorted(below, share * below[-1]))
    return float(values[order[min(at, values.size - 1)]])


def bulk_centre_m(corners_m: FloatArray, weight: FloatArray) -> FloatArray:
    """(3,) float64: weighted median of the triangles' centroids, axis by axis."""
    centroid = corners_m.mean(axis=1)
    return np.array([weighted_quantile(centroid[:, axis], weight, 0.5) for axis in range(3)])


def is_astray(corners_m: FloatArray, weight: FloatArray) -> BoolArray:
    """(T,) bool: a corner lies further than `STRAY_DISTANCE_M`, and than the bulk is large, outside the bulk.

    The bulk is a cube around `bulk_centre_m` that holds `BULK_SHARE` of the weight.
    """
    distance = np.abs(corners_m - bulk_centre_m(corners_m, weight)).max(axis=(1, 2))
    bulk_m = weighted_quantile(distance, weight, BULK_SHARE)
    astray: BoolArray = distance > bulk_m + max(STRAY_DISTANCE_M, bulk_m)
    return astray


def fence_m(corners_m: FloatArray) -> FloatArray:
    """(2, 3) float64: lowest and highest place of the bulk and what is near it.

    That is the box of the middle 98 % of the centroids' weight on each axis, widened on either side by its own length
    and at least by `NEAR_M`.
    """
    weight = face_weights(corners_m)
    centroid = corners_m.mean(axis=1)
    quantiles = [[weighted_quantile(centroid[:, axis], weight, share) for axis in range(3)] for share in (0.01, 0.99)]
    low, high = np.array(quantiles)
    margin = np.maximum(high - low, NEAR_M)
    return np.stack([low - margin, high + margin])


def is_outside(corners_m: FloatArray, fence: FloatArray) -> BoolArray:
    """(T,) bool: no part of the triangle's box (T, 3, 3) is inside the fence (2, 3)."""
    low_m, high_m = bounds_of(corners_m)
    outside: BoolArray = ((high_m < fence[0]) | (low_m > fence[1])).any(axis=1)
    return outside


def named_few(names: list[str]) -> str:
    """Up to three different names for a warning, in their order, and how many more there are."""
    different = list(dict.fromkeys(names))
    more = f" and {len(different) - 3} more" if len(different) > 3 else ""
    return ", ".join(repr(name) for name in different[:3]) + more


def _sides(size_m: FloatArray) -> str:
    return " x ".join(f"{side_m:.3g}" if not 10 <= side_m < 1e7 else f"{side_m:.0f}" for side_m in size_m)


def _remedy(longest_m: float, metres_per_unit: float) -> str:
    unit = likely_unit(longest_m, metres_per_unit)
    if unit is None:
        return "no unit makes a building of it, leave out what is not the building, or export that alone"
    length_m = longest_m / metres_per_unit * UNITS_M[unit]
    return f"pass its unit, such as --units {unit}, in which it is {length_m:.3g} m long, or export less of the site"


def _plan_m2(scene: Scene) -> float:
    """Area of all surfaces seen from above, each counted however many lie over it."""
    total_m2 = 0.0
    for some in chunks(scene.n_triangles):
        a, b, c = (scene.vertices_m[scene.triangles[some, corner], :2] for corner in range(3))
        ab, ac = b - a, c - a
        total_m2 += float(0.5 * np.abs(ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]).sum())
    return total_m2

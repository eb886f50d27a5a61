"""How large a scene is: its longest side, and whether anything that is built can be as large or as small.

Input a `Scene` (metres); output metres. A wrong unit makes a house kilometres long, and planning it hours or patches
without number: it is refused before that.
"""

from __future__ import annotations

import numpy as np

from planner_core.errors import SceneError
from planner_core.model import FloatArray, Scene
from planner_core.scene.bulk import fence_m, is_outside

LONGEST_M, SHORTEST_M = 1000.0, 0.5
"""Extents outside these are hardly a building to scan: the unit is probably another."""

MAX_LENGTH_M = 20_000.0
"""Nothing that is scanned from tripods in one survey is longer; tunnels of some kilometres are."""

MAX_WIDTH_M = 1000.0
"""Nothing built is this large in all three directions: tunnels are thin, airports flat. A house read in metres that is
drawn in millimetres is, from its first storey on."""


def extent_m(scene: Scene) -> FloatArray:
    """(3,) float64; of the bulk where the whole is too long, since a stray face makes a house kilometres long."""
    whole_m: FloatArray = np.ptp(scene.vertices_m, axis=0)
    if whole_m.max() <= LONGEST_M:
        return whole_m
    corners_m = scene.vertices_m[scene.triangles]
    near = corners_m[~is_outside(corners_m, fence_m(corners_m))].reshape(-1, 3)
    return np.asarray(np.ptp(near, axis=0), dtype=np.float64)


def likely_unit(longest_m: float) -> str:
    """Return the unit that a scene of such a length is probably drawn in, as `--units` takes it."""
    if longest_m < SHORTEST_M:
        return "km"
    return "mm" if longest_m > 3 * LONGEST_M else "cm"


def check_extent(scene: Scene) -> None:
    """Refuse a scene that can't be planned at the size it has.

    Raises
    ------
    SceneError
        Its size, and the unit to pass instead.
    """
    size_m = extent_m(scene)
    longest_m, thinnest_m = float(size_m.max()), float(size_m.min())
    if SHORTEST_M <= longest_m <= MAX_LENGTH_M and thinnest_m <= MAX_WIDTH_M:
        return
    source = scene.source
    name = source.path.name or "scene"
    told = f"{source.unit_name}s" if source.metres_per_unit == 1.0 else f"units of {source.metres_per_unit:g} m"
    sides = " x ".join(f"{side_m:.3g}" if side_m < 10 else f"{side_m:.0f}" for side_m in size_m)
    limits = f"{SHORTEST_M:g} m to {MAX_LENGTH_M / 1000:g} km, and less than {MAX_WIDTH_M / 1000:g} km in one direction"
    raise SceneError(
        f"{name}: read in {told} it measures {sides} m, expected {limits}; pass its unit, such as --units "
        f"{likely_unit(longest_m)}."
    )

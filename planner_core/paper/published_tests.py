"""The paper's three tests of whether a scanner can stand at a position, as it prints them.

Local frame, metres; the paper's y axis is our z. `planner_core.positions.admissibility` asks for more: headroom, eight
directions at three heights, level feet, a roof; and for less where something lies flush with the ground.

References
----------
López et al. 2023, section 3.4; Table 2: r = 0.2 m, m = 16 rays, d = 0.4 m.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import BoolArray, FloatArray
from planner_core.positions.admissibility import Tripods

_DOWN = np.array([[0.0, 0.0, -1.0]])
_SIDEWAYS = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])


def stands_by_published_tests(tripods: Tripods, floor: int, positions_m: FloatArray) -> BoolArray:
    """(N,) bool: which of positions (N, 3) pass all three tests; none on a floor without slab, hence without polygons.

    1. The first surface straight down is ground.
    2. So it is from each of m places on a circle of radius r about the position.
    3. Nothing lies within d in the four horizontal directions of the axes.
    """
    survey, cast_rays, clearance_m = tripods.survey, tripods.engine.cast_rays, tripods.clearance_m
    is_ground = np.zeros(survey.scene.n_triangles + 1, dtype=bool)  # the last entry is the miss, -1
    is_ground[survey.floors[floor].ground_triangles] = True
    vertices_m = survey.scene.vertices_m
    reach_m = float(np.abs(vertices_m).max() + np.abs(positions_m).max(initial=0.0)) * 2.0 + 1.0
    angle = np.arange(tripods.n_ring_rays) * (2.0 * np.pi / tripods.n_ring_rays)
    ring = tripods.ring_radius_m * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(angle.size)])

    def over_ground(places_m: FloatArray) -> BoolArray:
        down = np.broadcast_to(_DOWN, places_m.shape)
        return np.asarray(is_ground[cast_rays(places_m, down, range_max_m=reach_m).triangle])

    kept = over_ground(positions_m)
    left = np.flatnonzero(kept)
    feet = (positions_m[left, None, :] + ring).reshape(-1, 3)
    kept[left] = over_ground(feet).reshape(left.size, ring.shape[0]).all(axis=1)
    left = np.flatnonzero(kept)
    if clearance_m > 0 and left.size:
        origins = np.repeat(positions_m[left], len(_SIDEWAYS), axis=0)
        hits = cast_rays(origins, np.tile(_SIDEWAYS, (left.size, 1)), range_max_m=clearance_m)
        kept[left] = np.isnan(hits.range_m).reshape(left.size, len(_SIDEWAYS)).all(axis=1)
    return kept

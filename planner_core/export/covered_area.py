"""Drawings stage: the area that triangles cover together in plan, overlaps and all. Any frame, metres."""

from __future__ import annotations

from typing import Any

import numpy as np

from planner_core.export.polylines import SAME_POINT_M
from planner_core.model import FloatArray


def covered_polygons(corners_m: FloatArray, without_m: FloatArray | None = None) -> list[list[FloatArray]]:
    """Find the area that triangles (K, 3, 2) of any winding cover, as polygons.

    Parameters
    ----------
    without_m
        (L, 3, 2) triangles whose area is taken away; None: nothing is.

    Returns
    -------
    Of each polygon its outer ring, then its openings: (N, 2) float64 each, the first corner not repeated. Corners are
    rounded to `SAME_POINT_M`, which closes narrower slits; polygons touch each other in single places at most.
    """
    import shapely

    # About the first corner: rounding is to whole steps from the origin.
    origin_m = corners_m[0, 0] if len(corners_m) else np.zeros(2)
    area = _union(corners_m - origin_m)
    if without_m is not None:
        area = shapely.difference(area, _union(without_m - origin_m), grid_size=SAME_POINT_M)
    polygons = [part for part in shapely.get_parts(area) if part.geom_type == "Polygon" and not part.is_empty]
    return [
        [shapely.get_coordinates(ring)[:-1] + origin_m for ring in (polygon.exterior, *polygon.interiors)]
        for polygon in polygons
    ]


def distances_m(points_m: FloatArray, corners_m: FloatArray) -> FloatArray:
    """(N,) distances of points (N, 2) from the area that triangles (K, 3, 2) cover; 0 on it."""
    import shapely

    found: FloatArray = shapely.distance(shapely.points(points_m), _union(corners_m))
    return found


def _union(corners_m: FloatArray) -> Any:
    import shapely

    return shapely.union_all(shapely.polygons(corners_m), grid_size=SAME_POINT_M)

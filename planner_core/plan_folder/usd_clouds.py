"""The stage's cloud layers: each station's scan, thinned, as UsdGeomPoints relative to the sensor."""

from __future__ import annotations

import numpy as np

from planner_core.model import BeamTemplate, BoolArray, Float32Array
from planner_core.plan_folder.palette import range_colour_index, range_ramp_srgb
from planner_core.plan_folder.sdf_authoring import (
    TYPES,
    Layer,
    Sdf,
    define,
    float_array,
    new_layer,
    put,
    put_colours,
    put_extent,
    put_transform,
    set_stage_metadata,
    vec3f_array,
)
from planner_core.scanner.template import directions

MAX_POINTS = 20_000
"""A usdview-class viewer draws some hundred stations of these at once."""

POINT_WIDTH_M = 0.015


def cloud_layer(range_m: Float32Array, template: BeamTemplate) -> Layer:
    """One scan's layer: default prim /Cloud. range_m : (R, C) float32, NaN on a miss."""
    layer = new_layer()
    with Sdf.ChangeBlock():
        set_stage_metadata(layer, "Cloud")
        prim = define(layer, "/Cloud", "Points")
        kept = thinned(template.shape) & np.isfinite(range_m)
        points_m = directions(template)[kept] * range_m[kept, None]
        put_transform(prim)
        # Guide: drawn on request, so that the coverage on the walls behind is seen first.
        put(prim, "purpose", TYPES.Token, "guide", uniform=True)
        put(prim, "points", TYPES.Point3fArray, vec3f_array(points_m))
        put(prim, "widths", TYPES.FloatArray, float_array(np.array([POINT_WIDTH_M]))).SetInfo(
            "interpolation", "constant"
        )
        put_extent(prim, points_m if points_m.size else np.zeros((1, 3)), margin_m=POINT_WIDTH_M / 2)
        put_colours(prim, range_ramp_srgb(), "vertex", range_colour_index(range_m[kept], template.range_max_m))
    return layer


def thinned(shape: tuple[int, int]) -> BoolArray:
    """(R, C) bool: a regular choice of at most `MAX_POINTS` beams, staggered by row so that no stripes show."""
    n_rows, n_columns = shape
    step = max(1, -(-n_rows * n_columns // MAX_POINTS))
    kept: BoolArray
    if step > n_columns:
        kept = np.arange(n_rows * n_columns).reshape(shape) % step == 0
        return kept
    step = max(1, -(-n_columns // max(1, MAX_POINTS // n_rows)))
    shift = (np.arange(n_rows) * 7) % step
    kept = (np.arange(n_columns)[None, :] % step) == shift[:, None]
    return kept

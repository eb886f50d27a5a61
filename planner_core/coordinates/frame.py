"""What the plan's scene file and the user say of coordinates -> `SiteFrame`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from planner_core.coordinates.request import FrameRequest
from planner_core.model import FloatArray, SiteFrame


def site_frame(document: Mapping[str, Any], request: FrameRequest | None = None) -> SiteFrame:
    """Return the frame that a plan is handed over in.

    Parameters
    ----------
    document
        Of `planner_core.export.plan_json.read_plan_json`.
    """
    asked = request or FrameRequest()
    if asked.origin_m is not None:
        return SiteFrame(
            matrix=matrix_of(asked.origin_m, asked.rotation_rad, asked.scale),
            crs=asked.crs,
            vertical_crs=asked.vertical_crs,
            name=asked.crs or "local site coordinates",
            source="given epsg",
        )
    return SiteFrame()


def matrix_of(origin_m: tuple[float, float, float], rotation_rad: float, scale: float) -> FloatArray:
    """(4, 4) of a turn about z, counter-clockwise, one scale in plan, and a shift."""
    cos, sin = scale * math.cos(rotation_rad), scale * math.sin(rotation_rad)
    matrix = np.eye(4)
    matrix[:2, :2] = [[cos, -sin], [sin, cos]]
    matrix[:3, 3] = origin_m
    return matrix

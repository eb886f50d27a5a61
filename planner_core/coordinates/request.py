"""The user's options for the site's coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from planner_core.model import LengthUnit


@dataclass(frozen=True)
class FrameRequest:
    """How the site's coordinates come about. None given: those of the plan's scene file, else scene coordinates.

    origin_m : E, N, H of the scene's origin, metres even where the CRS is in feet. rotation_rad : of the scene against
    the grid, counter-clockwise seen from above. control_points : CSV, see `planner_core.coordinates.control_points`. At
    most one of `origin_m`, `control_points`, `by_site_placement` and `scene_coordinates` is given.
    """

    crs: str = ""
    """A code, a name or WKT; empty: a local system, or the scene file's."""
    vertical_crs: str = ""
    origin_m: tuple[float, float, float] | None = None
    rotation_rad: float = 0.0
    scale: float = 1.0
    """In plan; of `origin_m` only."""
    control_points: Path | None = None
    parameters: int = 4
    """Of the transformation that control points give: 4 (and a shift of heights) or 7."""
    fixed_scale: bool = False
    """Control points give no scale: it is 1."""
    residual_limit_m: float = 0.02
    """Of control points; a warning names those beyond."""
    by_site_placement: bool = False
    """By latitude, longitude and true north of the scene file, in `crs`: good to metres or worse."""
    scene_coordinates: bool = False
    """Scene coordinates, whatever the scene file has."""
    accept_implausible: bool = False
    """Coordinates that are surely wrong are taken with a warning, instead of being refused."""
    unit: LengthUnit | None = None
    """Of site coordinates that people read, and that files write which do not say theirs; None: that of the CRS."""

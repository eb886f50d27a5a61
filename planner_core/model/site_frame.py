"""The site's coordinates: easting, northing and height in metres, and how scene coordinates become them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from planner_core.model.arrays import FloatArray

SCENE_NAME = "scene coordinates"


def _identity() -> FloatArray:
    return np.eye(4, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class SiteFrame:
    """From the scene frame to the site's: E, N, H = `matrix` @ (x, y, z, 1).

    matrix : (4, 4) float64, affine, right-handed, z up; metres to metres. Its horizontal scale may differ from 1.
    """

    matrix: FloatArray = field(default_factory=_identity)
    crs: str = ""
    """What names the coordinate reference system to programs: `EPSG:25832` or WKT; empty: a local one."""
    vertical_crs: str = ""
    """The same of heights; empty: not told."""
    name: str = SCENE_NAME
    """For people: `EPSG:25832 ETRS89 / UTM zone 32N`, or `scene coordinates`."""
    source: str = "scene"
    """`ifc map conversion`, `ifc site placement`, `given epsg`, `control points` or `scene`."""
    residuals_m: tuple[float, ...] = ()
    """Of control points: how far each is off, in space, in their order."""
    warnings: tuple[str, ...] = ()
    """One line each, for the user."""

    @property
    def is_scene(self) -> bool:
        """Whether site coordinates are the scene's own: nothing is known of where the site is."""
        return self.source == "scene"

    @property
    def crs_line(self) -> str:
        """What every file says of its coordinates: their system, and that of heights where it is told."""
        if self.is_scene:
            return f"{SCENE_NAME}, no CRS"
        heights = f"heights {self.vertical_crs}" if self.vertical_crs else "height datum not told"
        return f"{self.name if self.crs else f'{self.name}, no CRS'}; {heights}"

    @property
    def grid_north_rad(self) -> float:
        """Direction of the site's north in the plan of the scene: clockwise from its +y, in (-pi, pi]."""
        north = np.linalg.solve(self.matrix[:3, :3], np.array([0.0, 1.0, 0.0]))
        return math.atan2(float(north[0]), float(north[1]))

    @property
    def horizontal_scale(self) -> float:
        """Metres on the site's grid of one metre of the scene, in plan."""
        return math.sqrt(abs(float(np.linalg.det(self.matrix[:2, :2]))))

    def to_site(self, points_m: FloatArray) -> FloatArray:
        """(N, 3) or (3,) float64 of the scene frame -> the same shape of E, N, H."""
        points = np.asarray(points_m, dtype=np.float64)
        return np.asarray(points @ self.matrix[:3, :3].T + self.matrix[:3, 3])

    def to_scene(self, points_m: FloatArray) -> FloatArray:
        """(N, 3) or (3,) float64 E, N, H -> the same shape in the scene frame."""
        # The shift goes first: with northings of millions it would eat the digits of the product.
        points = np.asarray(points_m, dtype=np.float64) - self.matrix[:3, 3]
        return np.asarray(np.linalg.solve(self.matrix[:3, :3], points.T).T)

"""Surfaces of USD's basic shapes: Cube, Sphere, Cylinder, Cone, Capsule and Plane, as polygons.

Round shapes are turned profiles with their corners on the true surface, so that their areas come out a little small.
Source: the reference of usd-core 26.11 (UsdGeomCube to UsdGeomPlane: meaning of sizes and axes).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from planner_core.errors import SceneError, one_line
from planner_core.model import FloatArray, Int64Array

DEVIATION_M = 0.0005
"""By how much an edge of a round shape may leave the true surface; a face that is round both ways, by twice as much.
IfcOpenShell's tolerance for curved surfaces is 1 mm, too."""
_FEWEST, _MOST = 16, 256
"""Sides of a round shape."""

_Profile = list[tuple[float, float]]
"""Radius and height of each ring, from bottom to top; a ring without radius is a point."""


@dataclass(frozen=True)
class Polygons:
    """vertices : (V, 3) float64, the prim's own frame. n_corners : (F,). corners : (sum of n_corners,).

    Corners run counter-clockwise seen from outside; a plane's outside is where its axis points.
    """

    vertices: FloatArray
    n_corners: Int64Array
    corners: Int64Array


def is_shape(prim: Any) -> bool:
    """`shape_of` knows it."""
    return str(prim.GetTypeName()).removesuffix("_1") in _MAKERS


def shape_of(prim: Any, title: str, metres_per_unit: float) -> Polygons:
    """Polygons of a basic shape.

    Parameters
    ----------
    title : what errors call it.
    metres_per_unit : of the shape's own frame, to choose as many sides as `DEVIATION_M` wants.

    Raises
    ------
    SceneError
        A size is negative or not finite, or an axis none.
    """
    maker = _MAKERS[str(prim.GetTypeName()).removesuffix("_1")]
    made: Polygons = maker(_Sizes(prim, title, metres_per_unit))
    return made


@dataclass(frozen=True)
class _Sizes:
    """A shape's attributes, checked."""

    prim: Any
    title: str
    metres_per_unit: float

    def length(self, name: str) -> float:
        from pxr import Usd

        value = self.prim.GetAttribute(name).Get(Usd.TimeCode.EarliestTime())
        if not (isinstance(value, int | float) and math.isfinite(value) and value >= 0):
            raise self._fault(name, value, "0 or more")
        return float(value)

    def radii(self) -> tuple[float, float]:
        """At the bottom and at the top."""
        if self.prim.HasAttribute("radiusBottom"):
            return self.length("radiusBottom"), self.length("radiusTop")
        return self.length("radius"), self.length("radius")

    @property
    def axis(self) -> int:
        """0, 1, 2: x, y, z."""
        value = self.prim.GetAttribute("axis").Get()
        if value not in ("X", "Y", "Z"):
            raise self._fault("axis", value, "X, Y or Z")
        return "XYZ".index(value)

    def _fault(self, name: str, got: object, expected: str) -> SceneError:
        shown = one_line(f"{got}")[:40]
        return SceneError(
            f"{self.title}: its {name} is {shown}, expected {expected}; repair the shape and export it again."
        )

    def n_sides(self, radius: float) -> int:
        """A multiple of 4: as many as it takes for chords to stay within `DEVIATION_M`."""
        radius_m = radius * self.metres_per_unit
        if not radius_m > DEVIATION_M:
            return _FEWEST
        half_angle = max(math.acos(max(1.0 - DEVIATION_M / radius_m, -1.0)), math.pi / _MOST)  # 0 beyond float64
        return max(4 * math.ceil(math.pi / half_angle / 4), _FEWEST)


def _cube(sizes: _Sizes) -> Polygons:
    corners = np.array([[x, y, z] for z in (-0.5, 0.5) for y in (-0.5, 0.5) for x in (-0.5, 0.5)])
    faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    return _polygons(corners * sizes.length("size"), faces)


def _plane(sizes: _Sizes) -> Polygons:
    """Width is along x, or z where the plane faces x; length along y, or z where it faces y."""
    axis = sizes.axis
    across, along = (2, 1) if axis == 0 else (0, 2) if axis == 1 else (0, 1)
    points = np.zeros((4, 3))
    points[:, across] = sizes.length("width") * np.array([-0.5, 0.5, 0.5, -0.5])
    points[:, along] = sizes.length("length") * np.array([-0.5, -0.5, 0.5, 0.5])
    return _polygons(points, [[0, 1, 2, 3] if axis == 2 else [3, 2, 1, 0]])


def _sphere(sizes: _Sizes) -> Polygons:
    radius = sizes.length("radius")
    n_sides = sizes.n_sides(radius)
    lower, upper = _quarter(radius, n_sides, 0.0, -1), _quarter(radius, n_sides, 0.0, 1)
    return _turned([*lower, *upper[1:]], n_sides, axis=2)


def _cylinder(sizes: _Sizes) -> Polygons:
    bottom, top = sizes.radii()
    half = 0.5 * sizes.length("height")
    return _turned(
        [(0.0, -half), (bottom, -half), (top, half), (0.0, half)], sizes.n_sides(max(bottom, top)), axis=sizes.axis
    )


def _cone(sizes: _Sizes) -> Polygons:
    radius, half = sizes.length("radius"), 0.5 * sizes.length("height")
    return _turned([(0.0, -half), (radius, -half), (0.0, half)], sizes.n_sides(radius), axis=sizes.axis)


def _capsule(sizes: _Sizes) -> Polygons:
    """Its height is that of the cylinder between the half spheres."""
    bottom, top = sizes.radii()
    half = 0.5 * sizes.length("height")
    n_sides = sizes.n_sides(max(bottom, top))
    return _turned([*_quarter(bottom, n_sides, -half, -1), *_quarter(top, n_sides, half, 1)], n_sides, axis=sizes.axis)


_MAKERS = {
    "Cube": _cube,
    "Plane": _plane,
    "Sphere": _sphere,
    "Cylinder": _cylinder,
    "Cone": _cone,
    "Capsule": _capsule,
}


def _quarter(radius: float, n_sides: int, height: float, sign: int) -> _Profile:
    """Profile of the half sphere around `height`, from bottom to top: the lower half where `sign` is -1."""
    angles = np.linspace(0.0, math.pi / 2, n_sides // 4 + 1)
    rings = [(radius * math.cos(a), height + sign * radius * math.sin(a)) for a in angles.tolist()]
    rings[-1] = (0.0, height + sign * radius)
    return rings if sign > 0 else rings[::-1]


def _turned(profile: _Profile, n_sides: int, *, axis: int) -> Polygons:
    """`profile` turned around `axis` (0, 1, 2: x, y, z)."""
    angle = np.arange(n_sides) * (2 * math.pi / n_sides)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points: list[FloatArray] = []
    rings: list[list[int]] = []
    for radius, height in profile:
        first = sum(map(len, points))
        n = n_sides if radius > 0 else 1
        points.append(np.column_stack([radius * circle[:n], np.full(n, height)]))
        rings.append([first + i % n for i in range(n_sides + 1)])
    faces = [
        [lower[i], *dict.fromkeys((lower[i + 1], upper[i + 1], upper[i]))]
        if lower[i] != lower[i + 1]
        else [lower[i], upper[i + 1], upper[i]]
        for lower, upper in pairwise(rings)
        for i in range(n_sides)
        if lower[i] != lower[i + 1] or upper[i] != upper[i + 1]
    ]
    return _polygons(np.roll(np.concatenate(points), axis - 2, axis=1), faces)


def _polygons(vertices: FloatArray, faces: list[list[int]]) -> Polygons:
    return Polygons(
        vertices,
        np.array([len(face) for face in faces], dtype=np.int64),
        np.array([corner for face in faces for corner in face], dtype=np.int64),
    )

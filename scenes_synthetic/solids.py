"""Closed solids made of triangles: the geometry that every synthetic element is built of.

Metres, z up, right-handed. Triangles run counter-clockwise seen from outside, so normals point out of the material.
All coordinates are rounded to a micrometre: values that mean the same place are then the same number.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int32Array

Point = tuple[float, float, float]

_DECIMALS = 6


@dataclass(frozen=True)
class Solid:
    """A closed surface: vertices_m (V, 3) float64, triangles (T, 3) int32, normals outwards."""

    vertices_m: FloatArray
    triangles: Int32Array

    @property
    def area_m2(self) -> float:
        """Area of the whole surface."""
        a, b, c = (self.vertices_m[self.triangles[:, i]] for i in range(3))
        return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)

    @property
    def volume_m3(self) -> float:
        """Enclosed volume by the divergence theorem; negative if the surface is inside out."""
        a, b, c = (self.vertices_m[self.triangles[:, i]] for i in range(3))
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)

    @property
    def bounds_m(self) -> FloatArray:
        """(2, 3) float64: lowest and highest corner."""
        return np.array([self.vertices_m.min(axis=0), self.vertices_m.max(axis=0)])


def box(low_m: Point, high_m: Point) -> Solid:
    """Build an axis-parallel box of 12 triangles between two corners."""
    return rectilinear(*zip(low_m, high_m, strict=True), filled=np.ones((1, 1, 1), dtype=bool))


def pierced_box(low_m: Point, high_m: Point, holes: Sequence[tuple[Point, Point]]) -> Solid:
    """Build a box less the boxes `holes` (corner pairs inside it): a wall with windows, a slab with a stair opening.

    The faces are cut along the planes of all holes, so that the surface has no T-junction.
    """
    cuts: list[FloatArray] = []
    for axis in range(3):
        inside = [corner[axis] for hole in holes for corner in hole]
        values = [low_m[axis], high_m[axis], *inside]
        if min(values) < low_m[axis] or max(values) > high_m[axis]:
            raise ValueError(f"holes reach {min(values)}..{max(values)} outside the box {low_m[axis]}..{high_m[axis]}")
        cuts.append(np.unique(np.round(values, _DECIMALS)))
    filled = np.ones(tuple(c.size - 1 for c in cuts), dtype=bool)
    for hole in holes:
        (i0, i1), (j0, j1), (k0, k1) = (
            np.searchsorted(cuts[axis], np.round([hole[0][axis], hole[1][axis]], _DECIMALS)) for axis in range(3)
        )
        filled[i0:i1, j0:j1, k0:k1] = False
    return rectilinear(*cuts, filled=filled)


def rectilinear(
    x_m: Sequence[float] | FloatArray,
    y_m: Sequence[float] | FloatArray,
    z_m: Sequence[float] | FloatArray,
    *,
    filled: BoolArray,
) -> Solid:
    """Build the boundary of the filled cells of a grid with arbitrary spacing.

    x_m, y_m, z_m : (nx + 1,), (ny + 1,), (nz + 1,) ascending. filled : (nx, ny, nz).
    Raises ValueError where filled cells touch along an edge only: such a surface is no 2-manifold.
    """
    _refuse_touching_edges(filled)
    padded = np.pad(filled, 1)
    quads = [_quads_along(padded, axis) for axis in range(3)]
    corner_index = np.concatenate(quads)
    shape = tuple(n + 1 for n in filled.shape)
    flat = np.ravel_multi_index(tuple(np.moveaxis(corner_index, -1, 0)), shape)
    used, index = np.unique(flat, return_inverse=True)
    index = index.reshape(flat.shape)
    i, j, k = np.unravel_index(used, shape)
    vertices = np.stack([np.asarray(x_m)[i], np.asarray(y_m)[j], np.asarray(z_m)[k]], axis=1)
    triangles = np.concatenate([index[:, [0, 1, 2]], index[:, [0, 2, 3]]], axis=1).reshape(-1, 3)
    return Solid(np.round(vertices, _DECIMALS), triangles.astype(np.int32))


def _quads_along(padded: BoolArray, axis: int) -> Int32Array:
    """Corners (Q, 4, 3), as grid indices, of the faces normal to `axis`, counter-clockwise seen from outside."""
    moved = np.moveaxis(padded, axis, 0)
    step = np.diff(moved.astype(np.int8), axis=0)  # +1: material begins, the normal points to -axis
    quads = []
    for sign, order in ((-1, (0, 1, 2, 3)), (1, (0, 3, 2, 1))):
        plane, u, v = np.nonzero(step == sign)
        u, v = u - 1, v - 1  # the padding
        corners = np.stack(
            [np.stack([plane, u + du, v + dv], axis=1) for du, dv in ((0, 0), (1, 0), (1, 1), (0, 1))], 1
        )
        quads.append(corners[:, order])
    both = np.concatenate(quads)
    # moveaxis puts (axis, rest...) first; for y the rest is (x, z), a left-handed order, so those quads turn round.
    if axis == 1:
        both = both[:, ::-1]
    back = {0: [0, 1, 2], 1: [1, 0, 2], 2: [1, 2, 0]}[axis]
    return both[:, :, back].astype(np.int32)


def _refuse_touching_edges(filled: BoolArray) -> None:
    padded = np.pad(filled, 1)
    for axis in range(3):
        cells = np.moveaxis(padded, axis, 0)
        a, b, c, d = cells[:, :-1, :-1], cells[:, 1:, :-1], cells[:, :-1, 1:], cells[:, 1:, 1:]
        if np.any((a & d & ~b & ~c) | (b & c & ~a & ~d)):
            raise ValueError("filled cells touch along an edge only: fill a neighbour or leave a gap")


def prism(outline_m: Sequence[tuple[float, float]], *, axis: str, low_m: float, high_m: float) -> Solid:
    """Extrude a simple polygon along an axis.

    outline_m : corners counter-clockwise in (y, z) for axis "x" and in (x, y) for axis "z".
    """
    flat = np.asarray(outline_m, dtype=np.float64)
    n = len(flat)
    caps = _ear_clip(flat)
    ring = np.arange(n)
    following = np.roll(ring, -1)
    sides = np.concatenate(
        [np.stack([ring, following, following + n], 1), np.stack([ring, following + n, ring + n], 1)]
    )
    triangles = np.concatenate([caps[:, ::-1], caps + n, sides])
    columns = {"x": (1, 2, 0), "z": (0, 1, 2)}[axis]
    vertices = np.empty((2 * n, 3))
    vertices[:, columns[0]] = np.tile(flat[:, 0], 2)
    vertices[:, columns[1]] = np.tile(flat[:, 1], 2)
    vertices[:, columns[2]] = np.repeat([low_m, high_m], n)
    return Solid(np.round(vertices, _DECIMALS), triangles.astype(np.int32))


def _ear_clip(corners: FloatArray) -> Int32Array:
    """Triangulate a simple counter-clockwise polygon: (n - 2, 3) indices. Quadratic; outlines here are short."""
    left = list(range(len(corners)))
    triangles = []
    while len(left) > 3:
        ear = next((i for i in range(len(left)) if _is_ear(corners, left, i)), None)
        if ear is None:
            raise ValueError(f"outline of {len(corners)} corners is not simple and counter-clockwise")
        triangles.append((left[ear - 1], left[ear], left[(ear + 1) % len(left)]))
        left.pop(ear)
    return np.array([*triangles, left], dtype=np.int32)


def _is_ear(corners: FloatArray, left: list[int], i: int) -> bool:
    tip = (left[i - 1], left[i], left[(i + 1) % len(left)])
    a, b, c = corners[list(tip)]
    if _turn(a, b, c) <= 0:
        return False
    others = (corners[j] for j in left if j not in tip)
    return not any(_turn(a, b, p) >= 0 and _turn(b, c, p) >= 0 and _turn(c, a, p) >= 0 for p in others)


def _turn(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
    """Twice the signed area of abc."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def join(solids: Sequence[Solid]) -> Solid:
    """Put several closed solids into one list of triangles; they must not share an edge."""
    starts = np.cumsum([0, *(len(s.vertices_m) for s in solids[:-1])])
    return Solid(
        np.concatenate([s.vertices_m for s in solids]),
        np.concatenate([s.triangles + np.int32(start) for s, start in zip(solids, starts, strict=True)]),
    )


def place(solid: Solid, at_m: Point, *, turn_deg: float = 0.0) -> Solid:
    """Turn a solid about the z axis through its origin, counter-clockwise from above, and move it to `at_m`."""
    quarter, rest = divmod(turn_deg, 90.0)
    # Quarter turns are exact: cos(90 degrees) in floating point is not 0.
    c, s = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][int(quarter) % 4]
    small = np.deg2rad(rest)
    cos = c * np.cos(small) - s * np.sin(small)
    sin = s * np.cos(small) + c * np.sin(small)
    x, y, z = solid.vertices_m.T
    turned = np.stack([cos * x - sin * y, sin * x + cos * y, z], axis=1)
    return Solid(np.round(turned + np.asarray(at_m), _DECIMALS), solid.triangles)

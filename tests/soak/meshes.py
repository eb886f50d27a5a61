"""Closed meshes about their own origin, of size 1: what beams are aimed at in the soak of watertightness.

No T-junctions: every edge is shared, vertex by vertex, by an even number of triangles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]
Triangles = NDArray[np.int32]


@dataclass(frozen=True)
class Mesh:
    """vertices (V, 3), triangles (T, 3); inside (K, 3): points from which every beam has to end somewhere.

    grid : elevations and azimuths of the vertices seen from the origin, where they lie on such a grid.
    """

    name: str
    vertices: Points
    triangles: Triangles
    inside: Points
    grid: tuple[Points, Points] | None = None


def star(name: str, rings: int, sides: int, *, bumps: float, seed: int) -> Mesh:
    """A sphere of rings and sides whose vertices are moved in or out by up to `bumps`; 0 leaves it a sphere."""
    rng = np.random.default_rng(seed)
    elevation = np.pi / 2 - np.linspace(0, np.pi, rings + 1)[1:-1]
    azimuth = np.arange(sides) * (2 * np.pi / sides)
    around = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)
    body = np.empty((rings - 1, sides, 3))
    body[..., :2] = np.cos(elevation)[:, None, None] * around
    body[..., 2] = np.sin(elevation)[:, None]
    body *= 1 - bumps * rng.uniform(size=(rings - 1, sides, 1))
    vertices = np.concatenate([body.reshape(-1, 3), [[0, 0, 1], [0, 0, -1]]])
    cell = (np.arange(rings - 2)[:, None] * sides + np.arange(sides)).ravel()
    right = (np.arange(rings - 2)[:, None] * sides + (np.arange(sides) + 1) % sides).ravel()
    side, following = np.arange(sides), (np.arange(sides) + 1) % sides
    last = (rings - 2) * sides
    triangles = np.concatenate(
        [
            np.stack([cell, cell + sides, right], axis=1),
            np.stack([right, cell + sides, right + sides], axis=1),
            np.stack([np.full(sides, len(vertices) - 2), side, following], axis=1),
            np.stack([last + side, np.full(sides, len(vertices) - 1), last + following], axis=1),
        ]
    )
    # Off the centre only where the mesh is convex: a star is seen whole from its centre alone.
    inside = [[0, 0, 0]] if bumps else [[0, 0, 0], [0.31, 0.17, -0.22], [0, 0, 0.9]]
    return Mesh(name, vertices, triangles.astype(np.int32), np.array(inside, dtype=np.float64), (elevation, azimuth))


def block(name: str, size: tuple[float, float, float], cuts: tuple[Points, Points, Points]) -> Mesh:
    """A box about the origin, its faces cut along x, y and z at the given fractions of its sides."""
    at = [np.unique(np.concatenate([[0.0, 1.0], c])) * s - s / 2 for c, s in zip(cuts, size, strict=True)]
    solid = np.ones([len(a) - 1 for a in at], dtype=bool)
    vertices, triangles = cells_surface(solid, at)
    return Mesh(name, vertices, triangles, np.array([[0.0, 0.0, 0.0], [0.3, -0.2, 0.1] * np.array(size)]))


def hull(name: str, n_points: int, stretch: tuple[float, float, float], *, seed: int) -> Mesh:
    """The convex hull of points strewn on a stretched sphere."""
    from scipy.spatial import ConvexHull

    points = np.random.default_rng(seed).normal(size=(n_points, 3))
    points *= stretch / np.linalg.norm(points, axis=1, keepdims=True)
    found = ConvexHull(points)
    used, triangles = np.unique(found.simplices, return_inverse=True)
    return Mesh(
        name,
        points[used],
        triangles.reshape(-1, 3).astype(np.int32),
        np.array([[0.0, 0, 0], [0.2, 0.1, -0.1] * np.array(stretch)]),
    )


def walls(name: str, *, seed: int) -> Mesh:
    """Two storeys of three by three rooms in one solid: walls of 0.1 to 0.3, slabs, a door or a window in each wall."""
    rng = np.random.default_rng(seed)

    def alternate(
        n_rooms: int, room: float, wall: tuple[float, float], opening: float
    ) -> tuple[Points, NDArray[np.bool_]]:
        """Bounds of cells along an axis, wall, room in three parts, wall ...; and which cells are wall."""
        width, is_wall = [], []
        for _ in range(n_rooms):
            width += [rng.uniform(*wall), 0.4 * room, opening, 0.6 * room - opening]
            is_wall += [True, False, False, False]
        width.append(rng.uniform(*wall))
        return np.concatenate([[0.0], np.cumsum(width)]), np.array([*is_wall, True])

    x, wall_x = alternate(3, 4.0, (0.1, 0.3), 0.9)
    y, wall_y = alternate(3, 3.0, (0.1, 0.3), 0.9)
    z, wall_z = alternate(2, 2.7, (0.2, 0.3), 1.0)
    solid = wall_x[:, None, None] | wall_y[None, :, None] | wall_z[None, None, :]
    # Openings: in inner walls, at the middle part of the room beside, up to the second part of the storey's height.
    low = np.zeros(len(z) - 1, dtype=bool)
    low[[1, 2, 5, 6]] = True
    middle_x, middle_y = np.arange(len(x) - 1) % 4 == 2, np.arange(len(y) - 1) % 4 == 2
    inner_x, inner_y = wall_x.copy(), wall_y.copy()
    inner_x[[0, -1]] = inner_y[[0, -1]] = False
    solid &= ~(inner_x[:, None, None] & middle_y[None, :, None] & low)
    solid &= ~(middle_x[:, None, None] & inner_y[None, :, None] & low)
    vertices, triangles = cells_surface(solid, [x, y, z])
    middle = [(a[:-1] + a[1:]) / 2 for a in (x, y, z)]
    rooms = np.array([(middle[0][i], middle[1][j], middle[2][k]) for i in (2, 6, 10) for j in (2, 6) for k in (1, 5)])
    scale, shift = 1 / 7.0, rooms.mean(axis=0)
    off_middle = np.array([0.11, -0.07, 0.05])
    return Mesh(name, (vertices - shift) * scale, triangles, (rooms + off_middle - shift) * scale)


def cells_surface(solid: NDArray[np.bool_], at: list[Points]) -> tuple[Points, Triangles]:
    """The surface of the solid cells of a grid whose planes lie at the given coordinates: two triangles a face."""
    padded = np.pad(solid, 1)
    corners: list[NDArray[np.int64]] = []
    for axis in range(3):
        change = np.diff(padded.astype(np.int8), axis=axis)
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for sign in (1, -1):
            face = np.argwhere(change == sign)
            face[:, u] -= 1
            face[:, v] -= 1
            square = np.repeat(face[:, None, :], 4, axis=1)
            square[:, [1, 2], u] += 1
            square[:, [2, 3], v] += 1
            # Outwards is against the change from outside to inside.
            square = square[:, ::-1] if sign == 1 else square
            corners += [square[:, [0, 1, 2]], square[:, [0, 2, 3]]]
    index = np.concatenate(corners).reshape(-1, 3)
    used, triangles = np.unique(index, axis=0, return_inverse=True)
    vertices = np.stack([at[axis][used[:, axis]] for axis in range(3)], axis=1)
    return vertices, triangles.reshape(-1, 3).astype(np.int32)


def all_meshes(*, seed: int) -> tuple[Mesh, ...]:
    """The meshes of the soak."""
    even = np.linspace(0, 1, 9)
    needles = np.concatenate([even, 0.5 + 1e-5 * np.arange(1, 40)])
    none = np.empty(0)
    return (
        star("sphere, 10 rings", 10, 20, bumps=0.0, seed=seed),
        star("sphere, 60 rings", 60, 120, bumps=0.0, seed=seed),
        star("sphere of 2000 needles", 4, 500, bumps=0.0, seed=seed),
        star("bumpy star", 40, 90, bumps=0.6, seed=seed),
        block("box of 12", (2.0, 1.0, 0.7), (none, none, none)),
        block("box of needles", (2.0, 2.0, 2.0), (needles, even, none)),
        block("sliver, 1 : 20 000", (2.0, 0.7, 1e-4), (even, none, none)),
        hull("hull of 400", 400, (1.0, 0.8, 0.6), seed=seed),
        hull("thin hull of 300", 300, (1.0, 0.5, 1e-3), seed=seed + 1),
        walls("walls of 18 rooms", seed=seed),
    )


def odd_edges(triangles: Triangles) -> int:
    """Edges that an odd number of triangles share: holes. 0 for a closed mesh."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    return int((counts % 2).sum())

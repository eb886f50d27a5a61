"""The truth of every scene against its own mesh, by other ways than it was made: clipping, hashing, growing bodies."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

import scenes_synthetic
from scenes_synthetic.model import Room, SyntheticScene

pytestmark = pytest.mark.slow

NAMES = scenes_synthetic.names()


@pytest.fixture(params=NAMES)
def scene(request: pytest.FixtureRequest, built: dict[str, SyntheticScene]) -> SyntheticScene:
    if request.param not in built:
        built[request.param] = scenes_synthetic.build(request.param)
    return built[request.param]


def clipped(polygon: np.ndarray, inside_of: np.ndarray) -> np.ndarray:
    """What of a convex polygon (N, 2) lies inside a convex, counter-clockwise one: Sutherland and Hodgman."""
    for start, end in zip(inside_of, np.roll(inside_of, -1, axis=0), strict=True):
        if len(polygon) == 0:
            break
        edge = end - start
        side = edge[0] * (polygon[:, 1] - start[1]) - edge[1] * (polygon[:, 0] - start[0])
        kept = []
        for i in range(len(polygon)):
            j = (i + 1) % len(polygon)
            if side[i] >= 0:
                kept.append(polygon[i])
            if (side[i] > 0 > side[j]) or (side[i] < 0 < side[j]):
                kept.append(polygon[i] + side[i] / (side[i] - side[j]) * (polygon[j] - polygon[i]))
        polygon = np.array(kept)
    return polygon


def signed_area(polygon: np.ndarray) -> float:
    if len(polygon) < 3:
        return 0.0
    x, y = polygon.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def overlap_area(triangles: np.ndarray, outline: np.ndarray) -> float:
    """Area that triangles (T, 3, 2) share with a simple polygon, by its fan; negative for a clockwise one."""
    total = 0.0
    for i in range(1, len(outline) - 1):
        part = outline[[0, i, i + 1]]
        sign = np.sign(signed_area(part))
        part = part if sign > 0 else part[::-1]
        for triangle in triangles:
            turned = triangle if signed_area(triangle) > 0 else triangle[::-1]
            if (turned.max(axis=0) > part.min(axis=0)).all() and (turned.min(axis=0) < part.max(axis=0)).all():
                total += sign * signed_area(clipped(turned, part))
    return total


def faces(scene: SyntheticScene, kinds: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Corners (T, 3, 3) and unit normals (T, 3) of the triangles of some kinds of parts."""
    corners = np.concatenate([p.solid.vertices_m[p.solid.triangles] for p in scene.parts if p.kind in kinds])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return corners, normals / np.where(length > 0, length, 1.0)


def rings(room: Room) -> list[np.ndarray]:
    """The outline counter-clockwise and islands clockwise: the room is to the left of every edge."""
    return [np.asarray(ring) for ring in (room.outline_m, *room.islands_m)]


def mesh_floor_area_m2(scene: SyntheticScene, room: Room) -> float:
    corners, normals = faces(scene, ("IfcSlab",))
    level = (np.abs(corners[:, :, 2] - room.floor_m) < 1e-7).all(axis=1) & (normals[:, 2] > 0.999)
    return sum(overlap_area(corners[level][:, :, :2], ring) for ring in rings(room))


def mesh_wall_area_m2(scene: SyntheticScene, room: Room) -> float:
    corners, normals = faces(scene, ("IfcWall", "IfcColumn"))
    total = 0.0
    for start, end in (edge for ring in rings(room) for edge in zip(ring, np.roll(ring, -1, axis=0), strict=True)):
        length = float(np.linalg.norm(end - start))
        along = (end - start) / length
        inwards = np.array([-along[1], along[0]])
        off = (corners[:, :, :2] - start) @ inwards
        here = (np.abs(off) < 2e-6).all(axis=1) & (normals[:, :2] @ inwards > 0.999)
        flat = np.stack([(corners[here][:, :, :2] - start) @ along, corners[here][:, :, 2] - room.floor_m], axis=-1)
        rectangle = np.array([[0.0, 0.0], [length, 0.0], [length, room.height_m], [0.0, room.height_m]])
        total += overlap_area(flat, rectangle)
    return total


@pytest.mark.parametrize("scene", sorted({*NAMES} - {"without-slabs"}), indirect=True)  # it has no slabs
def test_floor_areas_are_those_of_slabs_inside_the_rooms_outline(scene: SyntheticScene) -> None:
    found = {room.name: mesh_floor_area_m2(scene, room) for room in scene.rooms}
    assert found == pytest.approx(scene.truth.floor_area_m2, rel=1e-5)


@pytest.mark.parametrize("scene", sorted({*NAMES} - {"tunnel"}), indirect=True)  # a vault, tested by itself
def test_wall_areas_are_those_of_faces_along_the_rooms_outline(scene: SyntheticScene) -> None:
    found = {room.name: mesh_wall_area_m2(scene, room) for room in scene.rooms}
    assert found == pytest.approx(scene.truth.wall_area_m2, rel=1e-5)


def test_no_two_parts_have_a_triangle_in_common(scene: SyntheticScene) -> None:
    """By a hash of micrometres that does not depend on the order of corners."""
    rng = np.random.default_rng(0)
    factor = rng.integers(1, 2**62, size=3, dtype=np.uint64) | np.uint64(1)
    place = np.round(scene.scene.vertices_m * 1e6).astype(np.int64).view(np.uint64)
    corner = (place * factor).sum(axis=1, dtype=np.uint64)
    corner ^= corner >> np.uint64(29)
    corner *= factor[0]
    keys = np.sort(corner[scene.scene.triangles].sum(axis=1, dtype=np.uint64))
    assert np.count_nonzero(np.diff(keys) == 0) == scene.truth.n_duplicate


def test_every_body_encloses_a_volume_with_its_normals_outwards(scene: SyntheticScene) -> None:
    """A body is what is connected by vertices: a leg, a book, a key. One inside out would lower the part's volume."""
    triangles, vertices = scene.scene.triangles, scene.scene.vertices_m
    sound = np.array([part.name != "Broken faces" for part in scene.parts])[scene.scene.element_of_triangle]
    triangles = triangles[sound]
    links = coo_array(
        (np.ones(2 * len(triangles), dtype=np.int8), (triangles[:, :2].ravel(), triangles[:, 1:].ravel())),
        shape=(len(vertices), len(vertices)),
    )
    n_bodies, body_of_vertex = connected_components(links, directed=False)
    body = body_of_vertex[triangles[:, 0]]
    first = np.full(n_bodies, -1)
    first[body_of_vertex[::-1]] = np.arange(len(vertices))[::-1]
    a, b, c = (vertices[triangles[:, i]] - vertices[first[body]] for i in range(3))
    volume = np.bincount(body, weights=np.einsum("ij,ij->i", a, np.cross(b, c)) / 6, minlength=n_bodies)
    used = np.bincount(body, minlength=n_bodies) > 0
    assert volume[used].min() > 0.0

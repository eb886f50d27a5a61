"""What a reader of one format hands to `load`: faces split into triangles, still in the file's unit and axes.

Also the two checks that all readers share: `triangulate` (polygons become triangles) and `what_it_looks_like` (the
first bytes of a file that is not what its name suggests).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from planner_core.model import (
    BoolArray,
    Element,
    FloatArray,
    Georeference,
    Int64Array,
    LoadReport,
    Optics,
    Room,
    Storey,
    UInt8Array,
)
from planner_core.scene.repair import MAX_DROPPED_LINES, bad_index_error


@dataclass(frozen=True)
class RawScene:
    """A scene as its file has it.

    vertices : (V, 3) float64, source frame. triangles : (T, 3) int64. element_of_triangle : (T,) int64 into elements.
    face_of_triangle : (T,) int64, number of the source's face, as its format numbers them.
    optics_of_triangle : (T,) uint8 of `Optics`, by the file's materials; None: it has none of that.
    """

    vertices: FloatArray
    triangles: Int64Array
    element_of_triangle: Int64Array
    face_of_triangle: Int64Array
    elements: tuple[Element, ...]
    storeys: tuple[Storey, ...] = ()
    """Elevations in the unit of `vertices`."""
    unit_name: str = ""
    """Empty where the file has no unit."""
    metres_per_unit: float = 1.0
    """The file's unit."""
    vertex_unit_m: float | None = None
    """Unit of `vertices` and storeys in metres, where the reader converted them; None: the file's."""
    up_axis: str = ""
    """`Y` or `Z`; empty where the file has none."""
    assumed_unit: str = ""
    """A line for the user where the file names no unit; empty where it does. So with the next."""
    assumed_up: str = ""
    schema: str = ""
    report: LoadReport = field(default_factory=lambda: LoadReport(n_faces_read=0))
    optics_of_triangle: UInt8Array | None = None
    rooms: tuple[Room, ...] = ()
    """In the unit of `vertices`, source frame; their storeys index `storeys` above."""
    georeference: Georeference | None = None
    """From metres of the file's own unit, source frame."""


@dataclass(frozen=True)
class Faces:
    """Polygons split into triangles.

    triangles : (T, 3) int64. polygon : (T,) int64, which polygon each is of. The counts are of triangles: a polygon of
    n corners stands for n - 2, at least one.
    """

    triangles: Int64Array
    polygon: Int64Array
    n_bad_index: int
    n_too_short: int
    dropped: tuple[str, ...]

    @property
    def n_dropped(self) -> int:
        """Triangles that are not there any more."""
        return self.n_bad_index + self.n_too_short

    def report(self) -> LoadReport:
        """What the split dropped, as the part of the scene's report that comes before the repair."""
        return LoadReport(
            n_faces_read=self.n_dropped,
            n_degenerate=self.n_too_short,
            n_bad_index=self.n_bad_index,
            dropped=self.dropped,
        )


def triangulate(
    vertices: FloatArray,
    n_corners: Int64Array,
    corners: Int64Array,
    *,
    name: str,
    skip_bad_faces: bool,
    first_number: int = 0,
    owner: str = "file",
    as_written: Int64Array | None = None,
) -> Faces:
    """Split polygons into triangles; triangles pass unchanged.

    Parameters
    ----------
    vertices : (V, 3) float64.
    n_corners : (F,) corners of each polygon. corners : (sum of n_corners,) vertex numbers from 0.
    name : what errors call the source.
    skip_bad_faces : drop polygons that name a missing vertex; otherwise that is an error.
    first_number, owner : how the format numbers its first vertex and face, and what has the vertices; for errors.
    as_written : (sum of n_corners,) vertex numbers as the file has them, where they are not just from `first_number`.

    Raises
    ------
    SceneError
        A polygon names a vertex that does not exist.

    Notes
    -----
    A convex polygon becomes a fan around its first corner. One with a notch would be overfilled by a fan, so its ears
    are clipped. Faces come out in the order of their polygons.
    """
    starts = np.concatenate([[0], np.cumsum(n_corners)]).astype(np.int64)
    bad = _names_missing_vertex(n_corners, corners, vertices.shape[0])
    if bad.any() and not skip_bad_faces:
        written = corners + first_number if as_written is None else as_written
        worst = int(written[(corners < 0) | (corners >= vertices.shape[0])][0])
        raise bad_index_error(
            name, int(bad.sum()), bad.size, worst, vertices.shape[0], first_number=first_number, owner=owner
        )
    short = (n_corners < 3) & ~bad
    good = np.flatnonzero(~bad & ~short)
    triangles, polygon = _split(vertices, good, starts, n_corners, corners)
    stands_for = np.maximum(n_corners - 2, 1)
    return Faces(
        triangles,
        polygon,
        int(stands_for[bad].sum()),
        int(short.sum()),
        _dropped_lines(bad, short, first_number),
    )


def _names_missing_vertex(n_corners: Int64Array, corners: Int64Array, n_vertices: int) -> BoolArray:
    owner = np.repeat(np.arange(n_corners.size), n_corners)
    bad = np.zeros(n_corners.size, dtype=bool)
    bad[owner[(corners < 0) | (corners >= n_vertices)]] = True
    return bad


def _dropped_lines(bad: BoolArray, short: BoolArray, first_number: int) -> tuple[str, ...]:
    numbers = np.flatnonzero(bad | short)[:MAX_DROPPED_LINES]
    return tuple(
        f"face {i + first_number}: "
        + ("names a vertex that does not exist" if bad[i] else "has fewer than three corners")
        for i in numbers.tolist()
    )


def _split(
    vertices: FloatArray, good: Int64Array, starts: Int64Array, n_corners: Int64Array, corners: Int64Array
) -> tuple[Int64Array, Int64Array]:
    """Triangles of the `good` polygons, in order. All polygons of one number of corners are split together."""
    parts: list[Int64Array] = []
    owners: list[Int64Array] = []
    for n in np.unique(n_corners[good]).tolist():
        polygons = good[n_corners[good] == n]
        rings = corners[starts[polygons][:, None] + np.arange(n)]
        k = np.arange(1, n - 1)
        fan = np.stack([np.broadcast_to(rings[:, :1], (rings.shape[0], n - 2)), rings[:, k], rings[:, k + 1]], axis=2)
        for i in np.flatnonzero(_has_notch(vertices[rings])) if n > 3 else ():
            fan[i] = _clip_ears(vertices[rings[i]], rings[i])
        parts.append(fan.reshape(-1, 3))
        owners.append(np.repeat(polygons, n - 2))
    if not parts:
        return np.zeros((0, 3), dtype=np.int64), np.zeros(0, dtype=np.int64)
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(parts)[order], owner[order]


def _area_vector(points: FloatArray) -> FloatArray:
    """(..., 3) twice the vector area of rings (..., n, 3), about their first corners."""
    spokes = points - points[..., :1, :]
    total: FloatArray = np.cross(spokes[..., 1:-1, :], spokes[..., 2:, :]).sum(axis=-2)
    return total


def _has_notch(points: FloatArray) -> BoolArray:
    """(N,) bool: some corner of the ring (N, n, 3) turns the wrong way. No where a coordinate is not finite."""
    with np.errstate(invalid="ignore"):
        before = points - np.roll(points, 1, axis=1)
        after = np.roll(points, -1, axis=1) - points
        turns = np.einsum("nij,nj->ni", np.cross(before, after), _area_vector(points))
        scale = np.abs(turns).max(axis=1, keepdims=True)
        notch: BoolArray = (turns < -1e-9 * scale).any(axis=1)  # corners on a straight edge turn by rounding only
    return notch


def _clip_ears(points: FloatArray, ring: Int64Array) -> Int64Array:
    """(n - 2, 3) triangles of one simple polygon: again and again cut the first corner whose triangle holds no other.

    Where rounding or a ring that crosses itself leaves no such corner, the first remaining one is cut, so that the
    result always has n - 2 triangles.
    """
    normal = _area_vector(points)
    drop = int(np.argmax(np.abs(normal)))
    flat = np.delete(points, drop, axis=1)
    if normal[drop] * (1 if drop != 1 else -1) < 0:  # leaving out y turns the plane over
        flat = flat * np.array([1.0, -1.0])
    left = list(range(len(ring)))
    triangles = []
    while len(left) > 3:
        at = next((i for i in range(len(left)) if _is_ear(flat, left, i)), 0)
        triangles.append((left[at - 1], left[at], left[(at + 1) % len(left)]))
        del left[at]
    triangles.append((left[0], left[1], left[2]))
    return ring[np.array(triangles, dtype=np.int64)]


def _is_ear(flat: FloatArray, left: list[int], at: int) -> bool:
    a, b, c = flat[left[at - 1]], flat[left[at]], flat[left[(at + 1) % len(left)]]
    if _side(a, b, c[None, :])[0] <= 0:
        return False
    others = flat[[i for i in left if i not in (left[at - 1], left[at], left[(at + 1) % len(left)])]]
    inside = (_side(a, b, others) >= 0) & (_side(b, c, others) >= 0) & (_side(c, a, others) >= 0)
    in_a_corner = (others[:, None, :] == np.stack([a, b, c])).all(axis=2).any(axis=1)
    return not bool((inside & ~in_a_corner).any())


def _side(a: FloatArray, b: FloatArray, points: FloatArray) -> FloatArray:
    side: FloatArray = (b[0] - a[0]) * (points[:, 1] - a[1]) - (b[1] - a[1]) * (points[:, 0] - a[0])
    return side


def exact(values: NDArray[np.generic]) -> FloatArray:
    """`values` as float64. A NaN of the signalling kind, as damage makes them, stays NaN and raises no warning."""
    with np.errstate(invalid="ignore"):
        return values.astype(np.float64)


# --------------------------------------------------------------------------------------------- placement
def placed(vertices: FloatArray, matrix: FloatArray) -> FloatArray:
    """(V, 3) float64: `vertices` moved by the 4x4 `matrix` (column vectors).

    Coordinate by coordinate rather than as a matrix product: BLAS may round one and the same row differently in another
    place of the array, and then two copies of a vertex would no longer be equal bit by bit.
    """
    x, y, z = vertices.T
    with np.errstate(over="ignore", invalid="ignore"):  # what ends up nowhere is dropped with the repair
        rows = [m[0] * x + m[1] * y + m[2] * z + m[3] for m in matrix[:3]]
    return np.stack(rows, axis=1)


def chained(a: FloatArray, b: FloatArray) -> FloatArray:
    """(4, 4) placement of b's frame inside a's, in a fixed order of operations: the same on every machine."""
    with np.errstate(over="ignore", invalid="ignore"):
        product: FloatArray = (a[:, :, None] * b[None, :, :]).sum(axis=1)
    return product


def turned_over(triangles: Int64Array) -> Int64Array:
    """(T, 3) the same triangles with the other winding: for mirrored instances and left-handed meshes."""
    return triangles[:, [0, 2, 1]]


def is_mirrored(matrix: FloatArray) -> bool:
    """A 4x4 placement that turns a right hand into a left one."""
    (a, b, c), (d, e, f), (g, h, i) = matrix[:3, :3].tolist()
    return bool(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) < 0)


@dataclass
class MeshParts:
    """Meshes of a scene graph, gathered one instance after another and joined at the end."""

    vertices: list[FloatArray] = field(default_factory=list)
    triangles: list[Int64Array] = field(default_factory=list)
    owner: list[Int64Array] = field(default_factory=list)
    face: list[Int64Array] = field(default_factory=list)
    optics: list[UInt8Array] = field(default_factory=list)
    n_vertices: int = 0

    def add(
        self,
        owner: int,
        vertices: FloatArray,
        triangles: Int64Array,
        face: Int64Array,
        optics: UInt8Array | None = None,
    ) -> None:
        """Take in one mesh, already placed: (V, 3), (T, 3) into its own vertices, (T,) face numbers, (T,) `Optics`."""
        self.vertices.append(vertices)
        self.triangles.append(triangles + self.n_vertices)
        self.owner.append(np.full(len(triangles), owner, dtype=np.int64))
        self.face.append(face)
        self.optics.append(np.full(len(triangles), Optics.RETURNS, np.uint8) if optics is None else optics)
        self.n_vertices += len(vertices)

    def joined(self) -> tuple[FloatArray, Int64Array, Int64Array, Int64Array]:
        """Vertices, triangles, owner and face number of each triangle."""
        none = np.zeros(0, dtype=np.int64)
        return (
            np.concatenate([np.zeros((0, 3)), *self.vertices]),
            np.concatenate([none.reshape(0, 3), *self.triangles]),
            np.concatenate([none, *self.owner]),
            np.concatenate([none, *self.face]),
        )

    def joined_optics(self) -> UInt8Array | None:
        """What each triangle does to a beam, in the order of `joined`; None where all return it."""
        if not any(part.any() for part in self.optics):
            return None
        return np.concatenate(self.optics)


_UNIT_NAMES = {
    1.0: "metre",
    0.001: "millimetre",
    0.01: "centimetre",
    0.1: "decimetre",
    1000.0: "kilometre",
    0.0254: "inch",
    0.3048: "foot",
    0.9144: "yard",
    1200.0 / 3937.0: "US survey foot",
}


def unit_name(metres_per_unit: float) -> str:
    """What a unit is called; its length where it has no name."""
    named = (name for unit, name in _UNIT_NAMES.items() if math.isclose(unit, metres_per_unit, rel_tol=1e-9))
    return next(named, f"{metres_per_unit:g} m")


# ---------------------------------------------------------------------------------------- wrong contents
_KNOWN_STARTS: tuple[tuple[bytes, str], ...] = (
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"\x89PNG", "a PNG picture"),
    (b"%PDF", "a PDF document"),
    (b"PK\x03\x04", "a ZIP archive (unpack it first)"),
    (b"\x1f\x8b", "a gzip archive (unpack it first)"),
    (b"ISO-10303-21", "a STEP or IFC file"),
    (b"glTF", "a binary glTF file (.glb)"),
    (b"ply", "a PLY file"),
    (b"solid", "an ASCII STL file"),
    (b"PXR-USDC", "a binary USD file (.usdc)"),
    (b"#usda", "a USD text file (.usda)"),
    (b"<?xml", "an XML file"),
    (b"<", "an XML or HTML file"),
    (b"{", "a JSON file"),
    (b"Kaydara FBX", "an FBX file"),
    (b"AC10", "a DWG drawing"),
)


def what_it_looks_like(start: bytes) -> str:
    """A phrase for an error: what the first bytes of a file say it is."""
    if not start.strip():
        return "it is empty" if not start else "it holds only blanks"
    for magic, title in _KNOWN_STARTS:
        if start.startswith(magic):
            return f"it begins like {title}"
    if all(32 <= byte < 127 or byte in b"\t\r\n" for byte in start[:64]):
        text = " ".join(start[:24].decode("ascii").split())
        return f"it begins with the text {text!r}"
    return "it begins with bytes of an unknown kind"

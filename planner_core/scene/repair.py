"""Repair of a scene: which triangles stay in, and why the others do not.

Steps 1, 3, 5 and 6 of `planner_core.scene.build`. Input: raw triangles and, step by step, the vertices in metres,
scene frame and then local. Output: `Repair.keep`, the triangles that stay; no array shrinks, no order changes.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from planner_core.errors import SceneError, grouped
from planner_core.model import BoolArray, Element, FloatArray, Int32Array, Int64Array
from planner_core.model.arrays import dots, lengths
from planner_core.model.values import MAX_COORDINATE_M
from planner_core.scene.array_rows import first_of_equal_rows, first_of_equal_triples
from planner_core.scene.extent import STRAY_DISTANCE_M, face_weights, is_astray, named_few

MIN_FACE_HEIGHT_M = 1e-8
"""Smallest height of a face above its longest edge.

National grids have coordinates of up to 1e7 m, which float64 rounds by 1e-9 m and a change of unit once more, so the
height of a line comes out as up to 4e-9 m: anything below 1e-8 m is a line that was meant to be one. Slivers above it
are kept: dropping those would open cracks. A scanner resolves 1e-4 m at best. It gets models of a micrometre wrong.
"""

MAX_DROPPED_LINES = 100
"""Length of `LoadReport.dropped`."""


@dataclass(frozen=True)
class RawArrays:
    """The caller's arrays, shapes and types checked.

    vertices : (V, 3), source frame. triangles : (T, 3) into them. element : (T,) into `elements`. face : (T,) numbers
    of the source's faces.
    """

    vertices: FloatArray
    triangles: Int64Array
    element: Int32Array
    elements: tuple[Element, ...]
    face: Int64Array


@dataclass
class Repair:
    """Which triangles are still in, and why the others are not."""

    raw: RawArrays
    name: str
    corners: Int64Array = field(init=False)
    """(T, 3) vertices of each triangle; after `weld`, of the first vertex at each place."""
    keep: BoolArray = field(init=False)
    counts: dict[str, int] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    n_unlisted: int = 0

    def __post_init__(self) -> None:
        self.corners = self.raw.triangles
        self.keep = np.ones(self.corners.shape[0], dtype=bool)

    def kept_triangles(self) -> Int64Array:
        """(K, 3) the triangles that are still in."""
        return self.corners[self.keep]

    def drop_bad_indices(self, *, skip: bool) -> None:
        """Refuse or drop triangles that name a vertex which does not exist."""
        n_vertices = self.raw.vertices.shape[0]
        bad = ((self.corners < 0) | (self.corners >= n_vertices)).any(axis=1)
        if not bad.any():
            self.counts["bad_index"] = 0
            return
        if not skip:
            named = self.corners[bad].ravel()
            worst = int(named[(named < 0) | (named >= n_vertices)][0])
            raise bad_index_error(self.name, int(bad.sum()), bad.size, worst, n_vertices, first_number=0, owner="scene")
        self.corners = np.where(bad[:, None], 0, self.corners)  # any valid number: these are never read again
        self._drop("bad_index", bad, "names a vertex that does not exist")

    def drop_non_finite(self, vertices_m: FloatArray) -> None:
        """Drop triangles with a NaN, infinite or impossible coordinate."""
        bad_value = ~(np.abs(vertices_m) <= MAX_COORDINATE_M)
        if not bad_value.any():
            self.counts["non_finite"] = 0
            return
        bad_vertex: BoolArray = bad_value[:, 0] | bad_value[:, 1] | bad_value[:, 2]
        self._drop(
            "non_finite", self.keep & bad_vertex[self.corners].any(axis=1), "has a coordinate that is not finite"
        )

    def drop_strays(self, vertices_m: FloatArray) -> None:
        """Drop triangles kilometres away from nearly all others, and warn of them by name."""
        self.counts["stray"] = 0
        kept = self.kept_triangles()
        if not kept.size:
            return
        low, high = box_of(vertices_m, kept)
        if (high - low).max() <= STRAY_DISTANCE_M:
            return
        corners_m = vertices_m[kept]
        astray = np.zeros(self.keep.size, dtype=bool)
        astray[np.flatnonzero(self.keep)] = is_astray(corners_m, face_weights(corners_m))
        if not astray.any():
            return
        n = self._drop("stray", astray, f"lies more than {STRAY_DISTANCE_M / 1000:.0f} km away from the rest")
        names = [self.raw.elements[i].name for i in self.raw.element[astray].tolist()]
        self.warnings.append(
            f"{self.name}: {grouped(n)} {'face lies' if n == 1 else 'faces lie'} more than "
            f"{STRAY_DISTANCE_M / 1000:.0f} km away from the rest and {'is' if n == 1 else 'are'} left out: "
            f"{named_few(names)}."
        )

    def weld(self, vertices_m: FloatArray) -> None:
        """Let triangles name the first vertex at each place."""
        if vertices_m.shape[0]:  # without vertices the corners are all dropped, and name nothing
            self.corners = first_of_equal_rows(vertices_m)[self.corners]

    def drop_degenerate(self, vertices_m: FloatArray) -> None:
        """Drop triangles that are points or lines."""
        a, b, c = self.corners.T
        repeated = (a == b) | (b == c) | (c == a)
        n_before = self._drop("degenerate", self.keep & repeated, "has two corners in one place")
        alive = np.flatnonzero(self.keep)
        flat = np.zeros(self.keep.size, dtype=bool)
        flat[alive] = face_height_m(vertices_m[self.corners[alive]]) < MIN_FACE_HEIGHT_M
        self.counts["degenerate"] = n_before + self._drop("degenerate", flat, "is a line: its corners lie on it")

    def drop_duplicates(self) -> tuple[Int64Array, Int64Array]:
        """Drop triangles that have the same three corners as an earlier one, however they turn; return both."""
        alive = np.flatnonzero(self.keep)
        first = first_of_equal_triples(np.sort(self.corners[alive], axis=1))
        repeat = np.zeros(self.keep.size, dtype=bool)
        repeat[alive] = first != np.arange(alive.size)
        original = np.zeros(self.keep.size, dtype=np.int64)
        original[alive] = alive[first]
        self._drop("duplicate", repeat, "is the same as face", original)
        copies = np.flatnonzero(repeat)
        return copies, original[copies]

    def _drop(self, reason: str, bad: BoolArray, text: str, original: Int64Array | None = None) -> int:
        """Take the `bad` ones out, count and list them. Returns how many."""
        numbers = np.flatnonzero(bad)
        self.counts[reason] = numbers.size
        self.keep = self.keep & ~bad
        room = max(MAX_DROPPED_LINES - len(self.lines), 0)
        for number in numbers[:room]:
            element = self.raw.elements[self.raw.element[number]]
            line = f"{element.name}, face {int(self.raw.face[number])}: {text}"
            self.lines.append(line if original is None else line + self._original(number, int(original[number])))
        self.n_unlisted += max(numbers.size - room, 0)
        return int(numbers.size)

    def _original(self, number: int, original: int) -> str:
        """Which face the triangle `number` repeats, and of which element where that is another."""
        owner = self.raw.element[original]
        face = f" {int(self.raw.face[original])}"
        return face if owner == self.raw.element[number] else f"{face} of {self.raw.elements[owner].name}"


def box_of(vertices_m: FloatArray, triangles: Int64Array) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest corner of what triangles use."""
    used = np.zeros(vertices_m.shape[0], dtype=bool)
    used[triangles.ravel()] = True
    corners = vertices_m[used]
    return corners.min(axis=0), corners.max(axis=0)


def face_height_m(corners_m: FloatArray) -> FloatArray:
    """(N,) float64: height of each triangle (N, 3, 3) above its longest edge; 0 for a point."""
    ab, bc, ca = (corners_m[:, (i + 1) % 3] - corners_m[:, i] for i in range(3))
    longest = np.sqrt(np.maximum.reduce([dots(e, e) for e in (ab, bc, ca)]))
    normal = np.cross(ab, -ca)
    twice_area = lengths(normal)
    height: FloatArray = np.divide(twice_area, longest, out=np.zeros_like(longest), where=longest > 0)
    return height


def bad_index_error(
    name: str, n_bad: int, n_faces: int, vertex_number: int, n_vertices: int, *, first_number: int, owner: str
) -> SceneError:
    """The one wording for faces that name a missing vertex.

    `first_number`: how the format numbers its first vertex. `owner`: what has the vertices, a file or a mesh.
    """
    last = n_vertices - 1 + first_number
    has = f"the {owner} has {grouped(n_vertices)}" + ("" if first_number else f", the last is {grouped(last)}")
    verb = "names" if n_bad == 1 else "name"
    return SceneError(
        f"{name}: {grouped(n_bad)} of {grouped(n_faces)} faces {verb} vertex {grouped(vertex_number)}, {has}. "
        "Repair it or pass --skip-bad-faces."
    )

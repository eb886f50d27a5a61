"""The scene: raw triangles of any source become the one `Scene` that every later stage reads.

Input: vertices in the source's unit and axes, triangles that index them. Output: `planner_core.model.Scene`, local
frame, float64, metres, z up.

Numbered steps of `scene_from_arrays`:

1. faces that name a missing vertex: an error, or dropped and counted with `skip_bad_faces`;
2. source frame -> scene frame (unit, y up);
3. faces with a coordinate that is not finite, or no place on Earth, and few faces kilometres away from all others
   (`planner_core.scene.extent`), are dropped;
4. scene frame -> local frame (only when the scene lies far from its origin);
5. bit-identical vertices become one (so that neighbours share edges exactly and no beam slips between them);
6. faces without area, and faces that repeat an earlier one, are dropped;
7. vertices that no face uses are left out.

The order of faces never changes. Vertices are numbered by their first use.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from planner_core.errors import SceneError, grouped, one_line, readable
from planner_core.model import (
    Element,
    FloatArray,
    Int32Array,
    Int64Array,
    LoadReport,
    Optics,
    Scene,
    SceneSource,
    Storey,
    UInt8Array,
)
from planner_core.scene.extent import bulk_centre_m, face_weights
from planner_core.scene.repair import MAX_DROPPED_LINES, RawArrays, Repair, box_of

FAR_ORIGIN_M = 1000.0
"""Farthest that the centre of a scene may lie from the origin, on each axis, before it is moved.

Kernels work in float32. Up to 1024 m its rounding error is at most 2^-15 m = 0.03 mm, up to 2048 m 0.06 mm: well below
a scanner's noise. At E 500 000 m it would be 16 mm.
"""


def scene_from_arrays(
    vertices: ArrayLike,
    triangles: ArrayLike,
    *,
    element_of_triangle: ArrayLike | None = None,
    elements: Sequence[Element] | None = None,
    storeys: Sequence[Storey] = (),
    source: SceneSource | None = None,
    metres_per_unit: float = 1.0,
    up_axis: str = "Z",
    face_of_triangle: ArrayLike | None = None,
    optics_of_triangle: ArrayLike | None = None,
    skip_bad_faces: bool = False,
    prior: LoadReport | None = None,
) -> Scene:
    """Weld, repair and place raw triangles.

    Parameters
    ----------
    vertices : (V, 3) floats, source frame.
    triangles : (T, 3) integers into `vertices`, counter-clockwise seen from outside.
    element_of_triangle : (T,) integers into `elements`; None: all are of the first (or only) element.
    elements : what the triangles are parts of; None: one element called `mesh`.
    storeys : elevations in metres, scene frame, any order; `Element.storey` indexes this sequence.
    source : kept for the record and named in errors; None: a scene made in memory.
    metres_per_unit, up_axis : unit and upward axis (`Y` or `Z`) of `vertices`.
    face_of_triangle : (T,) numbers of the source's faces, for messages; None: the triangles' own numbers.
    optics_of_triangle : (T,) integers of `Optics`; None: all return.
    skip_bad_faces : drop faces that name a vertex which does not exist, instead of refusing them.
    prior : what the reader itself already dropped and has to say; it is added to the scene's report.

    Raises
    ------
    SceneError
        Arrays of the wrong shape, bad indices, or nothing left after the repair.

    Notes
    -----
    Same arrays, same scene, bit by bit: no step depends on threads, hashes' seeds or libraries' matrix products.
    """
    raw = _checked_arrays(vertices, triangles, element_of_triangle, elements, face_of_triangle)
    optics = _checked_optics(optics_of_triangle, raw.triangles.shape[0])
    source = source or _memory_source(raw)
    _check_frame(metres_per_unit, up_axis)
    repair = Repair(raw, name=source.path.name or "scene")
    repair.drop_bad_indices(skip=skip_bad_faces)
    scene_vertices_m = to_scene_frame(raw.vertices, metres_per_unit, up_axis)
    repair.drop_non_finite(scene_vertices_m)
    repair.drop_strays(scene_vertices_m)
    offset_m = _offset(scene_vertices_m, repair.kept_triangles())
    local_m = scene_vertices_m - offset_m + 0.0  # + 0.0 turns -0.0 into 0.0: both are one place, with two bit patterns
    repair.weld(local_m)
    repair.drop_degenerate(local_m)
    copies, kept = repair.drop_duplicates()
    if optics is not None:
        optics = _seen_through_panes(optics, copies, kept)
    scene = _assemble(repair, local_m, offset_m, source, tuple(storeys), prior or LoadReport(n_faces_read=0))
    return scene if optics is None else replace(scene, optics_of_triangle=optics[repair.keep])


# ------------------------------------------------------------------------------------------------ input


def _checked_arrays(
    vertices: ArrayLike,
    triangles: ArrayLike,
    element_of_triangle: ArrayLike | None,
    elements: Sequence[Element] | None,
    face_of_triangle: ArrayLike | None,
) -> RawArrays:
    points = np.ascontiguousarray(vertices, dtype=np.float64)
    faces = np.asarray(triangles)
    if points.size == 0:
        points = points.reshape(0, 3)
    if faces.size == 0:
        faces = np.zeros((0, 3), dtype=np.int64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise SceneError(f"vertices have the shape {points.shape}, expected (V, 3); pass x, y, z in each row.")
    if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
        raise SceneError(
            f"triangles have the shape {faces.shape} and type {faces.dtype}, expected (T, 3) integers; "
            "pass three vertex numbers in each row."
        )
    n_triangles = faces.shape[0]
    owners = tuple(map(_readable_element, elements)) if elements is not None else (Element("mesh", "Mesh", "0"),)
    element = _column(element_of_triangle, n_triangles, "element_of_triangle", np.zeros(n_triangles, dtype=np.int64))
    if n_triangles and (element.min() < 0 or element.max() >= len(owners)):
        raise SceneError(
            f"element_of_triangle goes from {element.min()} to {element.max()}, expected 0 to {len(owners) - 1}; "
            "pass indices into elements."
        )
    face = _column(face_of_triangle, n_triangles, "face_of_triangle", np.arange(n_triangles, dtype=np.int64))
    return RawArrays(points, np.ascontiguousarray(faces, dtype=np.int64), element.astype(np.int32), owners, face)


def _column(values: ArrayLike | None, length: int, name: str, default: Int64Array) -> Int64Array:
    if values is None:
        return default
    column = np.asarray(values)
    if column.shape != (length,):
        raise SceneError(f"{name} has the shape {column.shape}, expected ({length},); pass one number per triangle.")
    return column.astype(np.int64)


def _checked_optics(optics_of_triangle: ArrayLike | None, n_triangles: int) -> UInt8Array | None:
    """(T,) uint8; None where all surfaces return."""
    optics = _column(optics_of_triangle, n_triangles, "optics_of_triangle", np.zeros(n_triangles, dtype=np.int64))
    if n_triangles and (optics.min() < 0 or optics.max() > max(Optics)):
        raise SceneError(
            f"optics_of_triangle goes from {optics.min()} to {optics.max()}, expected 0 to {max(Optics):d}; "
            "pass values of planner_core.model.Optics."
        )
    return optics.astype(np.uint8) if optics.any() else None


def _seen_through_panes(optics: UInt8Array, copies: Int64Array, kept: Int64Array) -> UInt8Array:
    """Let the first that is no glass count, of triangles in one place: a beam goes through the pane to it."""
    counts = ((optics[copies] != Optics.PASSES) & (optics[kept] == Optics.PASSES)).nonzero()[0][::-1]
    seen = optics.copy()
    seen[kept[counts]] = optics[copies[counts]]  # of several copies the first is written last
    return seen


def _readable_element(element: Element) -> Element:
    texts = (element.name, element.kind, element.source_id)
    if all(text.isascii() for text in texts):  # nearly all elements of nearly all files
        return element
    name, kind, source_id = map(readable, texts)
    return replace(element, name=name, kind=kind, source_id=source_id)


def _check_frame(metres_per_unit: float, up_axis: str) -> None:
    if not (np.isfinite(metres_per_unit) and metres_per_unit > 0):
        raise SceneError(f"metres per unit is {metres_per_unit}, expected a number above 0; 0.001 is a millimetre.")
    if up_axis not in ("Y", "Z"):
        raise SceneError(f"the upward axis is {up_axis!r}, expected Y or Z; pass one of them.")


def _memory_source(raw: RawArrays) -> SceneSource:
    digest = hashlib.sha256(raw.vertices.data)
    digest.update(raw.triangles.data)
    return SceneSource(Path(), digest.hexdigest(), "memory", "metre", 1.0, "Z")


# ----------------------------------------------------------------------------------------------- frames
def to_scene_frame(vertices: FloatArray, metres_per_unit: float, up_axis: str) -> FloatArray:
    """(V, 3) float64, metres, z up. Y up is turned by 90 degrees about x, which keeps the winding."""
    if up_axis == "Y":
        vertices = np.stack([vertices[:, 0], -vertices[:, 2], vertices[:, 1]], axis=1)
    if metres_per_unit == 1.0:
        return vertices
    with np.errstate(over="ignore"):  # what overflows is dropped in the next step
        return vertices * metres_per_unit


def _offset(vertices_m: FloatArray, triangles: Int64Array) -> FloatArray:
    """(3,) float64: whole metres on the axes where the scene's centre lies far from the origin, zero on the others.

    The centre is that of the scene's box; of its bulk where the box is so long that its middle may lie elsewhere.
    """
    if triangles.size == 0:
        return np.zeros(3)
    low, high = box_of(vertices_m, triangles)
    centre = 0.5 * (low + high)
    if (high - low).max() > FAR_ORIGIN_M:
        corners_m = vertices_m[triangles]
        centre = bulk_centre_m(corners_m, face_weights(corners_m))
    return np.where(np.abs(centre) > FAR_ORIGIN_M, np.round(centre), 0.0) + 0.0


# --------------------------------------------------------------------------------------------- assembly
def _assemble(
    repair: Repair,
    local_m: FloatArray,
    offset_m: FloatArray,
    source: SceneSource,
    storeys: tuple[Storey, ...],
    prior: LoadReport,
) -> Scene:
    report = _report(repair, offset_m, prior)
    kept = repair.kept_triangles()
    if kept.shape[0] == 0:
        raise SceneError(_nothing_left(repair.name, report))
    vertex_numbers, triangles = _numbered_by_first_use(kept)
    storeys, elements = _sorted_storeys(storeys, repair.raw.elements, float(offset_m[2]))
    return Scene(
        source=source,
        vertices_m=np.ascontiguousarray(local_m[vertex_numbers]),
        triangles=triangles,
        element_of_triangle=np.ascontiguousarray(repair.raw.element[repair.keep]),
        elements=elements,
        storeys=storeys,
        offset_m=offset_m,
        report=report,
    )


def _numbered_by_first_use(corners: Int64Array) -> tuple[Int64Array, Int32Array]:
    """Vertices in the order in which triangles first name them, and the triangles in the new numbers."""
    flat = corners.ravel()
    first_use = np.full(int(flat.max()) + 1, flat.size, dtype=np.int64)
    first_use[flat[::-1]] = np.arange(flat.size - 1, -1, -1)  # of repeated targets the last written, i.e. first use
    used = flat[np.sort(first_use[first_use < flat.size])]
    new_number = np.empty(first_use.size, dtype=np.int32)
    new_number[used] = np.arange(used.size, dtype=np.int32)
    return used, np.ascontiguousarray(new_number[corners])


def _sorted_storeys(
    storeys: tuple[Storey, ...], elements: tuple[Element, ...], offset_z_m: float
) -> tuple[tuple[Storey, ...], tuple[Element, ...]]:
    """Storeys lowest first and local, elements pointing at their new places."""
    for element in elements:
        if not -1 <= element.storey < len(storeys):
            raise SceneError(
                f"element {element.name!r} is on storey {element.storey}, expected -1 to {len(storeys) - 1}; "
                "pass an index into storeys."
            )
    order = sorted(range(len(storeys)), key=lambda i: (storeys[i].elevation_m, i))
    place = {old: new for new, old in enumerate(order)} | {-1: -1}
    local = tuple(
        Storey(readable(s.name), readable(s.source_id), s.elevation_m - offset_z_m) for s in (storeys[i] for i in order)
    )
    return local, tuple(replace(e, storey=place[e.storey]) if e.storey != -1 else e for e in elements)


def _report(repair: Repair, offset_m: FloatArray, prior: LoadReport) -> LoadReport:
    lines = [one_line(line) for line in (*prior.dropped, *repair.lines)]
    unlisted = repair.n_unlisted + max(len(lines) - MAX_DROPPED_LINES, 0)
    if unlisted:
        lines = [*lines[: MAX_DROPPED_LINES - 1], ""]
        unlisted += 1
        lines[-1] = f"... and {grouped(unlisted)} more"
    warnings = [one_line(warning) for warning in (*prior.warnings, *repair.warnings)]
    warnings += far_origin(repair.name, offset_m)
    return LoadReport(
        n_faces_read=prior.n_faces_read + repair.keep.size,
        n_non_finite=prior.n_non_finite + repair.counts["non_finite"],
        n_degenerate=prior.n_degenerate + repair.counts["degenerate"],
        n_duplicate=prior.n_duplicate + repair.counts["duplicate"],
        n_bad_index=prior.n_bad_index + repair.counts["bad_index"],
        n_stray=prior.n_stray + repair.counts["stray"],
        dropped=tuple(lines),
        warnings=tuple(warnings),
    )


def far_origin(name: str, offset_m: FloatArray) -> list[str]:
    """A line for the user where the scene is moved to be worked on; none where it is not."""
    if not offset_m.any():
        return []
    x, y, z = (grouped(int(v)) for v in offset_m)
    return [
        f"{name} lies far from its origin: it is worked on around x {x}, y {y}, z {z} m; coordinates that are written "
        "out are the file's own."
    ]


def _nothing_left(name: str, report: LoadReport) -> str:
    if report.n_faces_read == 0:
        return f"{name}: it has no faces, expected a surface mesh; export the model's surfaces (not points or lines)."
    return (
        f"{name}: none of its {grouped(report.n_faces_read)} faces can be used "
        f"({grouped(report.n_non_finite)} not finite, {grouped(report.n_degenerate)} without area, "
        f"{grouped(report.n_duplicate)} repeated, {grouped(report.n_bad_index)} with missing vertices), "
        "expected at least one; repair the model and export it again."
    )

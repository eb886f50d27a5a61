"""Shapes of IFC products, made by IfcOpenShell: triangles in metres, in the file's own frame.

IfcOpenShell gives each shape in its own frame, with a float64 placement in metres. We place the vertices ourselves, in
float64: far site placements lose nothing, and equal local vertices stay equal bit by bit.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from traceback import walk_tb
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner_core import child_process
from planner_core.errors import SceneError, reason_of
from planner_core.model import FloatArray, Int64Array, UInt8Array
from planner_core.model.arrays import lengths
from planner_core.scene.ifc_materials import IfcOptics
from planner_core.scene.raw import placed, turned_over

SHAPES = "the shapes of its elements"
"""What a child process is at while IfcOpenShell's threads make shapes: it logs the ids of those that are made."""
_ITS_WAYS_TO_FAIL = (
    RuntimeError, AttributeError, TypeError, ValueError, IndexError, KeyError, AssertionError, SystemError
)  # fmt: skip
_LACKS = re.compile(r"entity instance of type '(?:\w+\.)?(\w+)' has no attribute '(\w+)'")
"""IfcOpenShell's words where a wrong class of entity is named."""
_CLOSED_SHARE = 1e-6
"""Share of its area by which the faces of a closed shape may fail to add up: OpenCASCADE rounds corners to 1e-7."""

SOLID_KERNEL, FACES_KERNEL = "opencascade", "cgal-simple"
"""IfcOpenShell's kernels. The first makes a topological face of every triangle, at twenty times the cost of the second;
the second refuses polygons that touch themselves and subtracts no openings."""


@dataclass(frozen=True)
class Shape:
    """One of a product's shapes. vertices : (V, 3) metres. optics : (T,), None where all faces return."""

    vertices: FloatArray
    triangles: Int64Array
    optics: UInt8Array | None

    @property
    def key(self) -> tuple[bytes, bytes, bytes]:
        """What shapes are ordered by."""
        return self.vertices.tobytes(), self.triangles.tobytes(), b"" if self.optics is None else self.optics.tobytes()


@contextmanager
def entities_read(path: Path, model: Any) -> Iterator[None]:
    """Around code that does nothing but ask IfcOpenShell: its ways to fail become faults of the file.

    Entities of wrong types in a file have the wrong attributes, and IfcOpenShell then raises whatever happens. What we
    do with the answers stays outside, so that our own bugs are not taken for faults of the file.
    """
    try:
        yield
    except SceneError:
        raise
    except _ITS_WAYS_TO_FAIL as error:
        raise SceneError(
            f"{path.name}: its contents do not follow {model.schema_identifier}: {_fault_in_words(error)}; correct it, "
            "or check the file with an IFC validator and export it again."
        ) from error


def _entity_read(error: Exception) -> Any:
    """The entity that the code which failed was reading, the innermost that it held; None: none."""
    from ifcopenshell import entity_instance

    for frame, _ in reversed(list(walk_tb(error.__traceback__))):
        for value in reversed(list(frame.f_locals.values())):
            if isinstance(value, entity_instance) and value.id():
                return value
    return None


def _gap_of(entity: Any) -> tuple[Any, str] | None:
    """An attribute that its schema requires and that is empty, of an entity or of one that it names; None: none."""
    import ifcopenshell

    for each in (entity, *(value for value in entity if isinstance(value, ifcopenshell.entity_instance))):
        schema, _, kind = str(each.is_a(True)).rpartition(".")
        declared = ifcopenshell.schema_by_name(schema).declaration_by_name(kind).as_entity()
        if declared is None:  # a value of a type, such as a length
            continue
        attributes = zip(declared.all_attributes(), declared.derived(), strict=True)
        for index, (attribute, is_derived) in enumerate(attributes):
            if not (is_derived or attribute.optional()) and each[index] is None:
                return each, str(attribute.name())
    return None


def _fault_in_words(error: Exception) -> str:
    """Which entity is wrong, and how: Python's sentences on types of values say nothing to who has to repair a file."""
    reason = reason_of(error)
    entity = _entity_read(error)
    named = "one of its instances" if entity is None else f"#{entity.id()} ({entity.is_a()})"
    if lacking := _LACKS.search(reason):
        return f"{named} is named where its schema has another class (one with {lacking.group(2)})"
    if "NoneType" in reason or "None" in str(error).split():
        gap = None if entity is None else _gap_of(entity)
        if gap is None:
            return f"{named} lacks an attribute that its schema requires, or names an instance that does"
        return f"#{gap[0].id()} ({gap[0].is_a()}) lacks {gap[1]}, which its schema requires"
    if isinstance(error, RuntimeError | SystemError):
        return f"{named} can't be read ({reason})"
    return f"{named} has an attribute of another type or length than its schema"


def shapes_by(
    kernel: str, path: Path, model: Any, entities: list[Any], optics: IfcOptics | None
) -> Iterator[tuple[int, Shape]]:
    """Product id and shape of IfcProducts, by one of IfcOpenShell's kernels, in the order in which threads finish."""
    if not entities:  # IfcOpenShell takes an empty list for all there are
        return
    from ifcopenshell import geom

    settings = geom.settings()
    settings.set("no-normals", True)
    settings.set("apply-default-materials", False)
    with entities_read(path, model):
        # Threads of the second kernel spend their time waiting for each other.
        n_threads = 1 if kernel == FACES_KERNEL else os.cpu_count() or 1
        iterator = geom.iterator(settings, model, n_threads, include=entities, geometry_library=kernel)
        more = iterator.initialize()
    while more:
        with entities_read(path, model):
            shape = iterator.get()
        vertices = np.frombuffer(shape.geometry.verts_buffer, dtype=np.float64).reshape(-1, 3)
        triangles = np.frombuffer(shape.geometry.faces_buffer, dtype=np.int32).reshape(-1, 3).astype(np.int64)
        matrix = np.frombuffer(shape.transformation_buffer, dtype=np.float64).reshape(4, 4).T  # columns first
        items = np.frombuffer(shape.geometry.item_ids_buffer, dtype=np.int32)
        child_process.log(int(shape.id))
        of_faces = None if optics is None else optics.of_faces(int(shape.id), shape.geometry)
        yield int(shape.id), Shape(placed(vertices, matrix), _outside_out(vertices, triangles, items), of_faces)
        with entities_read(path, model):
            more = iterator.next()


def _outside_out(vertices: FloatArray, triangles: Int64Array, items: NDArray[np.int32]) -> Int64Array:
    """(T, 3) `triangles`, those of closed items that are inside out turned over.

    IfcOpenShell 0.9 keeps the winding of a shape that an instance mirrors. An item counts as closed when its faces'
    area vectors add up to nothing; it is inside out when its volume is negative.
    """
    if len(triangles) == 0 or len(items) != len(triangles):
        return triangles
    corners = vertices[triangles] - vertices[triangles[0, 0]]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(b - a, c - a)
    item = np.unique(items, return_inverse=True)[1]
    area = np.bincount(item, weights=lengths(normal))
    left_over = np.stack([np.bincount(item, weights=normal[:, axis]) for axis in range(3)], axis=1)
    is_closed = np.abs(left_over).max(axis=1) <= _CLOSED_SHARE * area
    is_inside_out = is_closed & (np.bincount(item, weights=(np.cross(a, b) * c).sum(axis=1)) < 0)
    return np.where(is_inside_out[item][:, None], turned_over(triangles), triangles)

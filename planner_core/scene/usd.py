"""USD (.usd, .usda, .usdc, .usdz) -> `RawScene`: meshes and basic shapes of the composed stage, by prim path.

Sublayers, references and payloads are loaded; instances and point instancers give one element an instance. What is
invisible, or meant as a guide or proxy, is left out. A mesh is taken as its control cage, at its earliest time. Unit
and upward axis are the stage's (metersPerUnit, upAxis). Source: the reference of usd-core 26.11.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from planner_core import child_process
from planner_core.errors import MissingPackageError, SceneError, grouped, is_text, shortened
from planner_core.model import Element, FloatArray, Int64Array, LoadReport
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.scene.extent import named_few
from planner_core.scene.raw import (
    Faces,
    MeshParts,
    RawScene,
    chained,
    exact,
    is_mirrored,
    placed,
    triangulate,
    turned_over,
    unit_name,
    what_it_looks_like,
)
from planner_core.scene.repair import MAX_DROPPED_LINES
from planner_core.scene.usd_materials import UsdOptics
from planner_core.scene.usd_shapes import is_shape, shape_of

_ADDRESS = re.compile("^([a-z][a-z0-9+.-]+):/(?!/)")
_NOT_OPENED = re.compile(r"[Cc]ould not (?:open|load)[^@]*@([^@]+)@")
"""How the library names a layer that is not there."""
_HIDDEN_PURPOSES = ("guide", "proxy")
MOST_DEEP = 1000
"""Prims inside each other."""
MOST_PRIMS = 2_000_000
"""Scatterings inside each other may have any number; a tower modelled to its last fitting has some hundred thousand."""
_MAX_STAGE_WARNINGS = 5
_MAX_INSTANCER_DEPTH = 8
"""Point instancers inside each other: deeper than any real scene; stops one that contains itself."""


@dataclass(frozen=True)
class _Mesh:
    vertices: FloatArray
    faces: Faces
    face: Int64Array
    """(T,) number of the polygon that each triangle is of, counting holes."""


@dataclass
class _Gathered:
    """What the walk over the stage has found so far."""

    name: str
    skip_bad_faces: bool
    metres_per_unit: float
    parts: MeshParts = field(default_factory=MeshParts)
    elements: list[Element] = field(default_factory=list)
    meshes: dict[tuple[str, float], _Mesh] = field(default_factory=dict)
    """By path in the prototype, so that an instanced mesh is read once; of shapes also by the metres of their unit."""
    optics: UsdOptics = field(default_factory=UsdOptics)
    left_out: Counter[str] = field(default_factory=Counter)
    """Shapes that are not read, by type."""
    n_prims: int = 0
    """Of the stage, those in instances as often as these are placed."""
    n_bad_index: int = 0
    n_too_short: int = 0
    dropped: list[str] = field(default_factory=list)


def read_usd(path: Path, *, skip_bad_faces: bool, progress: Progress = silent) -> RawScene:
    """Read a USD stage.

    Raises
    ------
    SceneError
        Not a USD file, cut off, or a mesh whose faces name missing vertices.
    MissingPackageError
        usd-core is not installed.
    """
    try:
        from pxr import Tf, Usd, UsdGeom, UsdUtils
    except ImportError as error:
        raise MissingPackageError(
            f"{path.name}: reading USD needs the package usd-core, which is missing; run pip install usd-core."
        ) from error
    messages = UsdUtils.CoalescingDiagnosticDelegate()  # keeps the library's warnings off stderr, for our report
    try:
        stage = _open(path)
        gathered = _Gathered(path.name, skip_bad_faces, float(UsdGeom.GetStageMetersPerUnit(stage)))
        cache = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
        for prim, matrix, label in _walk(stage.GetPseudoRoot(), np.eye(4), cache, "", gathered, 0):
            _add_mesh(gathered, prim, matrix, label)
            progress(ProgressEvent("load", len(gathered.elements), 0, f"{grouped(len(gathered.elements))} meshes"))
        comments = [d.commentary for d in messages.TakeUncoalescedDiagnostics()]
        missing, comments = _missing_files(path, comments)
        raw = _raw_scene(path, stage, gathered, comments)
    except (Tf.ErrorException, UnicodeDecodeError) as error:  # what only the library raises, the latter for its texts
        with path.open("rb") as file:
            looks = what_it_looks_like(file.read(64))
        raise SceneError(
            f"{path.name}: not a readable USD file ({_first_reason(error)}): {looks}; export the model again."
        ) from error
    if not missing:
        return raw
    line = _missing_line(path, missing)
    if not raw.triangles.size:
        raise SceneError(f"{line}; it has no faces without them.")
    return replace(raw, report=replace(raw.report, warnings=(*raw.report.warnings, f"{line}.")))


def _missing_files(path: Path, messages: list[str]) -> tuple[list[str], list[str]]:
    """Files that parts of the stage are in and that the library could not open; and what else it has to say."""
    missing: dict[str, None] = {}
    others = []
    for text in messages:
        named = _NOT_OPENED.search(text)
        if named:
            name = named.group(1).removeprefix(f"{path.resolve().parent}/").removeprefix(f"{path.parent}/")
            missing[_ADDRESS.sub(r"\1://", name)] = None  # USD shortens addresses as if they were paths
        else:
            others.append(text)
    return list(missing), others


def _missing_line(path: Path, missing: list[str]) -> str:
    noun = "a file that holds parts of it" if len(missing) == 1 else f"{grouped(len(missing))} files that hold parts"
    return (
        f"{path.name}: {noun} could not be opened: {shortened(named_few(missing))}; put them where it names them, or "
        "export the stage with all parts in one file, as usdcat --flatten does"
    )


def _open(path: Path) -> Any:
    from pxr import Usd

    if not is_text(str(path)):
        raise SceneError(
            f"{path.name}: its name or that of its folder is not UTF-8, which the USD library needs; rename it."
        )
    child_process.at("its layers")
    stage = Usd.Stage.Open(str(path), Usd.Stage.LoadAll)
    stage.Reload()  # a layer that this process opened before is kept in memory, and may have changed on disk
    return stage


def _first_reason(error: Exception) -> str:
    """The first message in a Tf error, without the source lines it names."""
    try:
        text = str(error)
    except UnicodeDecodeError:  # a Tf error may quote the file's bytes as they are
        return "it holds bytes that are not text"
    quoted = text.partition(" : '")[2].partition("'\n")[0] or text
    return shortened(quoted.rstrip("'"))


# ------------------------------------------------------------------------------------------------- walk
def _walk(
    top: Any, world_from_top: FloatArray, cache: Any, label: str, gathered: _Gathered, depth: int
) -> Iterator[tuple[Any, FloatArray, str]]:
    """Visible meshes and shapes at and below `top`, with their placement (4x4, column vectors, float64) and name.

    `world_from_top` replaces whatever is above `top` and, for the prototype of an instancer, its own transform.
    """
    from pxr import Usd, UsdGeom

    top_inverse = cache.GetLocalToWorldTransform(top).GetInverse()
    prims = iter(Usd.PrimRange(top, Usd.TraverseInstanceProxies()))
    for prim in prims:
        child_process.at(f"{label}{prim.GetPath()}")
        gathered.n_prims += 1
        if gathered.n_prims > MOST_PRIMS:
            raise _too_many(gathered)
        if prim.GetPath().pathElementCount > MOST_DEEP:  # a query of a prim goes through all above it
            raise SceneError(
                f"{gathered.name}: its prims are nested more than {grouped(MOST_DEEP)} deep, expected fewer; export it "
                "again."
            )
        if not prim.IsA(UsdGeom.Imageable):
            continue
        if _is_hidden(prim):
            if _hides_children(prim):
                prims.PruneChildren()
            continue
        here = cache.GetLocalToWorldTransform(prim)
        relative = np.array(here if label == "" else here * top_inverse, dtype=np.float64).T
        matrix = relative if label == "" else chained(world_from_top, relative)
        name = f"{label}{str(prim.GetPath()).removeprefix(str(top.GetPath()))}" if label else str(prim.GetPath())
        if prim.IsA(UsdGeom.PointInstancer):
            prims.PruneChildren()
            yield from _walk_instances(UsdGeom.PointInstancer(prim), matrix, cache, name, gathered, depth)
        elif prim.IsA(UsdGeom.Mesh) or is_shape(prim):
            yield prim, matrix, name
        elif prim.IsA(UsdGeom.Gprim):
            gathered.left_out[str(prim.GetTypeName())] += 1


def _walk_instances(
    instancer: Any, world_from_instancer: FloatArray, cache: Any, label: str, gathered: _Gathered, depth: int
) -> Iterator[tuple[Any, FloatArray, str]]:
    """Meshes of every unmasked instance, named `/path/of/instancer[number]/path/in/prototype`."""
    from pxr import Usd, UsdGeom

    time = Usd.TimeCode.EarliestTime()
    if depth >= _MAX_INSTANCER_DEPTH:
        raise SceneError(f"{gathered.name}: point instancers inside each other at {label}; export without instancing.")
    targets = instancer.GetPrototypesRel().GetForwardedTargets()
    numbers = instancer.GetProtoIndicesAttr().Get(time) or ()
    placements = instancer.ComputeInstanceTransformsAtTime(
        time, time, UsdGeom.PointInstancer.IncludeProtoXform, UsdGeom.PointInstancer.IgnoreMask
    )
    if len(numbers) > MOST_PRIMS:
        raise _too_many(gathered)
    mask = instancer.ComputeMaskAtTime(time) or [True] * len(numbers)
    stage = instancer.GetPrim().GetStage()
    for i, (number, placement) in enumerate(zip(numbers, placements or (), strict=False)):
        prototype = stage.GetPrimAtPath(targets[number]) if 0 <= number < len(targets) else None
        if not mask[i] or not prototype:
            continue
        matrix = chained(world_from_instancer, np.array(placement, dtype=np.float64).T)
        yield from _walk(prototype, matrix, cache, f"{label}[{i}]", gathered, depth + 1)


def _too_many(gathered: _Gathered) -> SceneError:
    return SceneError(
        f"{gathered.name}: it has more than {grouped(MOST_PRIMS)} prims, counted in every instance, expected fewer; "
        "export the building without plants, crowds and fittings."
    )


def _is_hidden(prim: Any) -> bool:
    from pxr import Usd, UsdGeom

    imageable = UsdGeom.Imageable(prim)
    return (
        _hides_children(prim)
        or str(imageable.ComputePurpose()) in _HIDDEN_PURPOSES
        or (str(imageable.ComputeVisibility(Usd.TimeCode.EarliestTime())) == "invisible")
    )


def _hides_children(prim: Any) -> bool:
    """Invisibility holds for everything below; a purpose may be changed below."""
    from pxr import Usd, UsdGeom

    return str(UsdGeom.Imageable(prim).GetVisibilityAttr().Get(Usd.TimeCode.EarliestTime())) == "invisible"


# ------------------------------------------------------------------------------------------------- mesh
def _add_mesh(gathered: _Gathered, prim: Any, matrix: FloatArray, label: str) -> None:
    source = prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim
    unit_m = _unit_m(gathered.metres_per_unit, matrix) if is_shape(source) else 0.0
    key = str(source.GetPath()), unit_m
    if key not in gathered.meshes:
        read = _read_shape(gathered, source, label, unit_m) if unit_m else _read_mesh(gathered, source, label)
        gathered.meshes[key] = read
    mesh = gathered.meshes[key]
    if not mesh.faces.triangles.size and not mesh.faces.n_dropped:
        return
    triangles = turned_over(mesh.faces.triangles) if is_mirrored(matrix) else mesh.faces.triangles
    optics = gathered.optics.of_triangles(prim, mesh.face)
    gathered.parts.add(len(gathered.elements), placed(mesh.vertices, matrix), triangles, mesh.face, optics)
    gathered.elements.append(Element(label, str(prim.GetTypeName()), label))
    gathered.n_bad_index += mesh.faces.n_bad_index
    gathered.n_too_short += mesh.faces.n_too_short
    gathered.dropped += [f"{label}, {line}" for line in mesh.faces.dropped]


def _unit_m(metres_per_unit: float, matrix: FloatArray) -> float:
    """Metres of a shape's own unit along the axis that its placement (4x4) stretches most; 1 where that is damaged."""
    with np.errstate(over="ignore", invalid="ignore"):
        unit_m = float(metres_per_unit * np.sqrt((matrix[:3, :3] ** 2).sum(axis=0)).max())
    return unit_m if unit_m > 0 and math.isfinite(unit_m) else 1.0


def _read_shape(gathered: _Gathered, prim: Any, label: str, unit_m: float) -> _Mesh:
    """A basic shape as a mesh, right-handed, in its own frame."""
    title = f"{gathered.name}, prim {label}"
    shape = shape_of(prim, title, unit_m)
    faces = triangulate(shape.vertices, shape.n_corners, shape.corners, name=title, skip_bad_faces=False, owner="shape")
    return _Mesh(shape.vertices, _right_handed(prim, faces), faces.polygon)


def _right_handed(prim: Any, faces: Faces) -> Faces:
    """`faces`, turned over where the prim is left-handed."""
    from pxr import Usd, UsdGeom

    if str(UsdGeom.Gprim(prim).GetOrientationAttr().Get(Usd.TimeCode.EarliestTime())) != "leftHanded":
        return faces
    return replace(faces, triangles=turned_over(faces.triangles))


def _read_mesh(gathered: _Gathered, prim: Any, label: str) -> _Mesh:
    """Points and triangles of a mesh prim, right-handed, in its own frame."""
    from pxr import Usd, UsdGeom

    time = Usd.TimeCode.EarliestTime()
    mesh = UsdGeom.Mesh(prim)
    title = f"{gathered.name}, prim {label}"
    vertices = _points(title, mesh.GetPointsAttr().Get(time))
    n_corners = _whole_numbers(title, mesh.GetFaceVertexCountsAttr(), time)
    corners = _whole_numbers(title, mesh.GetFaceVertexIndicesAttr(), time)
    if (n_corners < 0).any() or int(n_corners.sum()) != corners.size:
        raise SceneError(
            f"{title}: its faces need {grouped(int(n_corners.sum()))} corners and it lists {grouped(corners.size)}; "
            "repair the mesh and export it again."
        )
    holes = _whole_numbers(title, mesh.GetHoleIndicesAttr(), time)
    number = np.arange(n_corners.size)
    if holes.size:
        solid = ~np.isin(number, holes)
        number = number[solid]
        corners = corners[np.repeat(solid, n_corners)]
        n_corners = n_corners[solid]
    faces = triangulate(vertices, n_corners, corners, name=title, skip_bad_faces=gathered.skip_bad_faces, owner="mesh")
    return _Mesh(vertices, _right_handed(prim, faces), number[faces.polygon])


def _points(title: str, values: Any) -> FloatArray:
    """(V, 3) float64; empty where the attribute has no value."""
    points = np.zeros((0, 3)) if values is None else np.array(values)
    if points.size == 0:
        return np.zeros((0, 3))
    if points.dtype.kind not in "fiu" or points.ndim != 2 or points.shape[1] != 3:
        raise SceneError(f"{title}: its points are not three numbers each; repair the mesh and export it again.")
    return exact(points)


def _whole_numbers(title: str, attribute: Any, time: Any) -> Int64Array:
    """(N,) int64; empty where the attribute has no value."""
    values = attribute.Get(time)
    numbers = np.zeros(0, dtype=np.int64) if values is None else np.array(values)
    if numbers.size == 0:
        return np.zeros(0, dtype=np.int64)
    if numbers.dtype.kind not in "iu" or numbers.ndim != 1:
        raise SceneError(
            f"{title}: its {attribute.GetName()} are not a list of whole numbers; repair the mesh and export it again."
        )
    return numbers.astype(np.int64)


# ------------------------------------------------------------------------------------------------ result
def _raw_scene(path: Path, stage: Any, gathered: _Gathered, messages: list[str]) -> RawScene:
    from pxr import UsdGeom

    vertices, triangles, owner, face = gathered.parts.joined()
    metres_per_unit = float(UsdGeom.GetStageMetersPerUnit(stage))
    unit = f"{path.name} names no unit: USD's default, centimetres, is assumed; pass --units if that is wrong."
    up = f"{path.name} names no upward axis: USD's default, y, is assumed; pass --up z if that is wrong."
    return RawScene(
        vertices=vertices,
        triangles=triangles,
        element_of_triangle=owner,
        face_of_triangle=face,
        optics_of_triangle=gathered.parts.joined_optics(),
        elements=tuple(gathered.elements),
        unit_name=unit_name(metres_per_unit),
        metres_per_unit=metres_per_unit,
        up_axis=str(UsdGeom.GetStageUpAxis(stage)),
        assumed_unit="" if UsdGeom.StageHasAuthoredMetersPerUnit(stage) else unit,
        assumed_up="" if stage.HasAuthoredMetadata("upAxis") else up,
        schema="USD",
        report=LoadReport(
            n_faces_read=gathered.n_bad_index + gathered.n_too_short,
            n_bad_index=gathered.n_bad_index,
            n_degenerate=gathered.n_too_short,
            dropped=tuple(gathered.dropped[:MAX_DROPPED_LINES]),
            warnings=(*_warnings(path, gathered, messages), *_metrics_warnings(path, stage)),
        ),
    )


def _warnings(path: Path, gathered: _Gathered, messages: list[str]) -> Iterator[str]:
    for text in messages[:_MAX_STAGE_WARNINGS]:
        yield f"{path.name}: {shortened(text.partition(' (instantiating')[0])}"
    if len(messages) > _MAX_STAGE_WARNINGS:
        yield f"{path.name}: {grouped(len(messages) - _MAX_STAGE_WARNINGS)} more warnings of the USD library."
    if gathered.left_out:
        kinds = ", ".join(f"{count} {kind}" for kind, count in sorted(gathered.left_out.items()))
        yield f"{path.name}: shapes of other kinds were left out: {kinds}; convert them to meshes if they matter."


def _metrics_warnings(path: Path, stage: Any) -> Iterator[str]:
    """A line on layers whose unit or upward axis is not the stage's: USD takes their numbers as the stage's."""
    from pxr import UsdGeom

    unit_m, axis = float(UsdGeom.GetStageMetersPerUnit(stage)), str(UsdGeom.GetStageUpAxis(stage))
    others: dict[str, list[str]] = {}
    for layer in stage.GetUsedLayers():
        top = layer.pseudoRoot
        own_unit_m = float(top.GetInfo("metersPerUnit")) if top.HasInfo("metersPerUnit") else unit_m
        own_axis = str(top.GetInfo("upAxis")) if top.HasInfo("upAxis") else axis
        if not math.isclose(own_unit_m, unit_m, rel_tol=1e-6) or own_axis != axis:
            others.setdefault(f"{unit_name(own_unit_m)}s with {own_axis.lower()} up", []).append(layer.GetDisplayName())
    for metrics, names in sorted(others.items()):
        yield (
            f"{path.name} is in {unit_name(unit_m)}s with {axis.lower()} up, and parts in {named_few(sorted(names))} "
            f"are in {metrics}: USD does not convert them, so their size or position is wrong unless the stage scales "
            "and turns them; correct it in the program that put them together."
        )

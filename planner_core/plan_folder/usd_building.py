"""The stage's building layer: one mesh an element, floors, the one material. Survey -> prims below /Plan.

Local frame, metres, z up. What every attribute means is in docs/formats/stage.md.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from planner_core.model import Int32Array, Survey
from planner_core.plan_folder.palette import NEUTRAL, linear_from_srgb
from planner_core.plan_folder.sdf_authoring import (
    TYPES,
    Layer,
    PrimSpec,
    Sdf,
    define,
    int_array,
    put,
    put_colours,
    put_extent,
    put_primvar,
    put_transform,
    set_stage_metadata,
    vec3f_array,
)
from planner_core.plan_folder.usd_names import BUILDING_PATH, MeshPlace, file_path

MATERIAL_PATH = "/Plan/Looks/Surface"
COLOUR_PATH = f"{MATERIAL_PATH}/Colour"
"""Reads the primvar that is shown; which one it is, variants say."""
VARIANT_SET = "heatmap"
VARIANTS = {
    "seen": "displayColor",
    "times_seen": "heatTimesSeen",
    "range": "heatRange",
    "spacing": "heatSpacing",
    "incidence": "heatIncidence",
    "plain": "heatPlain",
}
"""Variant -> the primvar that the material shows; the first is chosen to begin with. `usd_stage` has the others."""


def author_building(layer: Layer, survey: Survey, places: tuple[MeshPlace, ...], *, flat: bool) -> None:
    """Write /Plan with the building, the floors and the material.

    Parameters
    ----------
    places
        From `usd_names.mesh_places`.
    flat
        For the browser's thin reader: no double3, no colour or scalar float values.
    """
    set_stage_metadata(layer, "Plan")
    root = define(layer, "/Plan", "Xform", kind="assembly")
    put_transform(root)
    _author_offset(root, survey, flat=flat)
    _author_material(layer, root, flat=flat)
    if not flat:
        _author_variants(root)
    put_transform(define(layer, BUILDING_PATH, "Xform", kind="group"))
    ground_of_triangle = ground_floor_numbers(survey)
    for number, source in enumerate(survey.scene.sources if survey.scene.further_sources else ()):
        of_file = define(layer, file_path(survey.scene, number), "Xform", kind="group")
        put_transform(of_file)
        put(of_file, "tlsplan:file", TYPES.String, source.path.name)
    parents: set[str] = set()
    for place in places:
        group = place.path.rsplit("/", 1)[0]
        for parent in (group.rsplit("/", 1)[0], group):
            if parent not in parents:
                parents.add(parent)
                put_transform(define(layer, parent, "Xform", kind="group"))
        _author_mesh(layer, survey, place, ground_of_triangle, flat=flat)
    _author_floors(layer, survey)


def ground_floor_numbers(survey: Survey) -> Int32Array:
    """(T,) int32: number of the floor (from 1) whose GROUND a triangle is; 0 where it is no ground."""
    numbers = np.zeros(survey.scene.n_triangles, dtype=np.int32)
    for index, floor in enumerate(survey.floors):
        numbers[floor.ground_triangles] = index + 1
    return numbers


def floor_tops_m(survey: Survey) -> tuple[float, ...]:
    """Where each floor ends, local: at the next higher ground, or at the highest point of the scene."""
    highest_m = float(survey.scene.vertices_m[:, 2].max())
    grounds_m = [floor.elevation_m for floor in survey.floors]
    return tuple(min((z for z in grounds_m if z > ground), default=max(highest_m, ground)) for ground in grounds_m)


def _author_offset(root: PrimSpec, survey: Survey, *, flat: bool) -> None:
    offset_m = tuple(float(value) for value in survey.scene.offset_m)
    for axis, value in zip("XYZ", offset_m, strict=True):
        put(root, f"tlsplan:offset{axis}", TYPES.Double, value)
    if not flat:
        put(root, "tlsplan:offset", TYPES.Double3, offset_m)
        root.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=["MaterialBindingAPI", "GeomModelAPI"]))
        put_extent(root, survey.scene.vertices_m, name="extentsHint")
    else:
        root.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=["MaterialBindingAPI"]))


def _author_material(layer: Layer, root: PrimSpec, *, flat: bool) -> None:
    """A matt surface that shows a primvar; bound once at the root: per-prim binding made readers crawl."""
    binding = Sdf.RelationshipSpec(root, "material:binding", False)
    binding.targetPathList.explicitItems = [MATERIAL_PATH]
    define(layer, "/Plan/Looks", "Scope")
    material = define(layer, MATERIAL_PATH, "Material")
    shader = define(layer, f"{MATERIAL_PATH}/Preview", "Shader")
    put(shader, "info:id", TYPES.Token, "UsdPreviewSurface", uniform=True)
    _connect(material, "outputs:surface", TYPES.Token, f"{MATERIAL_PATH}/Preview.outputs:surface")
    _output(shader, "outputs:surface", TYPES.Token)
    if flat:
        return
    put(shader, "inputs:roughness", TYPES.Float, 0.9)
    reader = define(layer, COLOUR_PATH, "Shader")
    put(reader, "info:id", TYPES.Token, "UsdPrimvarReader_float3", uniform=True)
    _output(reader, "outputs:result", TYPES.Float3)
    _connect(shader, "inputs:diffuseColor", TYPES.Color3f, f"{COLOUR_PATH}.outputs:result")


def _author_variants(root: PrimSpec) -> None:
    """Variants differ in the one material's `varname` only: switching them costs nothing, however large the building.

    Their opinions are weaker than any that is in none, so the material itself has no `varname`.
    """
    neutral = vec3f_array(linear_from_srgb(np.array([NEUTRAL])))
    put_primvar(root, VARIANTS["plain"], TYPES.Color3fArray, neutral, "constant")
    variants = Sdf.VariantSetSpec(root, VARIANT_SET)
    for variant, primvar in VARIANTS.items():
        shader = Sdf.VariantSpec(variants, variant).primSpec
        for name in COLOUR_PATH.removeprefix("/Plan/").split("/"):
            shader = Sdf.PrimSpec(shader, name, Sdf.SpecifierOver)
        put(shader, "inputs:varname", TYPES.String, primvar)
    root.variantSetNameList.prependedItems = [VARIANT_SET]
    root.variantSelections[VARIANT_SET] = next(iter(VARIANTS))


def _output(prim: PrimSpec, name: str, type_name: Any) -> None:
    Sdf.AttributeSpec(prim, name, type_name, Sdf.VariabilityVarying, False)


def _connect(prim: PrimSpec, name: str, type_name: Any, target: str) -> None:
    attribute = Sdf.AttributeSpec(prim, name, type_name, Sdf.VariabilityVarying, False)
    attribute.connectionPathList.explicitItems = [target]


def _author_mesh(layer: Layer, survey: Survey, place: MeshPlace, ground_of_triangle: Int32Array, *, flat: bool) -> None:
    scene, element = survey.scene, survey.scene.elements[place.element]
    mesh = define(layer, place.path, "Mesh", kind="component")
    used, corner = np.unique(scene.triangles[place.triangles], return_inverse=True)
    points_m = scene.vertices_m[used]
    n_faces = place.triangles.size
    put(mesh, "points", TYPES.Point3fArray, vec3f_array(points_m))
    put(mesh, "faceVertexCounts", TYPES.IntArray, int_array(np.full(n_faces, 3)))
    put(mesh, "faceVertexIndices", TYPES.IntArray, int_array(corner.ravel()))
    put(mesh, "doubleSided", TYPES.Bool, True, uniform=True)
    put(mesh, "subdivisionScheme", TYPES.Token, "none", uniform=True)
    put_transform(mesh)
    put_extent(mesh, points_m)
    put(mesh, "tlsplan:name", TYPES.String, scene.label(place.element))
    put(mesh, "tlsplan:kind", TYPES.String, element.kind)
    put(mesh, "tlsplan:sourceId", TYPES.String, element.source_id)
    if scene.further_sources:
        put(mesh, "tlsplan:file", TYPES.String, scene.file_of(place.element))
    put(mesh, "tlsplan:element", TYPES.Int, place.element)
    put(mesh, "tlsplan:floor", TYPES.String, _floor_id(survey, place.triangles))
    columns: dict[str, np.ndarray] = {
        "triangle": place.triangles,
        "floorIndex": ground_of_triangle[place.triangles],
        "firstPatch": survey.patches.first_patch[place.triangles],
        "patchDepth": survey.patches.depth[place.triangles],
    }
    for name, values in columns.items():
        put_primvar(mesh, f"tlsplan:{name}", TYPES.IntArray, int_array(values), "uniform")
    if not flat:
        put_colours(mesh, np.array([NEUTRAL]), "constant")


def _floor_id(survey: Survey, triangles: Int32Array) -> str:
    """Floor that most of the element's area counts for; empty where none of it counts for any."""
    floor = survey.floor_of_triangle[triangles]
    counted = floor >= 0
    if not counted.any():
        return ""
    area_m2 = np.bincount(floor[counted], weights=survey.patches.triangle_area_m2[triangles[counted]])
    return survey.floors[int(np.argmax(area_m2))].id


def _author_floors(layer: Layer, survey: Survey) -> None:
    define(layer, "/Plan/Floors", "Scope")
    for index, (floor, top_m) in enumerate(zip(survey.floors, floor_tops_m(survey), strict=True)):
        prim = define(layer, f"/Plan/Floors/{floor.id}", "Scope")
        put(prim, "tlsplan:floorId", TYPES.String, floor.id)
        put(prim, "tlsplan:name", TYPES.String, floor.name)
        put(prim, "tlsplan:index", TYPES.Int, index)
        put(prim, "tlsplan:elevation", TYPES.Double, floor.elevation_m)
        put(prim, "tlsplan:top", TYPES.Double, top_m)
        put(prim, "tlsplan:groundArea", TYPES.Double, floor.ground_area_m2)

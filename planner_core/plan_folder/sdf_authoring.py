"""Writing specs straight into a USD layer: the few calls every layer writer of the stage needs.

Sdf inside one `Sdf.ChangeBlock` writes 25 000 prims in seconds where the schema classes (UsdGeom) take half a minute,
because nothing is composed between two attributes. The price: nothing checks us but the tests.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from planner_core.errors import MissingPackageError
from planner_core.model import FloatArray, SiteFrame

try:
    from pxr import Gf, Sdf, Tf, Vt
except ImportError as error:
    raise MissingPackageError(
        f"writing the USD stage needs the package usd-core, which can't be imported ({error}): pip install usd-core"
    ) from error

__all__ = ["Sdf", "Tf"]  # handed on, so that only this module deals with a missing package

Layer = Any
PrimSpec = Any

TYPES = Sdf.ValueTypeNames
SITE_KEY = "tlsplan"
"""Of the site's coordinates in a layer's customLayerData; what is under it is in docs/formats/stage.md."""


def new_layer() -> Layer:
    """An empty layer in memory."""
    return Sdf.Layer.CreateAnonymous()


def set_stage_metadata(layer: Layer, default_prim: str) -> None:
    """Metres, z up, and the prim that stands for the layer when it is referenced."""
    layer.defaultPrim = default_prim
    layer.pseudoRoot.SetInfo("metersPerUnit", 1.0)
    layer.pseudoRoot.SetInfo("upAxis", "Z")


def put_site(layer: Layer, frame: SiteFrame) -> None:
    """Name the site's coordinates in a layer; what else its customLayerData holds stays."""
    layer.customLayerData = {**dict(layer.customLayerData), SITE_KEY: site_data(frame)}


def site_data(frame: SiteFrame) -> dict[str, str]:
    """Coordinates in words, the systems' names for programs, and the 4 x 4 matrix from scene coordinates, by rows."""
    rows = [value for row in frame.matrix.tolist() for value in row]
    return {
        "coordinates": frame.crs_line,
        "crs": frame.crs,
        "verticalCrs": frame.vertical_crs,
        "sceneToSite": " ".join(repr(float(value)) for value in rows),
    }


def define(layer: Layer, path: str, type_name: str, *, kind: str = "") -> PrimSpec:
    """Define the prim at `path`, ancestors included, and return its spec."""
    prim = Sdf.CreatePrimInLayer(layer, path)
    prim.specifier = Sdf.SpecifierDef
    prim.typeName = type_name
    if kind:
        prim.kind = kind
    return prim


def over(layer: Layer, path: str) -> PrimSpec:
    """Return the spec at `path`: as it is where the layer has it, else an empty opinion (`over`)."""
    return Sdf.CreatePrimInLayer(layer, path)


def put(prim: PrimSpec, name: str, type_name: Any, value: Any, *, uniform: bool = False) -> Any:
    """Set attribute `name` of `prim`; our own (`tlsplan:`) attributes are marked custom. Returns the attribute spec.

    One that is there and of another type, as in a layer that somebody edited, is replaced.
    """
    attribute = prim.attributes.get(name)
    if attribute is not None and attribute.typeName != type_name:
        prim.RemoveProperty(attribute)
        attribute = None
    if attribute is None:
        variability = Sdf.VariabilityUniform if uniform else Sdf.VariabilityVarying
        attribute = Sdf.AttributeSpec(prim, name, type_name, variability, name.startswith("tlsplan:"))
    attribute.default = value
    return attribute


def put_primvar(prim: PrimSpec, name: str, type_name: Any, value: Any, interpolation: str) -> None:
    """Set `primvars:name` with its interpolation (`constant`, `uniform`, `vertex`)."""
    put(prim, f"primvars:{name}", type_name, value).SetInfo("interpolation", interpolation)


def put_colours(prim: PrimSpec, srgb: FloatArray, interpolation: str, indices: np.ndarray | None = None) -> None:
    """Set displayColor from sRGB (K, 3), linearised; with `indices`, one a face or point, into these colours."""
    from planner_core.plan_folder.palette import linear_from_srgb

    put_primvar(prim, "displayColor", TYPES.Color3fArray, vec3f_array(linear_from_srgb(srgb)), interpolation)
    if indices is not None:
        put(prim, "primvars:displayColor:indices", TYPES.IntArray, int_array(indices))


def put_transform(prim: PrimSpec, translation_m: FloatArray | None = None, *, axes: FloatArray | None = None) -> None:
    """Set the prim's one matrix4d transform: the identity, a translation (3,), a turn by its axes, (3, 3) rows."""
    matrix = Gf.Matrix4d(1.0)
    if axes is not None:
        matrix.SetRotateOnly(Gf.Matrix3d(*(float(value) for value in axes.ravel())))
    if translation_m is not None:
        matrix.SetTranslateOnly(Gf.Vec3d(*(float(value) for value in translation_m)))
    put(prim, "xformOp:transform", TYPES.Matrix4d, matrix)
    put(prim, "xformOpOrder", TYPES.TokenArray, Vt.TokenArray(["xformOp:transform"]), uniform=True)


def put_extent(prim: PrimSpec, points_m: np.ndarray, *, margin_m: float = 0.0, name: str = "extent") -> None:
    """Set the prim's bounding box from points (N, 3), grown by `margin_m`."""
    corners = np.stack([points_m.min(axis=0) - margin_m, points_m.max(axis=0) + margin_m])
    put(prim, name, TYPES.Float3Array, vec3f_array(corners))


def vec3f_array(values: np.ndarray) -> Any:
    """(N, 3) numbers as USD's float3[]."""
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(values, dtype=np.float32))


def int_array(values: np.ndarray) -> Any:
    """(N,) integers as USD's int[]."""
    return Vt.IntArray.FromNumpy(np.ascontiguousarray(values, dtype=np.int32))


def float_array(values: np.ndarray) -> Any:
    """(N,) numbers as USD's float[]."""
    return Vt.FloatArray.FromNumpy(np.ascontiguousarray(values, dtype=np.float32))

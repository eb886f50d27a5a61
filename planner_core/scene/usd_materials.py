"""What the meshes of a USD stage do to beams: by bound materials, by `tlsplan:material`, by display opacity.

Scene stage. For each face, the first of these that gives optics decides: the material of its subset (family
materialBind), the attribute `tlsplan:material` of the mesh, the material bound to the mesh or to a prim above it, the
primvar `displayOpacity`. Of a material its name and, where it has a UsdPreviewSurface, opacity, metallic and roughness
are read; inputs that a texture gives count as none. Source: the reference of usd-core 26.11; UsdPreviewSurface 2.6.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from planner_core.model import Int64Array, Optics, UInt8Array
from planner_core.scene.materials import optics_of_material, optics_of_name, optics_of_transparency


@dataclass
class UsdOptics:
    """What has been read so far, so that a material is read once."""

    of_material: dict[str, Optics | None] = field(default_factory=dict)
    """By path of the material."""

    def of_triangles(self, prim: Any, face: Int64Array) -> UInt8Array | None:
        """(T,) `Optics` of a mesh whose triangles are parts of the polygons `face`; None where all return.

        prim : the mesh as it hangs in the stage: of an instance, the proxy, so that bindings above it count.
        """
        of_mesh = self._of_mesh(prim)
        if of_mesh is None:
            optics = _of_opacity(prim, face)
        else:
            optics = np.full(len(face), of_mesh, dtype=np.uint8) if of_mesh else None
        of_subsets = list(self._of_subsets(prim))
        if of_subsets:
            optics = np.zeros(len(face), dtype=np.uint8) if optics is None else optics
            for polygons, of_subset in reversed(of_subsets):  # of two that share a face, the first counts
                optics[np.isin(face, polygons)] = of_subset
        return optics if optics is not None and optics.any() else None

    def _of_subsets(self, prim: Any) -> Iterator[tuple[Int64Array, Optics]]:
        """Polygons, and the optics of the material of their subset."""
        from pxr import Usd, UsdShade

        for subset in UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets():
            optics = self._of_bound(subset.GetPrim(), own=True)
            if optics is not None:
                yield np.array(subset.GetIndicesAttr().Get(Usd.TimeCode.EarliestTime()) or (), dtype=np.int64), optics

    def _of_mesh(self, prim: Any) -> Optics | None:
        from pxr import Usd

        attribute = prim.GetAttribute("tlsplan:material")
        named = attribute.Get(Usd.TimeCode.EarliestTime()) if attribute else None
        optics = optics_of_name(named) if isinstance(named, str) else None
        return self._of_bound(prim) if optics is None else optics

    def _of_bound(self, prim: Any, *, own: bool = False) -> Optics | None:
        """Optics of the material bound to a prim; own: not one that is bound above it."""
        from pxr import UsdShade

        material, relation = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
        if not material or (own and relation.GetPrim() != prim):
            return None
        key = str(material.GetPath())
        if key not in self.of_material:
            self.of_material[key] = _of_material(material)
        return self.of_material[key]


def _of_material(material: Any) -> Optics | None:
    shader, _, _ = material.ComputeSurfaceSource()
    if not shader or str(shader.GetIdAttr().Get()) != "UsdPreviewSurface":
        return optics_of_name(str(material.GetPrim().GetName()))
    opacity = _figure(shader, "opacity")
    return optics_of_material(
        [str(material.GetPrim().GetName())],
        transparency=None if opacity is None else 1.0 - opacity,
        metallic=_figure(shader, "metallic"),
        roughness=_figure(shader, "roughness"),
    )


def _figure(shader: Any, name: str) -> float | None:
    """Value of a shader's input, also where it is handed down from the material's own; None where there is none."""
    from pxr import Usd, UsdShade

    given = shader.GetInput(name)
    for attribute in UsdShade.Utils.GetValueProducingAttributes(given) if given else ():
        value = attribute.Get(Usd.TimeCode.EarliestTime()) if UsdShade.Input.IsInput(attribute) else None
        if isinstance(value, int | float):
            return float(value)
    return None


def _of_opacity(prim: Any, face: Int64Array) -> UInt8Array | None:
    """(T,) from the primvar `displayOpacity`, one value or one a polygon; None where it is not so, as at points."""
    from pxr import Usd, UsdGeom

    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance("displayOpacity")
    if not primvar or not primvar.HasValue():
        return None
    opacity = np.array(primvar.ComputeFlattened(Usd.TimeCode.EarliestTime()) or (), dtype=np.float64)
    of_value = np.array([optics_of_transparency(1.0 - o) or Optics.RETURNS for o in opacity.tolist()], dtype=np.uint8)
    if str(primvar.GetInterpolation()) == UsdGeom.Tokens.constant and of_value.size == 1:
        return np.full(len(face), of_value[0], dtype=np.uint8)
    if str(primvar.GetInterpolation()) == UsdGeom.Tokens.uniform and face.size and face.max() < of_value.size:
        return of_value[face]
    return None

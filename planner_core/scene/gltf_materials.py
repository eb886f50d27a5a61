"""What in a glTF file's materials matters to beams, see `planner_core.scene.materials`.

Source: Khronos Group, glTF 2.0 Specification, 2021, and its extension KHR_materials_transmission.
"""

from __future__ import annotations

from planner_core.model import Optics
from planner_core.scene.gltf_file import JsonObject
from planner_core.scene.materials import optics_of_material, optics_of_name


def material_optics(material: JsonObject) -> Optics | None:
    """What a material's name, transmission, blended opacity, metal and roughness say; textures say nothing."""
    pbr = material.object("pbrMetallicRoughness") if material.has("pbrMetallicRoughness") else None
    metallic: float | None = None
    roughness: float | None = None
    if pbr is not None and not pbr.has("metallicRoughnessTexture"):
        metallic, roughness = pbr.number("metallicFactor", 1.0), pbr.number("roughnessFactor", 1.0)
    return optics_of_material(
        [material.text("name")], transparency=_transparency(material, pbr), metallic=metallic, roughness=roughness
    )


def _transparency(material: JsonObject, pbr: JsonObject | None) -> float | None:
    """The share of light that goes through, by whichever way lets more through; None where neither is used."""
    shares = []
    extensions = material.object("extensions") if material.has("extensions") else None
    if extensions is not None and extensions.has("KHR_materials_transmission"):
        shares.append(extensions.object("KHR_materials_transmission").number("transmissionFactor", 0.0))
    if material.text("alphaMode") == "BLEND" and pbr is not None:
        shares.append(1.0 - pbr.numbers("baseColorFactor", (1.0, 1.0, 1.0, 1.0))[3])
    return max(shares, default=None)


def node_optics(node: JsonObject) -> Optics | None:
    """Optics of a node's mesh by `extras.material`, a text of our own that other tools keep."""
    extras = node.members.get("extras")
    named = extras.get("material") if isinstance(extras, dict) else None
    return optics_of_name(named) if isinstance(named, str) else None

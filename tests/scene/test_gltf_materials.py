"""What glTF says of glass and mirrors: materials of primitives, and extras of nodes."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner_core.model import Optics
from planner_core.scene.load import LoadOptions, load_scene

RETURNS, PASSES, STOPS = Optics.RETURNS, Optics.PASSES, Optics.STOPS


def write_gltf(path: Path, materials: list[Any], *, extras: Any = None, uses: list[Any] | None = None) -> Path:
    """One node; a triangle a primitive, each a metre further, with the materials of `uses` (None: none)."""
    uses = list(range(len(materials))) if uses is None else uses
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype="<f4")
    binary = b"".join((points + np.float32([0, 0, i])).astype("<f4").tobytes() for i in range(len(uses)))
    (path.parent / "data.bin").write_bytes(binary)
    primitives = [
        {"attributes": {"POSITION": i}, **({} if use is None else {"material": use})} for i, use in enumerate(uses)
    ]
    node = {"mesh": 0, "name": "Window", **({} if extras is None else {"extras": extras})}
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [node],
        "meshes": [{"primitives": primitives}],
        "materials": materials,
        "accessors": [
            {"bufferView": 0, "byteOffset": 36 * i, "componentType": 5126, "count": 3, "type": "VEC3"}
            for i in range(len(uses))
        ],
        "bufferViews": [{"buffer": 0, "byteLength": len(binary)}],
        "buffers": [{"uri": "data.bin", "byteLength": len(binary)}],
    }
    path.write_text(json.dumps(tree))
    return path


def optics_of(path: Path) -> list[int]:
    scene = load_scene(path, options=LoadOptions(up_axis="Z"))
    return [0] * scene.n_triangles if scene.optics_of_triangle is None else scene.optics_of_triangle.tolist()


def transmits(factor: Any) -> dict[str, Any]:
    return {"extensions": {"KHR_materials_transmission": {"transmissionFactor": factor}}}


def blends(alpha: float, mode: str = "BLEND") -> dict[str, Any]:
    return {"alphaMode": mode, "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, alpha]}}


def metal(metallic: float, roughness: float, **more: Any) -> dict[str, Any]:
    return {"pbrMetallicRoughness": {"metallicFactor": metallic, "roughnessFactor": roughness, **more}}


@pytest.mark.parametrize(
    ("material", "told"),
    [
        ({"name": "Glas"}, PASSES), ({"name": "Spiegel"}, STOPS), ({"name": "Holz"}, RETURNS), ({}, RETURNS),
        (transmits(0.9), PASSES), (transmits(0.4), RETURNS), (transmits(1), PASSES),
        ({"name": "Frosted glass", **transmits(0.9)}, RETURNS),
        (blends(0.3), PASSES), (blends(0.7), RETURNS), (blends(0.3, "OPAQUE"), RETURNS), (blends(0.3, "MASK"), RETURNS),
        (metal(1.0, 0.0), STOPS), (metal(1.0, 0.3), RETURNS), ({"pbrMetallicRoughness": {}}, RETURNS),
        ({"pbrMetallicRoughness": {"roughnessFactor": 0.0}}, STOPS),  # metallicFactor is 1 unless said otherwise
        (metal(1.0, 0.0, metallicRoughnessTexture={"index": 0}), RETURNS),  # which the texture's values multiply
        ({"name": "Mirror", **transmits(1.0)}, STOPS),
    ],
)  # fmt: skip
def test_gltf_material_tells_what_its_primitive_does(material: dict[str, Any], told: Optics, tmp_path: Path) -> None:
    assert optics_of(write_gltf(tmp_path / "a.gltf", [material])) == [told]


def test_gltf_primitives_of_one_mesh_differ(tmp_path: Path) -> None:
    materials = [{"name": "Frame"}, {"name": "Glass"}, {"name": "Mirror"}]
    assert optics_of(write_gltf(tmp_path / "a.gltf", materials, uses=[0, 1, None, 2, 1])) == [0, 1, 0, 2, 1]


@pytest.mark.parametrize(
    ("extras", "told"),
    [
        ({"material": "glass"}, [PASSES, PASSES, STOPS, RETURNS]),
        ({"material": "mirror"}, [STOPS, STOPS, STOPS, RETURNS]),
        ({"material": 7}, [0, 0, 2, 0]), ([1], [0, 0, 2, 0]), ("glass", [0, 0, 2, 0]), (None, [0, 0, 2, 0]),
    ],
)  # fmt: skip
def test_gltf_extras_of_a_node_hold_where_the_material_says_nothing(
    extras: Any, told: list[int], tmp_path: Path
) -> None:
    materials = [{"name": "Material.001"}, {"name": "Mirror"}, {"name": "Milk glass"}]
    assert optics_of(write_gltf(tmp_path / "a.gltf", materials, extras=extras, uses=[0, None, 1, 2])) == told


@pytest.mark.parametrize(
    "material",
    [
        {"name": 5}, {"extensions": {"KHR_materials_transmission": 1}}, transmits("much"), transmits(True),
        {"pbrMetallicRoughness": []}, blends("x"), metal(None, 0.0),  # type: ignore[arg-type]
    ],
)  # fmt: skip
def test_gltf_material_that_does_not_follow_the_format_is_told_of_and_returns(
    material: dict[str, Any], tmp_path: Path
) -> None:
    scene = load_scene(write_gltf(tmp_path / "a.gltf", [material]))
    assert scene.optics_of_triangle is None
    told = r"^Materials are damaged.*: a\.gltf: its contents do not follow glTF 2\.0 \(materials/0[^\n]*$"
    assert any(re.match(told, line) for line in scene.report.warnings)


def test_gltf_primitive_without_its_material_is_told_of_and_returns(tmp_path: Path) -> None:
    scene = load_scene(write_gltf(tmp_path / "a.gltf", [{}], uses=[3]))
    assert scene.optics_of_triangle is None
    assert any("Materials are damaged" in line for line in scene.report.warnings)

"""What files say of glass and mirrors: names, figures, and faces of every format, down to panes within one element."""

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import scenes_synthetic
from planner_core.errors import SceneError
from planner_core.model import Optics, Scene
from planner_core.scene.load import LoadOptions, load_scene
from planner_core.scene.materials import (
    optics_of_material,
    optics_of_metal,
    optics_of_name,
    optics_of_transparency,
)

RETURNS, PASSES, STOPS = Optics.RETURNS, Optics.PASSES, Optics.STOPS
CUBE = np.array([[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], dtype=np.float64)
SIDES = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
"""Six quadrilaterals of the cube."""


def passing(scene: Scene) -> dict[str, tuple[int, int]]:
    """By element: triangles that pass, and all."""
    optics = scene.optics_of_triangle
    told = np.zeros(scene.n_triangles, np.uint8) if optics is None else optics
    owners = [scene.element_of_triangle == e for e in range(len(scene.elements))]
    return {
        element.name: (int((told[owned] == PASSES).sum()), int(owned.sum()))
        for element, owned in zip(scene.elements, owners, strict=True)
    }


# ------------------------------------------------------------------------------------------------------- names
NAMES = {
    PASSES: [
        "Glass", "glass", "GLASS", "Glass - Clear, Grey", "Glas", "Glas - klar", "Isolierglas", "Verglasung",
        "Dreifach-Verglasung", "Isolierverglasung", "ClearGlass", "M_Glass_01", "glassPane", "window_glass.001",
        "Glazing", "double glazing", "Plexiglass", "verre", "Double vitrage", "vitre de la fen\u00eatre", "Vetro",
        "vetrocamera",
        "Vidrio", "cristal", "vidro temperado", "beglazing", "Veiligheidsglas", "Panssarilasi lasi",
        "Szk\u0142o hartowane", "sklo",
        "Glass No 5", "MAT_Glass", "glas, isolering 4-16-4",
    ],
    STOPS: [
        "Mirror", "mirror_01", "Spiegel", "Wandspiegel", "Kristallspiegel", "miroir", "Specchio", "espejo",
        "Espelho", "spegel",
        "Mirror glass", "mirrored glass", "Glas verspiegelt", "Glass, silvered", "MIRROR",
    ],
    RETURNS: [
        "Glass wool", "glasswool", "Glaswolle", "Glaswol", "Fibreglass", "fiberglass", "Fiberglas", "glass fibre mat",
        "Glasfasertapete", "laine de verre", "lana di vetro", "lana de vidrio", "l\u00e3 de vidro", "fibra de vidrio",
        "Glass block", "Glass Brick", "Glasbausteine", "pav\u00e9 de verre", "Frosted glass", "FrostedGlass",
        "satin glass",
        "Milk glass", "Milchglas", "Opalglas", "verre d\u00e9poli", "vetro satinato", "opaque glass",
        "Spandrel Glass",
        "painted mirror", "Glass frame", "mirror frame", "Schaumglas", "foam glass", "glass mosaic tile",
        "glass fibre concrete",
    ],
    None: [
        "", "Wood", "Douglas", "Douglas fir", "DOUGLAS-FIR", "Glasgow stone", "Wasserspiegel", "PEN_MATERIAL12",
        "chair mirrored",
        "Satin chrome", "Milk", "Brushed steel", "Concrete", "glassy", "Stainless", "plaster", "Spiegelei",
        "Mirrorless", "\u00e9\u00e8\u00ea", "123",
    ],
}  # fmt: skip


@pytest.mark.parametrize(("told", "name"), [(told, name) for told, names in NAMES.items() for name in names])
def test_name_of_a_material_tells_what_its_surface_does(told: Optics | None, name: str) -> None:
    assert optics_of_name(name) is told


@given(st.text(max_size=60))
def test_no_name_is_too_odd_to_be_asked(name: str) -> None:
    assert optics_of_name(name) in (None, *Optics)


@given(st.text(alphabet=st.characters(categories=("Nd", "Po", "Zs")), max_size=8))
def test_digits_and_signs_around_a_word_change_nothing(noise: str) -> None:
    for word in ("glass", "Spiegel", "wood", "Milchglas"):
        assert optics_of_name(f"{noise}{word}{noise}") is optics_of_name(word)


@given(st.sampled_from([name for names in NAMES.values() for name in names]))
def test_case_of_letters_changes_nothing(name: str) -> None:
    if not re.search("[a-z][A-Z]", name):  # a hump is a gap between words
        assert optics_of_name(name.upper()) is optics_of_name(name.lower()) is optics_of_name(name)


def test_a_name_as_long_as_a_file_is_looked_at_in_no_time() -> None:
    assert optics_of_name("glass " * 10**6) is PASSES


# ----------------------------------------------------------------------------------------------------- figures
@pytest.mark.parametrize(
    ("transparency", "told"),
    [(None, None), (math.nan, None), (0.0, RETURNS), (0.49, RETURNS), (0.5, PASSES), (1.0, PASSES), (math.inf, PASSES)],
)
def test_half_the_light_let_through_passes(transparency: float | None, told: Optics | None) -> None:
    assert optics_of_transparency(transparency) is told


@pytest.mark.parametrize(
    ("metallic", "roughness", "told"),
    [
        (1.0, 0.0, STOPS), (0.95, 0.05, STOPS), (0.94, 0.0, RETURNS), (1.0, 0.06, RETURNS), (0.0, 0.0, RETURNS),
        (None, 0.0, None), (1.0, None, None), (math.nan, 0.0, None), (1.0, math.nan, None),
    ],
)  # fmt: skip
def test_smooth_metal_is_a_mirror(metallic: float | None, roughness: float | None, told: Optics | None) -> None:
    assert optics_of_metal(metallic, roughness) is told


def test_names_come_before_figures_and_the_first_name_that_speaks_before_others() -> None:
    assert optics_of_material(["Milchglas"], transparency=0.9) is RETURNS
    assert optics_of_material(["Glass"], transparency=0.0) is PASSES
    assert optics_of_material(["Surface 7", "Mirror", "Glass"], transparency=0.9) is STOPS
    assert optics_of_material(["Surface 7"], transparency=0.9) is PASSES
    assert optics_of_material(["Surface 7"], transparency=0.9, metallic=1.0, roughness=0.0) is PASSES
    assert optics_of_material(["Surface 7"], transparency=0.1, metallic=1.0, roughness=0.0) is STOPS
    assert optics_of_material(["Surface 7"], transparency=0.1) is RETURNS
    assert optics_of_material(["Surface 7"]) is None
    assert optics_of_material([]) is None


# ---------------------------------------------------------------------------------------------- synthetic scenes
@pytest.mark.parametrize("suffix", [".ifc", ".glb", ".usda", ".usdc", ".obj"])
def test_every_format_with_materials_brings_back_the_same_glass_and_mirror(suffix: str, tmp_path: Path) -> None:
    synthetic = scenes_synthetic.build("glass-and-mirror")
    scene = load_scene(scenes_synthetic.write(synthetic, tmp_path / f"scene{suffix}"))
    assert scene.optics_of_triangle is not None and synthetic.scene.optics_of_triangle is not None
    told = {re.split(r"[/]", element.name)[-1].replace("_", " "): set() for element in scene.elements}
    for element, optics in zip(scene.element_of_triangle, scene.optics_of_triangle, strict=True):
        told[re.split(r"[/]", scene.elements[element].name)[-1].replace("_", " ")].add(int(optics))
    wanted = {part.name: {0} for part in synthetic.parts} | {"Glass wall": {PASSES}, "Mirror": {STOPS}}
    assert told == wanted
    assert {name for name, optics in told.items() if optics != {0}} == set(synthetic.truth.returns_nothing)
    assert area_m2(scene).tolist() == pytest.approx(area_m2(synthetic.scene).tolist(), rel=1e-5)


def area_m2(scene: Scene) -> np.ndarray:
    """Area of what returns, passes, stops."""
    a, b, c = (scene.vertices_m[scene.triangles[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return np.bincount(scene.optics_of_triangle, area, minlength=3)


def test_scene_in_memory_has_the_optics_of_its_parts() -> None:
    synthetic = scenes_synthetic.build("glass-and-mirror")
    area = area_m2(synthetic.scene)
    # A box of 0.02 x 3.6 x 2.7 m and one of 2 x 0.01 x 1.6 m.
    assert area[PASSES] == pytest.approx(2 * (0.02 * 3.6 + 3.6 * 2.7 + 0.02 * 2.7))
    assert area[STOPS] == pytest.approx(2 * (2 * 0.01 + 2 * 1.6 + 0.01 * 1.6))


def test_scene_without_materials_has_no_optics() -> None:
    assert scenes_synthetic.build("thin-walls").scene.optics_of_triangle is None


@pytest.mark.parametrize("suffix", [".ply", ".stl"])
def test_formats_without_materials_say_nothing(suffix: str, tmp_path: Path) -> None:
    path = scenes_synthetic.write(scenes_synthetic.build("glass-and-mirror"), tmp_path / f"scene{suffix}")
    assert load_scene(path).optics_of_triangle is None


@pytest.mark.parametrize(("glass", "counts"), [("pass", (12, 12)), ("stop", (0, 24)), ("return", (0, 12))])
def test_option_glass_says_what_panes_do_and_leaves_mirrors(
    glass: str, counts: tuple[int, int], tmp_path: Path
) -> None:
    path = scenes_synthetic.write(scenes_synthetic.build("glass-and-mirror"), tmp_path / "scene.obj")
    scene = load_scene(path, options=LoadOptions(glass=glass))
    optics = scene.optics_of_triangle
    assert optics is not None
    assert ((optics == PASSES).sum(), (optics == STOPS).sum()) == counts


# --------------------------------------------------------------------------------------------------------- glTF
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
def test_gltf_material_that_does_not_follow_the_format_is_an_error_of_one_line(
    material: dict[str, Any], tmp_path: Path
) -> None:
    with pytest.raises(SceneError, match=r"^a\.gltf: its contents do not follow glTF 2\.0 \(materials/0[^\n]*$"):
        load_scene(write_gltf(tmp_path / "a.gltf", [material]))


def test_gltf_primitive_without_its_material_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"primitives/0/material is 3, expected a whole number from 0 to 0"):
        load_scene(write_gltf(tmp_path / "a.gltf", [{}], uses=[3]))

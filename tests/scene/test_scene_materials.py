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


# ---------------------------------------------------------------------------------------------------------- USD
class Stage:
    """A cube of six quadrilaterals at /House/Window, and materials to bind."""

    def __init__(self) -> None:
        from pxr import Usd, UsdGeom

        self.stage = Usd.Stage.CreateInMemory()
        UsdGeom.SetStageMetersPerUnit(self.stage, 1.0)
        UsdGeom.SetStageUpAxis(self.stage, UsdGeom.Tokens.z)
        self.house = UsdGeom.Xform.Define(self.stage, "/House").GetPrim()
        self.mesh = self.cube("/House/Window")

    def cube(self, path: str) -> Any:
        from pxr import UsdGeom

        mesh = UsdGeom.Mesh.Define(self.stage, path)
        mesh.CreatePointsAttr([tuple(p) for p in CUBE.tolist()])
        mesh.CreateFaceVertexCountsAttr([4] * 6)
        mesh.CreateFaceVertexIndicesAttr(np.ravel(SIDES).tolist())
        return mesh

    def material(self, name: str, **inputs: float) -> Any:
        from pxr import Sdf, UsdShade

        material = UsdShade.Material.Define(self.stage, f"/Looks/{name}")
        shader = UsdShade.Shader.Define(self.stage, f"/Looks/{name}/Surface")
        shader.CreateIdAttr("UsdPreviewSurface")
        for key, value in inputs.items():
            shader.CreateInput(key, Sdf.ValueTypeNames.Float).Set(value)
        material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
        return material

    def bind(self, prim: Any, material: Any) -> None:
        from pxr import UsdShade

        UsdShade.MaterialBindingAPI.Apply(prim).Bind(material)

    def subset(self, name: str, faces: list[int], material: Any) -> None:
        from pxr import UsdShade

        api = UsdShade.MaterialBindingAPI.Apply(self.mesh.GetPrim())
        self.bind(api.CreateMaterialBindSubset(name, faces).GetPrim(), material)

    def say(self, material: str) -> None:
        from pxr import Sdf

        self.mesh.GetPrim().CreateAttribute("tlsplan:material", Sdf.ValueTypeNames.String, custom=True).Set(material)

    def load(self, folder: Path) -> list[int]:
        """What each triangle does, two a side of the cube."""
        path = folder / "a.usda"
        self.stage.Export(str(path))
        scene = load_scene(path)
        assert scene.report.warnings == ()
        return [0] * scene.n_triangles if scene.optics_of_triangle is None else scene.optics_of_triangle.tolist()


@pytest.mark.parametrize(
    ("name", "inputs", "told"),
    [
        ("Glass_clear", {}, PASSES), ("Spiegel", {}, STOPS), ("Wood", {}, RETURNS),
        ("Frosted_glass", {"opacity": 0.2}, RETURNS),
        ("M1", {"opacity": 0.2}, PASSES), ("M1", {"opacity": 0.8}, RETURNS),
        ("M1", {"metallic": 1.0, "roughness": 0.01}, STOPS), ("M1", {"metallic": 1.0, "roughness": 0.5}, RETURNS),
        ("M1", {"metallic": 1.0}, RETURNS),
    ],
)  # fmt: skip
def test_usd_material_tells_what_its_mesh_does(
    name: str, inputs: dict[str, float], told: Optics, tmp_path: Path
) -> None:
    stage = Stage()
    stage.bind(stage.mesh.GetPrim(), stage.material(name, **inputs))
    assert stage.load(tmp_path) == [told] * 12


def test_usd_material_bound_above_a_mesh_holds(tmp_path: Path) -> None:
    stage = Stage()
    stage.bind(stage.house, stage.material("M1", opacity=0.1))
    assert stage.load(tmp_path) == [PASSES] * 12


def test_usd_subsets_give_faces_of_one_mesh_their_own_materials(tmp_path: Path) -> None:
    stage = Stage()
    stage.bind(stage.mesh.GetPrim(), stage.material("Mirror"))
    stage.subset("panes", [2, 4], stage.material("Glass"))
    stage.subset("frame", [0], stage.material("Opaque_glass"))
    stage.subset("silent", [5], stage.material("M7"))  # says nothing, so the mesh's material holds
    assert stage.load(tmp_path) == np.repeat([RETURNS, STOPS, PASSES, STOPS, PASSES, STOPS], 2).tolist()


def test_usd_subsets_count_faces_as_the_file_does_where_a_mesh_has_holes(tmp_path: Path) -> None:
    stage = Stage()
    stage.mesh.CreateHoleIndicesAttr([0, 3])
    stage.subset("panes", [4], stage.material("Glass"))
    assert stage.load(tmp_path) == np.repeat([0, 0, PASSES, 0], 2).tolist()  # faces 1, 2, 4, 5


def test_usd_attribute_comes_after_subsets_and_before_the_material_of_the_mesh(tmp_path: Path) -> None:
    stage = Stage()
    stage.say("glass")
    stage.bind(stage.mesh.GetPrim(), stage.material("Mirror"))
    stage.subset("mirror", [1], stage.material("Spiegel"))
    assert stage.load(tmp_path) == [PASSES] * 2 + [STOPS] * 2 + [PASSES] * 8


def test_usd_subset_that_binds_nothing_itself_leaves_the_word_to_its_mesh(tmp_path: Path) -> None:
    from pxr import UsdShade

    stage = Stage()
    stage.say("glass")
    stage.bind(stage.mesh.GetPrim(), stage.material("Mirror"))
    UsdShade.MaterialBindingAPI(stage.mesh.GetPrim()).CreateMaterialBindSubset("unbound", [0, 1])
    assert stage.load(tmp_path) == [PASSES] * 12


def test_usd_face_of_two_subsets_is_the_first_ones(tmp_path: Path) -> None:
    stage = Stage()
    stage.subset("a", [0, 1], stage.material("Glass"))
    stage.subset("b", [1, 2], stage.material("Mirror"))
    assert stage.load(tmp_path) == np.repeat([PASSES, PASSES, STOPS, 0, 0, 0], 2).tolist()


def test_usd_inputs_handed_down_from_the_material_count_and_textures_do_not(tmp_path: Path) -> None:
    from pxr import Sdf, UsdShade

    for source, told in (("interface", PASSES), ("texture", RETURNS)):
        stage = Stage()
        material = stage.material("M1")
        opacity = UsdShade.Shader.Get(stage.stage, "/Looks/M1/Surface").CreateInput("opacity", Sdf.ValueTypeNames.Float)
        if source == "interface":
            given = material.CreateInput("clearness", Sdf.ValueTypeNames.Float)
            given.Set(0.1)
            opacity.ConnectToSource(given)
        else:
            texture = UsdShade.Shader.Define(stage.stage, "/Looks/M1/Texture")
            texture.CreateIdAttr("UsdUVTexture")
            texture.CreateInput("fallback", Sdf.ValueTypeNames.Float4).Set((0, 0, 0, 0))
            opacity.ConnectToSource(texture.ConnectableAPI(), "a")
        stage.bind(stage.mesh.GetPrim(), material)
        assert stage.load(tmp_path) == [told] * 12


@pytest.mark.parametrize(
    ("interpolation", "values", "told"),
    [
        ("constant", [0.2], [PASSES] * 6), ("constant", [0.9], [0] * 6), ("constant", [], [0] * 6),
        ("uniform", [1, 0.1, 1, 0.1, 0.6, 0.5], [0, 1, 0, 1, 0, 1]), ("uniform", [0.1], [0] * 6),
        ("vertex", [0.1] * 8, [0] * 6),
    ],
)  # fmt: skip
def test_usd_display_opacity_says_it_where_nothing_else_does(
    interpolation: str, values: list[float], told: list[int], tmp_path: Path
) -> None:
    stage = Stage()
    stage.mesh.CreateDisplayOpacityPrimvar(interpolation).Set(values)
    assert stage.load(tmp_path) == np.repeat(told, 2).tolist()
    stage.bind(stage.mesh.GetPrim(), stage.material("Mirror"))
    assert stage.load(tmp_path) == [STOPS] * 12


def test_usd_instances_take_the_materials_bound_above_them(tmp_path: Path) -> None:
    from pxr import UsdGeom

    stage = Stage()
    stage.stage.RemovePrim("/House")
    stage.stage.CreateClassPrim("/Part")  # which is not shown itself
    stage.cube("/Part/mesh")
    for place, name in enumerate(("Glass", "Mirror", "M1")):
        holder = UsdGeom.Xform.Define(stage.stage, f"/{name}")
        holder.AddTranslateOp().Set((2 * place, 0, 0))
        holder.GetPrim().GetReferences().AddInternalReference("/Part")
        holder.GetPrim().SetInstanceable(True)
        stage.bind(holder.GetPrim(), stage.material(name))
    assert stage.load(tmp_path) == [PASSES] * 12 + [STOPS] * 12 + [RETURNS] * 12


# ---------------------------------------------------------------------------------------------------------- OBJ
def write_obj(folder: Path, uses: list[str], library: str | bytes | None = None, *, line: str = "mtllib a.mtl") -> Path:
    """A triangle a use, each a metre above the last."""
    lines = [line]
    for i, use in enumerate(uses):
        lines += [use, *(f"v {x} {y} {i}" for x, y in ((0, 0), (1, 0), (0, 1))), "f -3 -2 -1"]
    path = folder / "a.obj"
    path.write_text("\n".join(lines) + "\n")
    if library is not None:
        (folder / "a.mtl").write_bytes(library.encode() if isinstance(library, str) else library)
    return path


def test_obj_names_of_materials_say_it_without_a_library(tmp_path: Path) -> None:
    uses = ["", "usemtl Glas klar", "g Frame", "usemtl Holz", "o Other", "usemtl Spiegel", "usemtl"]
    path = write_obj(tmp_path, uses)
    assert optics_of(path) == [0, PASSES, PASSES, 0, 0, STOPS, 0]
    (warning,) = load_scene(path).report.warnings
    assert "no material was read from its material library" in warning


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        ("d 0.3", PASSES), ("d 0.8", RETURNS), ("d 1", RETURNS), ("Tr 0.7", PASSES), ("Tr 0.2", RETURNS),
        ("Tr 1.0", RETURNS), ("d 0.2\nTr 0", PASSES), ("Tr 0\nd 0.2", PASSES), ("d 1\nTr 0.9", RETURNS),
        ("Pm 1\nPr 0", STOPS), ("Pm 1\nPr 0.4", RETURNS), ("illum 3\nKd 1 1 1", RETURNS),
        ("\td\t0.3 # clear", PASSES), ("d -halo 0.1", RETURNS), ("d much", RETURNS), ("d", RETURNS), ("d nan", RETURNS),
    ],
)  # fmt: skip
def test_obj_figures_of_the_library_say_it_where_the_name_does_not(lines: str, told: Optics, tmp_path: Path) -> None:
    library = f"# made for a test\nnewmtl other\nd 0.1\nnewmtl M 1\n{lines}\nnewmtl M 1\nd 0.1\n"
    assert optics_of(write_obj(tmp_path, ["usemtl M 1"], library)) == [told]


def test_obj_name_comes_before_the_figures(tmp_path: Path) -> None:
    library = "newmtl Frosted glass\nd 0.1\nnewmtl Glass\nd 1\n"
    assert optics_of(write_obj(tmp_path, ["usemtl Frosted glass", "usemtl Glass"], library)) == [RETURNS, PASSES]


def test_obj_library_may_begin_with_a_byte_order_mark(tmp_path: Path) -> None:
    library = b"\xef\xbb\xbfnewmtl M1\r\nd 0.1\r\n"
    assert optics_of(write_obj(tmp_path, ["usemtl M1"], library)) == [PASSES]


def test_obj_polygons_and_dropped_faces_keep_their_materials(tmp_path: Path) -> None:
    corners = "".join(f"v {x:g} {y:g} {z:g}\n" for x, y, z in CUBE.tolist())
    text = corners + "usemtl Glass\nf 1 2 3 4\nf 1 2\nf 1 2 99\nusemtl Wood\nf 5 6 7 8\nusemtl Mirror\nf 1 2 6 5\n"
    (tmp_path / "a.obj").write_text(text)
    scene = load_scene(tmp_path / "a.obj", options=LoadOptions(skip_bad_faces=True))
    assert scene.optics_of_triangle is not None
    assert scene.optics_of_triangle.tolist() == [PASSES, PASSES, 0, 0, STOPS, STOPS]


@pytest.mark.parametrize(
    "line", ["mtllib a.mtl", "mtllib ./a.mtl", "mtllib .\\a.mtl", "mtllib other.mtl a.mtl", "mtllib sub/../a.mtl"]
)
def test_obj_library_is_found_beside_it(line: str, tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    assert optics_of(write_obj(tmp_path, ["usemtl M1"], "newmtl M1\nd 0.1\n", line=line)) == [PASSES]


def test_obj_library_may_have_blanks_in_its_name(tmp_path: Path) -> None:
    (tmp_path / "my house.mtl").write_text("newmtl M1\nd 0.1\n")
    assert optics_of(write_obj(tmp_path, ["usemtl M1"], line="mtllib my house.mtl")) == [PASSES]


@pytest.mark.parametrize("kind", ["parent", "absolute", "link"])
def test_obj_library_outside_its_folder_is_not_read(kind: str, tmp_path: Path) -> None:
    folder = tmp_path / "model"
    folder.mkdir()
    outside = tmp_path / "secret.mtl"
    outside.write_text("newmtl M1\nd 0.1\n")
    (folder / "link.mtl").symlink_to(outside)
    name = {"parent": "../secret.mtl", "absolute": str(outside), "link": "link.mtl"}[kind]
    path = write_obj(folder, ["usemtl M1"], line=f"mtllib {name}")
    assert optics_of(path) == [RETURNS]
    (warning,) = load_scene(path).report.warnings
    assert warning == f"a.obj: its material library {name} is outside its folder and was not read."


def test_obj_library_too_large_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from planner_core.scene import mtl

    monkeypatch.setattr(mtl, "_LARGEST_BYTES", 2**20)
    path = write_obj(tmp_path, ["usemtl M1"], b"newmtl M1\nd 0.1\n" + b"#" * 2**20)
    assert optics_of(path) == [RETURNS]
    (warning,) = load_scene(path).report.warnings
    assert warning.startswith("a.obj: its material library a.mtl was not read: libraries of more than 1 MiB")


@pytest.mark.parametrize("name", ["", "missing.mtl", ".", "a\x00b.mtl", "x" * 5000, "\n"])
def test_obj_library_that_is_no_file_is_no_error(name: str, tmp_path: Path) -> None:
    assert optics_of(write_obj(tmp_path, ["usemtl Glass"], line="v 0 0 9\n" * 1000 + f"mtllib {name}")) == [PASSES]


def test_obj_that_names_many_libraries_has_the_first_hundred_read(tmp_path: Path) -> None:
    lines = "\n".join(f"mtllib {i}.mtl" for i in range(250))
    path = write_obj(tmp_path, ["usemtl Glass"], line=lines)
    assert load_scene(path).report.warnings[0] == "a.obj names 250 material libraries: 100 were read."


@given(library=st.binary(max_size=300))
def test_obj_library_of_any_bytes_leaves_the_scene_whole(
    library: bytes, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.getbasetemp() / "any-library"
    folder.mkdir(exist_ok=True)
    path = write_obj(folder, ["usemtl M1", "usemtl Mirror"], b"newmtl M1\n" + library)
    assert optics_of(path)[1] == STOPS


# ---------------------------------------------------------------------------------------------------------- IFC
class Windows:
    """A model of windows 5 m apart, each of a frame and two panes."""

    def __init__(self, ifc_writer: Any, schema: str = "IFC4") -> None:
        self.writer = ifc_writer(schema, "MILLI")
        self.model = self.writer.model
        self.storey = self.writer.storeys({"Ground": 0.0}, (0, 0, 0))["Ground"]
        self.n_windows = 0

    def add(self, *, as_triangles: bool = False, mapped: bool = False) -> tuple[Any, list[Any]]:
        """A window, and its three items: frame, pane, pane."""
        sizes = ((1, 0.25, 2), (0.5, 0.125, 1), (0.375, 0.0625, 1.5))
        items = [self._triangles(size) if as_triangles else self.writer.block(size) for size in sizes]
        kind = "Tessellation" if as_triangles else "SweptSolid"
        body = self.writer.body(items[0], kind)
        body.Items = items
        if mapped:
            origin = self.writer.axes((0, 0, 0))
            source = self.model.create_entity("IfcRepresentationMap", MappingOrigin=origin, MappedRepresentation=body)
            target = self.model.create_entity(
                "IfcCartesianTransformationOperator3D", LocalOrigin=self.writer.point(0, 0, 0)
            )
            item = self.model.create_entity("IfcMappedItem", MappingSource=source, MappingTarget=target)
            body = self.writer.body(item, "MappedRepresentation")
        shape = self.model.create_entity("IfcProductDefinitionShape", Representations=[body])
        placement = self.writer.placement((5 * self.n_windows, 0, 0), above=self.storey)
        window = self.writer.root("IfcWindow", f"W{self.n_windows}", ObjectPlacement=placement, Representation=shape)
        self.writer.contain(self.storey, window)
        self.n_windows += 1
        return window, items

    def _triangles(self, size: tuple[float, ...]) -> Any:
        corners = (CUBE * np.array(size) * self.writer.per_metre).tolist()
        points = self.model.create_entity("IfcCartesianPointList3D", corners)
        faces = [[a + 1, b + 1, c + 1] for s in SIDES for a, b, c in ((s[0], s[1], s[2]), (s[0], s[2], s[3]))]
        return self.model.create_entity("IfcTriangulatedFaceSet", Coordinates=points, Closed=True, CoordIndex=faces)

    def style(self, name: str, transparency: float | None = None, method: str = "NOTDEFINED") -> Any:
        colour = self.model.create_entity("IfcColourRgb", None, 0.5, 0.5, 0.5)
        rendering = self.model.create_entity(
            "IfcSurfaceStyleRendering", SurfaceColour=colour, Transparency=transparency, ReflectanceMethod=method
        )
        return self.model.create_entity("IfcSurfaceStyle", Name=name, Side="BOTH", Styles=[rendering])

    def paint(self, item: Any, style: Any) -> None:
        if self.model.schema == "IFC2X3":
            style = self.model.create_entity("IfcPresentationStyleAssignment", [style])
        self.model.create_entity("IfcStyledItem", Item=item, Styles=[style])

    def material(self, name: str, **attributes: Any) -> Any:
        return self.model.create_entity("IfcMaterial", Name=name, **attributes)

    def draw(self, material: Any, style: Any) -> None:
        """Give a material a style of its own."""
        item = self.model.create_entity("IfcStyledItem", Styles=[style])
        drawn = self.model.create_entity("IfcStyledRepresentation", ContextOfItems=self.writer.context, Items=[item])
        self.model.create_entity(
            "IfcMaterialDefinitionRepresentation", Representations=[drawn], RepresentedMaterial=material
        )

    def assign(self, material: Any, *things: Any) -> None:
        self.writer.relate("IfcRelAssociatesMaterial", RelatedObjects=list(things), RelatingMaterial=material)

    def layers(self, *materials: Any) -> Any:
        thick = [self.model.create_entity("IfcMaterialLayer", m, 4.0) for m in materials]
        return self.model.create_entity("IfcMaterialLayerSet", MaterialLayers=thick)

    def profiles(self, *materials: Any) -> Any:
        named = [self.model.create_entity("IfcMaterialProfile", Material=m) for m in materials]
        return self.model.create_entity("IfcMaterialProfileSet", MaterialProfiles=named)

    def constituents(self, **materials: Any) -> Any:
        named = [
            self.model.create_entity("IfcMaterialConstituent", Name=name, Material=m) for name, m in materials.items()
        ]
        return self.model.create_entity("IfcMaterialConstituentSet", MaterialConstituents=named)

    def aspect(self, name: str, items: list[Any], holder: Any) -> None:
        body = self.writer.body(items[0], "SweptSolid")
        body.Items = items
        self.model.create_entity(
            "IfcShapeAspect", ShapeRepresentations=[body], Name=name, PartOfProductDefinitionShape=holder
        )

    def load(self, folder: Path) -> list[list[int]]:
        """By window: what its frame does, its larger and its smaller pane; each does one thing on all its faces."""
        path = folder / "a.ifc"
        self.model.write(str(path))
        scene = load_scene(path)
        assert scene.report.warnings == ()
        told = np.zeros(scene.n_triangles, np.uint8) if scene.optics_of_triangle is None else scene.optics_of_triangle
        return [self._of_items(scene, told, element) for element in range(self.n_windows)]

    def _of_items(self, scene: Scene, told: np.ndarray, element: int) -> list[int]:
        owned = scene.element_of_triangle == element
        triangles = scene.triangles[owned]
        assert len(triangles) == 36
        corners = scene.vertices_m[triangles]
        # The items come one after another; how far each reaches in x tells which it is.
        reach = [corners[i : i + 12, :, 0].max() - 5 * element for i in (0, 12, 24)]
        assert reach == [1, 0.5, 0.375]
        return [np.unique(told[owned][i : i + 12]).item() for i in (0, 12, 24)]


@pytest.fixture(params=["swept", "triangles", "mapped"])
def how(request: pytest.FixtureRequest) -> dict[str, bool]:
    return {"as_triangles": request.param == "triangles", "mapped": request.param == "mapped"}


def test_ifc_styles_part_the_panes_of_a_window_from_its_frame(
    how: dict[str, bool], ifc_writer: Any, tmp_path: Path
) -> None:
    windows = Windows(ifc_writer)
    _, (frame, large, small) = windows.add(**how)
    windows.paint(frame, windows.style("Kiefer", 0.0))
    windows.paint(large, windows.style("Glas"))
    windows.paint(small, windows.style("Surface 3", 0.9))
    assert windows.load(tmp_path) == [[RETURNS, PASSES, PASSES]]


def test_ifc2x3_styles_do_the_same(ifc_writer: Any, tmp_path: Path) -> None:
    windows = Windows(ifc_writer, "IFC2X3")
    _, (frame, large, small) = windows.add()
    windows.paint(frame, windows.style("Frosted glass", 0.9))
    windows.paint(large, windows.style("Surface 1", 0.9))
    windows.paint(small, windows.style("Surface 2", 0.1, "MIRROR"))
    assert windows.load(tmp_path) == [[RETURNS, PASSES, STOPS]]


@pytest.mark.parametrize(
    ("transparency", "method", "told"),
    [
        (0.5, "NOTDEFINED", PASSES), (0.4, "NOTDEFINED", RETURNS), (None, "NOTDEFINED", RETURNS),
        (None, "GLASS", PASSES), (0.0, "MIRROR", STOPS), (0.9, "METAL", PASSES),
    ],
)  # fmt: skip
def test_ifc_style_without_a_word_is_told_by_method_and_transparency(
    transparency: float | None, method: str, told: Optics, ifc_writer: Any, tmp_path: Path
) -> None:
    windows = Windows(ifc_writer)
    _, (_, large, _) = windows.add()
    windows.paint(large, windows.style("Surface", transparency, method))
    assert windows.load(tmp_path) == [[RETURNS, told, RETURNS]]


def test_ifc_style_comes_before_the_material_of_the_product(
    how: dict[str, bool], ifc_writer: Any, tmp_path: Path
) -> None:
    windows = Windows(ifc_writer)
    window, (frame, large, _) = windows.add(**how)
    windows.assign(windows.material("Glas"), window)
    windows.paint(frame, windows.style("Holz", 0.0))
    windows.paint(large, windows.style("Surface"))  # says nothing
    assert windows.load(tmp_path) == [[RETURNS, PASSES, PASSES]]


@pytest.mark.parametrize(
    ("name", "category", "style", "told"),
    [
        ("Verglasung", None, None, PASSES), ("M1", "glass", None, PASSES), ("Spiegel", "glass", None, STOPS),
        ("M1", "wood", None, RETURNS), ("M1", None, ("Surface", 0.8), PASSES), ("M1", None, ("Surface", 0.1), RETURNS),
        ("Glas", None, ("Surface", 0.0), PASSES),  # the material's own name decides before the figures it is drawn with
        ("Milchglas", None, ("Glass", 0.9), RETURNS),
    ],
)  # fmt: skip
def test_ifc_material_without_styles_of_items_tells_what_the_product_does(
    name: str, category: str | None, style: tuple[str, float] | None, told: Optics, ifc_writer: Any, tmp_path: Path
) -> None:
    windows = Windows(ifc_writer)
    material = windows.material(name, Category=category)
    if style is not None:
        windows.draw(material, windows.style(*style))
    windows.assign(material, windows.add()[0])
    windows.add()  # has none
    assert windows.load(tmp_path) == [[told] * 3, [RETURNS] * 3]


def test_ifc_layers_and_lists_pass_where_all_of_them_are_glass(ifc_writer: Any, tmp_path: Path) -> None:
    windows = Windows(ifc_writer)
    glass, wood, air = (windows.material(name) for name in ("Glass", "Wood", "Air gap"))
    sets = [
        windows.layers(glass, air, glass),
        windows.layers(glass, None, glass),
        windows.layers(glass, wood),
        windows.model.create_entity("IfcMaterialLayerSetUsage", windows.layers(glass), "AXIS2", "POSITIVE", 0.0),
        windows.model.create_entity("IfcMaterialList", [glass, glass]),
        windows.model.create_entity("IfcMaterialList", [wood, glass]),
        windows.profiles(glass),
        windows.constituents(lining=glass, glazing=glass),
        windows.constituents(lining=wood, glazing=glass),
        windows.layers(air),
    ]  # fmt: skip
    for told in sets:
        windows.assign(told, windows.add()[0])
    passes = [1, 1, 0, 1, 1, 0, 1, 1, 0, 0]
    assert windows.load(tmp_path) == [[told] * 3 for told in passes]


@pytest.mark.parametrize("mapped", [False, True])
def test_ifc_shape_aspects_part_the_constituents_of_a_window(mapped: bool, ifc_writer: Any, tmp_path: Path) -> None:
    windows = Windows(ifc_writer)
    window, (frame, large, small) = windows.add(mapped=mapped)
    holder = window.Representation
    if mapped:
        (holder,) = windows.model.by_type("IfcRepresentationMap")
    windows.aspect("Lining", [frame], holder)
    windows.aspect("Glazing", [large], holder)
    windows.aspect("Film", [small], holder)
    wood, glass, mirror = (windows.material(name) for name in ("Wood", "Glass", "Mirror"))
    windows.assign(windows.constituents(Lining=wood, Glazing=glass, Film=mirror), window)
    assert windows.load(tmp_path) == [[RETURNS, PASSES, STOPS]]
    windows.paint(large, windows.style("Milk glass"))  # a style comes before a constituent
    assert windows.load(tmp_path) == [[RETURNS, RETURNS, STOPS]]


def test_ifc_material_of_the_type_holds_where_the_product_has_none(ifc_writer: Any, tmp_path: Path) -> None:
    windows = Windows(ifc_writer)
    first, second = windows.add()[0], windows.add()[0]
    window_type = windows.writer.root("IfcWindowType", "T", PredefinedType="WINDOW", PartitioningType="SINGLE_PANEL")
    windows.writer.relate("IfcRelDefinesByType", RelatedObjects=[first, second], RelatingType=window_type)
    windows.assign(windows.material("Glass"), window_type)
    windows.assign(windows.material("Wood"), second)
    assert windows.load(tmp_path) == [[PASSES] * 3, [RETURNS] * 3]


def test_ifc_materials_that_are_damaged_leave_the_shapes_and_a_warning(ifc_writer: Any, tmp_path: Path) -> None:
    windows = Windows(ifc_writer)
    material = windows.material("Glass")
    windows.draw(material, windows.style("Glass", 0.9))
    windows.assign(material, windows.add()[0])
    path = tmp_path / "a.ifc"
    windows.model.write(str(path))
    text = path.read_text()
    path.write_text(re.sub(r"(IFCSTYLEDREPRESENTATION\(#\d+,\$,\$,\()#\d+", r"\1#1", text))  # items that are no items
    scene = load_scene(path)
    assert scene.n_triangles == 36 and scene.optics_of_triangle is None
    (warning,) = scene.report.warnings
    assert warning.startswith(
        "a.ifc: its materials can't be read, so all surfaces return beams: its contents do not follow IFC4"
    )


# --------------------------------------------------------------------------------------------------- real models
def areas_by_kind(scene: Scene) -> dict[str, list[float]]:
    """By IFC class with glass: square metres that return and that pass."""
    assert scene.optics_of_triangle is not None
    a, b, c = (scene.vertices_m[scene.triangles[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    kinds = np.array([element.kind for element in scene.elements])[scene.element_of_triangle]
    found = {
        str(kind): np.bincount(scene.optics_of_triangle[kinds == kind], area[kinds == kind], minlength=2).tolist()
        for kind in np.unique(kinds)
    }
    return {kind: areas for kind, areas in found.items() if areas[1]}


@pytest.mark.parametrize(
    ("name", "wanted"),
    [
        (
            "duplex.ifc",
            {"IfcDoor": [80.33, 5.47], "IfcWindow": [154.19, 114.4], "IfcFurnishingElement": [452.45, 7.56]},
        ),
        ("fzk-haus.ifc", {"IfcDoor": [27.92, 7.08], "IfcWindow": [36.95, 34.06]}),
    ],
)
def test_real_windows_have_panes_that_pass_and_frames_that_return(
    name: str, wanted: dict[str, list[float]], real_ifc: Any
) -> None:
    """Areas of both faces of each pane; duplex's furniture with glass is its tables."""
    scene = load_scene(real_ifc(name))
    found = areas_by_kind(scene)
    assert found == {kind: pytest.approx(areas, abs=0.02) for kind, areas in wanted.items()}
    optics = scene.optics_of_triangle
    assert optics is not None
    windows = [e for e, element in enumerate(scene.elements) if element.kind == "IfcWindow"]
    told = [set(optics[scene.element_of_triangle == e].tolist()) for e in windows]
    assert sum(PASSES in one for one in told) > len(windows) / 2
    assert all(RETURNS in one for one in told)

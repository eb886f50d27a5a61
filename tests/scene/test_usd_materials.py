"""What USD says of glass and mirrors: materials bound above, on and within a mesh, attributes, opacity."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner_core.model import Optics
from planner_core.scene.load import load_scene

RETURNS, PASSES, STOPS = Optics.RETURNS, Optics.PASSES, Optics.STOPS
CUBE = np.array([[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], dtype=np.float64)
SIDES = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
"""Six quadrilaterals of the cube."""


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

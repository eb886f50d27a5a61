"""Files: what is written is valid, always the same, replaces whole, and loads back as the same building."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from slow_cases import all_slow_but

import scenes_synthetic
from planner_core.errors import RequirementError
from planner_core.model import Scene
from planner_core.scene.load import load_scene
from scenes_synthetic.model import SyntheticScene
from scenes_synthetic.write import FORMATS
from tests.scene.conftest import in_this_process  # noqa: F401 - a fixture

pytestmark = pytest.mark.usefixtures("in_this_process")


@pytest.fixture(scope="module")
def house() -> SyntheticScene:
    return scenes_synthetic.build("house")


def element_areas_m2(scene: Scene) -> np.ndarray:
    a, b, c = (scene.vertices_m[scene.triangles[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return np.bincount(scene.element_of_triangle, weights=area, minlength=len(scene.elements))


def corners(scene: Scene) -> np.ndarray:
    """All triangles, (T, 9), in an order that does not depend on the file's."""
    points = np.round(scene.vertices_m[scene.triangles], 4)
    order = np.lexsort(np.moveaxis(points, -1, 0)[::-1], axis=1)
    rows = np.take_along_axis(points, order[:, :, None], axis=1).reshape(-1, 9)
    return rows[np.lexsort(rows.T[::-1])]


@pytest.mark.parametrize("suffix", [s for s in FORMATS if s != ".ifc"])
@pytest.mark.parametrize("name", [pytest.param("house", marks=pytest.mark.slow), "two-rooms"])
def test_mesh_formats_load_back_as_the_same_triangles(name: str, suffix: str, tmp_path: Path) -> None:
    synthetic = scenes_synthetic.build(name)
    scene = load_scene(scenes_synthetic.write(synthetic, tmp_path / f"{name}{suffix}"))
    assert scene.report.n_degenerate == scene.report.n_duplicate == 0
    assert scene.report.warnings == ()
    np.testing.assert_allclose(corners(scene), corners(synthetic.scene), atol=2e-4)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".obj", ".glb", ".usda"])
def test_formats_with_names_keep_one_element_a_part(house: SyntheticScene, suffix: str, tmp_path: Path) -> None:
    scene = load_scene(scenes_synthetic.write(house, tmp_path / f"house{suffix}"))
    assert len(scene.elements) == len(house.parts)
    np.testing.assert_allclose(
        np.sort(element_areas_m2(scene)), np.sort([part.solid.area_m2 for part in house.parts]), rtol=1e-5
    )


@pytest.mark.parametrize("name", all_slow_but(["l-room"], ["house", "l-room"]))
def test_ifc_loads_back_with_names_classes_storeys_and_areas(name: str, tmp_path: Path) -> None:
    synthetic = scenes_synthetic.build(name)
    scene = load_scene(scenes_synthetic.write(synthetic, tmp_path / f"{name}.ifc"))
    assert (scene.source.schema, scene.source.unit_name) == ("IFC4", "millimetre")
    assert [(s.name, s.elevation_m) for s in scene.storeys] == list(synthetic.truth.storeys)
    areas = dict(zip((e.name for e in scene.elements), element_areas_m2(scene), strict=True))
    assert areas == pytest.approx({part.name: part.solid.area_m2 for part in synthetic.parts}, rel=1e-6)
    known = {part.name: (part.kind, part.storey) for part in synthetic.parts}
    assert {e.name: (e.kind, e.storey) for e in scene.elements} == known
    extents = [scene.vertices_m.min(axis=0), scene.vertices_m.max(axis=0)]
    np.testing.assert_allclose(extents, synthetic.truth.extents_m, atol=1e-6)
    assert scene.report.warnings == ()


@pytest.mark.parametrize(
    "name",
    all_slow_but(
        ("hole-walls", "glass-and-mirror", "georeferenced", "stairwell"),
        (name for name in scenes_synthetic.names() if name not in scenes_synthetic.PAPER),
    ),
)
def test_ifc_is_valid_by_its_schema(name: str, tmp_path: Path) -> None:
    import ifcopenshell
    import ifcopenshell.validate

    model = ifcopenshell.open(str(scenes_synthetic.write(scenes_synthetic.build(name), tmp_path / "scene.ifc")))
    log = ifcopenshell.validate.json_logger()
    ifcopenshell.validate.validate(model, log)
    assert log.statements == []
    rooms = {space.Name for space in model.by_type("IfcSpace")}
    assert rooms == set(scenes_synthetic.build(name).truth.floor_area_m2)
    fillings = model.by_type("IfcRelFillsElement")
    assert len(fillings) == len(model.by_type("IfcDoor")) + len(model.by_type("IfcWindow"))


WRITE_ALL = """
import sys, scenes_synthetic
from scenes_synthetic.write import FORMATS
for suffix in FORMATS:
    scenes_synthetic.write(scenes_synthetic.build("house"), f"{sys.argv[1]}/house{suffix}")
"""


@pytest.mark.slow
def test_another_process_writes_the_same_bytes(house: SyntheticScene, tmp_path: Path) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    here.mkdir()
    there.mkdir()
    subprocess.run([sys.executable, "-c", WRITE_ALL, str(there)], check=True, env={"PYTHONHASHSEED": "5"})
    for suffix in FORMATS:
        path = scenes_synthetic.write(house, here / f"house{suffix}")
        assert path.read_bytes() == (there / path.name).read_bytes(), suffix


def test_failed_write_leaves_the_old_file_and_nothing_else(
    house: SyntheticScene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "house.obj"
    target.write_text("old")

    def fail(synthetic: SyntheticScene) -> bytes:
        raise OSError("disk full")

    monkeypatch.setitem(scenes_synthetic.write.__globals__["_BYTES"], ".obj", fail)
    with pytest.raises(OSError, match="disk full"):
        scenes_synthetic.write(house, target)
    assert [p.name for p in tmp_path.iterdir()] == ["house.obj"]
    assert target.read_text() == "old"


def test_folders_on_the_way_are_made(house: SyntheticScene, tmp_path: Path) -> None:
    path = scenes_synthetic.write(house, tmp_path / "out" / "deep" / "house.stl")
    assert path.stat().st_size == 84 + 50 * house.scene.n_triangles
    assert path.stat().st_mode & 0o777 == 0o644


def test_unknown_extension_is_refused_with_the_known_ones(house: SyntheticScene, tmp_path: Path) -> None:
    with pytest.raises(RequirementError, match=r"house\.dwg: scenes are not written as \.dwg, expected one of \.ifc, "):
        scenes_synthetic.write(house, tmp_path / "house.dwg")
    assert list(tmp_path.iterdir()) == []


def test_importing_the_package_loads_no_heavy_library() -> None:
    heavy = "ifcopenshell pxr trimesh pyvista open3d pyopencl scipy"
    code = f"import sys, scenes_synthetic; print(*[m for m in {heavy.split()} if m in sys.modules])"
    result = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert result.stdout.split() == []

"""Slabs that are single sheets: ground above and ceiling below are two surfaces, however a file mirrors them."""

import base64
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.model import Paper, PlanSettings, Scene, Survey, UpAxis
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.load import LoadOptions, load_scene
from tests.reality_files import reality
from tests.scene.floor_scenes import four_walls, scene_of

SETTINGS = PlanSettings(scanner=load_scanner("rtc360"), max_patch_area_m2=1.0)
WIDE_M, DEEP_M, STOREY_M = 5.0, 4.0, 3.0
#: Sheets: levels at 0, 3 and 6 m, and walls around both rooms.
CORNERS = np.array(
    [(x, y, z) for z in (0.0, 3.0, 6.0) for x, y in ((0, 0), (WIDE_M, 0), (WIDE_M, DEEP_M), (0, DEEP_M))]
)
FACES = np.array(
    [(4 * k + a, 4 * k + b, 4 * k + c) for k in range(3) for a, b, c in ((0, 1, 2), (0, 2, 3))]
    + [t for k in range(4) for t in ((k, (k + 1) % 4, 8 + k), ((k + 1) % 4, 8 + (k + 1) % 4, 8 + k))]
)


def as_obj(path: Path, *, mirrored: bool) -> Path:
    faces = FACES[:, ::-1] if mirrored else FACES
    lines = [*("v {} {} {}".format(*c) for c in CORNERS), *("f {} {} {}".format(*(f + 1)) for f in faces)]
    path.with_suffix(".obj").write_text("\n".join(lines))
    return path.with_suffix(".obj")


def as_stl(path: Path, *, mirrored: bool) -> Path:
    faces = FACES[:, ::-1] if mirrored else FACES
    corner = "vertex {} {} {}".format
    facets = [
        f"facet normal 0 0 0 outer loop {' '.join(corner(*c) for c in CORNERS[face])} endloop endfacet"
        for face in faces
    ]
    path.with_suffix(".stl").write_text("solid house\n" + "\n".join(facets) + "\nendsolid house\n")
    return path.with_suffix(".stl")


def as_gltf(path: Path, *, mirrored: bool) -> Path:
    """Z up, a node of negative scale where it is mirrored."""
    points = CORNERS * ([-1, 1, 1] if mirrored else [1, 1, 1])
    data = points.astype(np.float32).tobytes() + FACES.astype(np.uint32).tobytes()
    n_bytes = CORNERS.size * 4
    node = {"mesh": 0, "scale": [-1, 1, 1]} if mirrored else {"mesh": 0}
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [node],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(CORNERS), "type": "VEC3",
             "min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()},
            {"bufferView": 1, "componentType": 5125, "count": FACES.size, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": n_bytes},
            {"buffer": 0, "byteOffset": n_bytes, "byteLength": len(data) - n_bytes},
        ],
        "buffers": [
            {"byteLength": len(data), "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}
        ],
    }  # fmt: skip
    path.with_suffix(".gltf").write_text(json.dumps(document))
    return path.with_suffix(".gltf")


def as_usd(path: Path, *, mirrored: bool) -> Path:
    points = CORNERS * ([-1, 1, 1] if mirrored else [1, 1, 1])
    scale = 'double3 xformOp:scale = (-1, 1, 1)\nuniform token[] xformOpOrder = ["xformOp:scale"]' if mirrored else ""
    path.with_suffix(".usda").write_text(
        f"""#usda 1.0
(metersPerUnit = 1
upAxis = "Z")
def Mesh "house" {{
int[] faceVertexCounts = {[3] * len(FACES)}
int[] faceVertexIndices = {FACES.ravel().tolist()}
point3f[] points = {[tuple(p) for p in points.tolist()]}
{scale}
}}
"""
    )
    return path.with_suffix(".usda")


def level_areas_m2(survey: Survey) -> list[float]:
    """Area of level surfaces that count for each floor."""
    corners = survey.scene.vertices_m[survey.scene.triangles]
    level = np.ptp(corners[:, :, 2], axis=1) == 0
    n_floors = len(survey.floors)
    area_m2 = survey.patches.triangle_area_m2
    return [float(area_m2[level & (survey.floor_of_triangle == floor)].sum()) for floor in range(n_floors)]


@pytest.mark.parametrize("mirrored", [False, True], ids=["as wound", "mirrored"])
@pytest.mark.parametrize("write", [as_obj, as_stl, as_gltf, as_usd])
def test_sheet_slab_is_ground_above_and_ceiling_below(
    tmp_path: Path, write: Callable[..., Path], mirrored: bool
) -> None:
    scene = load_scene(
        write(tmp_path / "house", mirrored=mirrored), options=LoadOptions(metres_per_unit=1.0, up_axis=UpAxis.Z)
    )
    survey = make_survey(scene, SETTINGS)
    room_m2 = WIDE_M * DEEP_M
    assert level_areas_m2(survey) == pytest.approx([2 * room_m2] * 2)
    engine = open_engine(survey.scene, survey.patches, engine="open3d")
    middle = np.array([[WIDE_M / 2, DEEP_M / 3, z] for z in (1.5, 4.5)])
    hits = engine.cast_rays(middle, np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]), range_max_m=10.0)
    assert hits.range_m == pytest.approx([1.5, 1.5], abs=0.003)
    assert survey.floor_of_triangle[hits.triangle].tolist() == [0, 1]
    assert survey.scene.element_of_triangle[hits.triangle].tolist() == [0, 0]


@pytest.mark.slow
def test_mirrored_open_shell_of_a_slab_has_its_ceiling() -> None:
    """75.1 m2 of sheet around the stairs' opening, and the roof's underside."""
    scene = load_scene(reality("mirrored_open_slab.ifc"))
    survey = make_survey(scene, SETTINGS)
    added = slice(scene.n_triangles, None)
    names = {survey.scene.elements[i].name for i in survey.scene.element_of_triangle[added].tolist()}
    assert names == {"shell slab OG"}
    assert survey.patches.triangle_area_m2[added].sum() == pytest.approx(75.1, abs=0.1)
    assert set(survey.floor_of_triangle[added].tolist()) == {0}


def solid_house(*parts: tuple[object, ...]) -> Scene:
    slabs = [("slab", "IfcSlab", -1, (0, 0, z - 0.2), (8, 6, z)) for z in (0.0, 3.0, 6.2)]
    return scene_of([*slabs, *four_walls(8, 6, 0.0, 2.8, -1), *four_walls(8, 6, 3.0, 6.0, -1), *parts])


@pytest.mark.parametrize(
    "parts",
    [
        pytest.param((), id="solid slabs"),
        pytest.param((("void slab", "IfcSlab", -1, (0, 0, 2.2), (8, 6, 2.25)),), id="a ceiling under the slab"),
    ],
)
def test_slab_with_an_underside_of_its_own_gets_no_second_one(parts: tuple[tuple[object, ...], ...]) -> None:
    scene = solid_house(*parts)
    assert make_survey(scene, SETTINGS).scene.n_triangles == scene.n_triangles


def test_sheet_on_the_earth_has_no_underside() -> None:
    scene = scene_from_arrays(CORNERS, FACES)
    survey = make_survey(scene, SETTINGS)
    assert survey.scene.n_triangles == scene.n_triangles + 2  # of the level between the rooms alone


def test_method_paper_counts_a_sheet_once_from_either_side() -> None:
    scene = scene_from_arrays(CORNERS, FACES)
    settings = PlanSettings(scanner=SETTINGS.scanner, max_patch_area_m2=1.0, method=Paper())
    assert make_survey(scene, settings).scene.n_triangles == scene.n_triangles

"""The USD stage, opened again: valid, whole when moved, as the plan says, and flat where the browser needs it."""

import dataclasses
import shutil
from collections import Counter
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Kind, Sdf, Usd, UsdGeom, UsdShade, UsdValidation

from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import Element, Georeference, Link, Plan, Scene
from planner_core.plan_folder.face_results import face_results
from planner_core.plan_folder.palette import (
    NEUTRAL,
    NOT_ACHIEVABLE,
    NOT_REQUIRED,
    SEEN_OFTEN,
    SEEN_ONCE,
    SEEN_TWICE,
    UNSEEN,
    face_colour_index,
    linear_from_srgb,
)
from planner_core.plan_folder.sdf_authoring import new_layer
from planner_core.plan_folder.usd_building import VARIANTS
from planner_core.plan_folder.usd_names import MAX_SIBLINGS, mesh_places, prim_name
from planner_core.plan_folder.usd_stage import write_heatmaps, write_stage
from planner_core.plan_folder.usd_stations import author_stations
from planner_core.plan_folder.viewer_layers import layers_of

VIEWS = ("plan.usda", "viewer/stage.usdc")
BROWSER_TYPES = {
    "string", "token", "int", "double", "float[]", "int[]", "token[]", "matrix4d", "bool",
    "point3f[]", "float3[]", "color3f[]",
}  # fmt: skip


@cache  # prims die with their stage, so something has to hold it
def opened(folder: Path, name: str) -> Usd.Stage:
    return Usd.Stage.Open(str(folder / name))


def meshes(stage: Usd.Stage) -> list[Usd.Prim]:
    """Those of the building."""
    tripods = Sdf.Path("/Plan/Stations")
    return [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh) and not prim.GetPath().HasPrefix(tripods)]


def per_face(stage: Usd.Stage, name: str, n_triangles: int) -> np.ndarray:
    """The values of a uniform primvar, back in the order of the scene's triangles."""
    values = np.full(n_triangles, -99.0)
    for prim in meshes(stage):
        faces = np.array(prim.GetAttribute("primvars:tlsplan:triangle").Get())
        values[faces] = np.array(prim.GetAttribute(f"primvars:tlsplan:{name}").Get())
    return values


@pytest.mark.parametrize("name", VIEWS)
def test_stage_has_no_validation_errors(plan_folder: Path, name: str) -> None:
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) > 10
    errors = UsdValidation.ValidationContext(validators).Validate(opened(plan_folder, name))
    assert [f"{error.GetName()}: {error.GetMessage()}" for error in errors] == []


def to_switch(folder: Path) -> Usd.Stage:
    """The stage, to choose variants of: they go to a layer of its own, as all who open a file share its layers."""
    stage = Usd.Stage.Open(str(folder / "plan.usda"))
    stage.SetEditTarget(stage.GetSessionLayer())
    return stage


def shown_colours(stage: Usd.Stage, heatmap: str, n_triangles: int) -> np.ndarray:
    """(T, 3) what the material shows on each face with a variant chosen: of the primvar that it reads."""
    stage.GetDefaultPrim().GetVariantSet("heatmap").SetVariantSelection(heatmap)
    reader = UsdShade.Shader(stage.GetPrimAtPath("/Plan/Looks/Surface/Colour"))
    shown = np.full((n_triangles, 3), np.nan)
    for prim in meshes(stage):
        primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(reader.GetInput("varname").Get())
        faces = np.array(prim.GetAttribute("primvars:tlsplan:triangle").Get())
        shown[faces] = np.array(primvar.ComputeFlattened())
    return shown


def test_each_heat_map_shows_its_own_figure_of_the_faces(plan: Plan, plan_folder: Path) -> None:
    stage, n_triangles = to_switch(plan_folder), plan.survey.scene.n_triangles
    assert stage.GetDefaultPrim().GetVariantSet("heatmap").GetVariantSelection() == "seen"
    first = plan.survey.patches.first_patch
    shown = {name: shown_colours(stage, name, n_triangles) for name in VARIANTS}
    np.testing.assert_allclose(
        shown["plain"], np.broadcast_to(linear_from_srgb(np.array(NEUTRAL)), (n_triangles, 3)), rtol=1e-6
    )
    root = stage.GetDefaultPrim()
    for layer in layers_of(plan.settings.scanner):
        steps = np.frombuffer((plan_folder / "viewer" / layer.file).read_bytes(), dtype="<u2")
        primvar = VARIANTS[layer.id]
        high = root.GetAttribute(f"tlsplan:{primvar}High").Get()
        assert root.GetAttribute(f"tlsplan:{primvar}Unit").Get() == layer.unit
        told: dict[int, tuple[float, ...]] = {}
        for triangle in range(n_triangles):
            patches = np.arange(first[triangle], first[triangle + 1])
            known = steps[patches][steps[patches] != 65535] * layer.step
            colour = tuple(shown[layer.id][triangle])
            if known.size:
                told.setdefault(min(int(known.mean() / high * 16 + 1e-9), 15), colour)
                assert told[min(int(known.mean() / high * 16 + 1e-9), 15)] == colour
            else:
                expected = UNSEEN if plan.achievable[patches].any() else NOT_ACHIEVABLE
                np.testing.assert_allclose(colour, linear_from_srgb(np.array(expected)), rtol=1e-6)
        assert len(set(told.values())) == len(told) > 3
        lightness = [np.dot(told[step], (0.21, 0.72, 0.07)) for step in sorted(told)]
        assert lightness == sorted(lightness, reverse=True)  # near, fine and steep are light


def test_times_seen_heat_map_counts_stations(plan: Plan, plan_folder: Path) -> None:
    stage, n_triangles = to_switch(plan_folder), plan.survey.scene.n_triangles
    shown = shown_colours(stage, "times_seen", n_triangles)
    times = np.maximum.reduceat(plan.times_seen, plan.survey.patches.first_patch[:-1])
    reachable = np.logical_or.reduceat(plan.achievable, plan.survey.patches.first_patch[:-1])
    for number, colour in enumerate((UNSEEN, SEEN_ONCE, SEEN_TWICE, SEEN_OFTEN)):
        faces = reachable & (np.minimum(times, 3) == number)
        np.testing.assert_allclose(
            shown[faces], np.broadcast_to(linear_from_srgb(np.array(colour)), (faces.sum(), 3)), rtol=1e-6
        )
    assert np.unique(shown, axis=0).shape[0] > 2


def test_faces_that_need_not_be_covered_have_a_colour_of_their_own_in_every_heat_map(
    plan: Plan, plan_folder: Path, tmp_path: Path
) -> None:
    n_triangles, patches = plan.survey.scene.n_triangles, plan.survey.patches
    spared_faces = np.arange(n_triangles) % 2 == 0
    # Of one face a single patch is to be covered: that makes it a face that is.
    partly = int(np.flatnonzero(spared_faces & (patches.depth > 0))[0])
    required = ~spared_faces[patches.triangle_of_patch]
    required[patches.first_patch[partly]] = True
    spared_faces[partly] = False
    spared = dataclasses.replace(plan, required=required)
    folder = Path(shutil.copytree(plan_folder, tmp_path / "spared"))
    write_stage(spared, face_results(spared, np.full(patches.n_patches, np.inf)), folder)
    write_heatmaps(spared, folder)
    before, after = to_switch(plan_folder), to_switch(folder)
    for name in set(VARIANTS) - {"plain"}:
        shown = shown_colours(after, name, n_triangles)
        pale = linear_from_srgb(np.array(NOT_REQUIRED))
        np.testing.assert_allclose(shown[spared_faces], np.broadcast_to(pale, (spared_faces.sum(), 3)), rtol=1e-6)
        others = shown_colours(before, name, n_triangles)
        np.testing.assert_array_equal(shown[~spared_faces], others[~spared_faces])
        assert not np.isclose(others, pale, rtol=1e-6).all(axis=1).any()


def test_plan_says_what_it_is_and_links_are_drawn_when_asked_for(plan_folder: Path) -> None:
    stage = opened(plan_folder, "plan.usda")
    assert "scene = local + tlsplan:offset" in stage.GetRootLayer().documentation
    assert UsdGeom.Imageable(stage.GetPrimAtPath("/Plan/Links/Link_0")).ComputePurpose() == "guide"
    assert UsdGeom.Imageable(stage.GetPrimAtPath("/Plan/Routes/F0")).ComputePurpose() == "default"


def test_each_station_stands_on_a_tripod_down_to_its_ground(plan: Plan, plan_folder: Path) -> None:
    stage = opened(plan_folder, "plan.usda")
    boxes = UsdGeom.BBoxCache(0, [UsdGeom.Tokens.default_])
    assert plan.stations
    for prim, station in zip(stage.GetPrimAtPath("/Plan/Stations").GetChildren(), plan.stations, strict=True):
        box = boxes.ComputeWorldBound(prim.GetChild("Tripod")).ComputeAlignedRange()
        x_m, y_m, z_m = station.position_m
        assert box.GetMin()[2] == pytest.approx(z_m - station.instrument_height_m, abs=1e-4)
        assert box.GetMax()[2] == pytest.approx(z_m + 0.15, abs=1e-4)
        assert box.GetMin()[0] < x_m < box.GetMax()[0] and box.GetMin()[1] < y_m < box.GetMax()[1]
    assert (
        not opened(plan_folder, "viewer/stage.usdc").GetPrimAtPath("/Plan/Stations").GetChildren()[0].GetChild("Tripod")
    )


def test_each_station_has_a_camera_on_the_horizon(plan: Plan, plan_folder: Path) -> None:
    stage = opened(plan_folder, "plan.usda")
    cache = UsdGeom.XformCache()
    stations = stage.GetPrimAtPath("/Plan/Stations").GetChildren()
    assert len(stations) == len(plan.stations)
    for prim, station in zip(stations, plan.stations, strict=True):
        camera = UsdGeom.Camera(prim.GetChild("Camera"))
        matrix = cache.GetLocalToWorldTransform(camera.GetPrim())
        np.testing.assert_allclose(matrix.ExtractTranslation(), station.position_m, atol=1e-6)
        ahead, up = matrix.TransformDir((0, 0, -1)), matrix.TransformDir((0, 1, 0))
        np.testing.assert_allclose(ahead[2], 0.0, atol=1e-12)
        np.testing.assert_allclose(up, (0, 0, 1), atol=1e-12)
        assert camera.GetCamera(0).GetFieldOfView(Gf.Camera.FOVHorizontal) == pytest.approx(90.0)


@pytest.mark.parametrize("name", VIEWS)
def test_stage_is_in_metres_with_z_up(plan_folder: Path, name: str) -> None:
    stage = opened(plan_folder, name)
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    root = stage.GetDefaultPrim()
    assert root.GetPath() == "/Plan"
    assert [root.GetAttribute(f"tlsplan:offset{axis}").Get() for axis in "XYZ"] == [500000.0, 4000000.0, 100.0]


UTM_32 = Georeference(
    operation="IfcMapConversion",
    to_map=((0.8, -0.6, 0.0, 458_870.25), (0.6, 0.8, 0.0, 5_438_230.5), (0.0, 0.0, 1.0, 110.125), (0.0, 0.0, 0.0, 1.0)),
    crs_name="EPSG:25832", vertical_datum="DHHN2016",
)  # fmt: skip


def test_stage_of_a_georeferenced_scene_names_its_systems_and_the_way_there(
    plan: Plan, plan_folder: Path, tmp_path: Path
) -> None:
    scene = dataclasses.replace(plan.survey.scene, georeference=UTM_32)
    located = dataclasses.replace(plan, survey=dataclasses.replace(plan.survey, scene=scene))
    no_ranges = np.full(plan.survey.patches.n_patches, np.inf)
    folders = [Path(shutil.copytree(plan_folder, tmp_path / name)) for name in ("without heat maps", "with them")]
    for folder in folders:
        write_stage(located, face_results(located, no_ranges), folder)
    write_heatmaps(located, folders[1])
    for folder in folders:
        stage = Usd.Stage.Open(str(folder / "plan.usda"))
        told = stage.GetRootLayer().customLayerData["tlsplan"]
        assert told["crs"] == "EPSG:25832"
        assert told["verticalCrs"] == "EPSG:7837"
        assert told["coordinates"] == "EPSG:25832 ETRS89 / UTM zone 32N; heights EPSG:7837 DHHN2016 height"
        assert (
            np.array(told["sceneToSite"].split(), dtype=float).reshape(4, 4).tolist()
            == np.array(UTM_32.to_map).tolist()
        )
        validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
        errors = UsdValidation.ValidationContext(validators).Validate(stage)
        assert [error.GetMessage() for error in errors] == []


def test_stage_of_a_scene_without_a_place_says_so(plan_folder: Path) -> None:
    told = opened(plan_folder, "plan.usda").GetRootLayer().customLayerData["tlsplan"]
    assert told == {
        "coordinates": "scene coordinates, no CRS", "crs": "", "verticalCrs": "",
        "sceneToSite": "1.0 0.0 0.0 0.0 0.0 1.0 0.0 0.0 0.0 0.0 1.0 0.0 0.0 0.0 0.0 1.0",
    }  # fmt: skip


def test_offset_of_the_full_stage_is_one_vector_too(plan_folder: Path) -> None:
    root = opened(plan_folder, "plan.usda").GetDefaultPrim()
    assert root.GetAttribute("tlsplan:offset").Get() == Gf.Vec3d(500000, 4000000, 100)


@pytest.mark.parametrize("name", VIEWS)
def test_meshes_hold_every_triangle_of_the_scene_once_at_its_place(plan: Plan, plan_folder: Path, name: str) -> None:
    scene = plan.survey.scene
    corners = np.full((scene.n_triangles, 3, 3), np.nan)
    seen: Counter[int] = Counter()
    for prim in meshes(opened(plan_folder, name)):
        mesh = UsdGeom.Mesh(prim)
        assert set(mesh.GetFaceVertexCountsAttr().Get()) == {3}
        faces = np.array(prim.GetAttribute("primvars:tlsplan:triangle").Get())
        seen.update(faces.tolist())
        corners[faces] = np.array(mesh.GetPointsAttr().Get())[np.array(mesh.GetFaceVertexIndicesAttr().Get())].reshape(
            -1, 3, 3
        )
        points = np.array(mesh.GetPointsAttr().Get())
        np.testing.assert_array_equal(np.array(mesh.GetExtentAttr().Get()), [points.min(axis=0), points.max(axis=0)])
    assert seen == Counter(range(scene.n_triangles))
    np.testing.assert_array_equal(corners, scene.vertices_m[scene.triangles].astype(np.float32))


@pytest.mark.parametrize("name", VIEWS)
def test_elements_keep_name_kind_and_id(plan: Plan, plan_folder: Path, name: str) -> None:
    found = {}
    for prim in meshes(opened(plan_folder, name)):
        texts = [prim.GetAttribute(f"tlsplan:{key}").Get() for key in ("name", "kind", "sourceId")]
        found[prim.GetAttribute("tlsplan:element").Get()] = texts
    assert found == {
        i: [e.name, e.kind, e.source_id] for i, e in enumerate(plan.survey.scene.elements) if e.name != "Empty"
    }


@pytest.mark.parametrize("name", VIEWS)
def test_coverage_primvars_are_what_the_patches_say(plan: Plan, plan_folder: Path, name: str) -> None:
    stage, n_triangles = opened(plan_folder, name), plan.survey.scene.n_triangles
    coverage, times, ground = np.full(n_triangles, -1.0), np.zeros(n_triangles), np.zeros(n_triangles)
    first = plan.survey.patches.first_patch
    for triangle in range(n_triangles):
        patches = np.arange(first[triangle], first[triangle + 1])
        achievable = patches[plan.achievable[patches]]
        if achievable.size:
            coverage[triangle] = (plan.times_seen[achievable] > 0).sum() / achievable.size
        times[triangle] = plan.times_seen[patches].max()
    for index, floor in enumerate(plan.survey.floors):
        ground[floor.ground_triangles] = index + 1
    np.testing.assert_allclose(per_face(stage, "coverage", n_triangles), coverage, rtol=1e-6)
    np.testing.assert_array_equal(per_face(stage, "timesSeen", n_triangles), times)
    np.testing.assert_array_equal(per_face(stage, "floorIndex", n_triangles), ground)
    np.testing.assert_array_equal(per_face(stage, "firstPatch", n_triangles), first[:-1])
    np.testing.assert_array_equal(per_face(stage, "patchDepth", n_triangles), plan.survey.patches.depth)
    assert 0 < (coverage == -1).sum() < n_triangles
    assert ((coverage > 0) & (coverage < 1)).any()


def test_best_range_is_the_shortest_return_on_each_face(plan: Plan, engine: ScanEngine, plan_folder: Path) -> None:
    scans = engine.scan(plan.survey.template, np.array([station.position_m for station in plan.stations]))
    n_triangles = plan.survey.scene.n_triangles
    shortest_m = np.full(n_triangles, np.inf)
    np.minimum.at(shortest_m, scans.triangle[scans.triangle >= 0], scans.range_m[scans.triangle >= 0])
    shown_m = per_face(opened(plan_folder, VIEWS[1]), "bestRange", n_triangles)
    np.testing.assert_array_equal(shown_m == -1.0, np.isinf(shortest_m))
    seen = np.isfinite(shortest_m)
    # Of a patch it is the mean of its returns, so that a face is at most a patch's diagonal nearer.
    assert (shown_m[seen] >= shortest_m[seen] - 1e-6).all()
    assert (shown_m[seen] <= shortest_m[seen] + 2 * plan.settings.max_patch_area_m2**0.5).all()


@pytest.mark.parametrize("name", VIEWS)
def test_display_colour_is_indexed_a_face_and_follows_coverage(plan_folder: Path, name: str) -> None:
    colours: dict[int, set[tuple[float, ...]]] = {}
    for prim in meshes(opened(plan_folder, name)):
        primvar = UsdGeom.PrimvarsAPI(prim).GetPrimvar("displayColor")
        assert primvar.IsIndexed()
        assert primvar.GetInterpolation() == "uniform"
        coverage = np.array(prim.GetAttribute("primvars:tlsplan:coverage").Get())
        shown = np.array(primvar.ComputeFlattened())
        assert len(shown) == len(coverage)
        for index, colour in zip(face_colour_index(coverage), shown, strict=True):
            colours.setdefault(int(index), set()).add(tuple(colour))
    assert {index: len(seen) for index, seen in colours.items()} == dict.fromkeys(colours, 1)
    assert len(set.union(*colours.values())) == len(colours) > 3


@pytest.mark.parametrize("name", VIEWS)
def test_stations_stand_at_their_sensors_with_their_figures(plan: Plan, plan_folder: Path, name: str) -> None:
    stage = opened(plan_folder, name)
    parent = stage.GetPrimAtPath("/Plan/Stations")
    assert [prim.GetName() for prim in parent.GetChildren()] == ["S001", "S002", "S003"]
    for prim, station in zip(parent.GetChildren(), plan.stations, strict=True):
        at = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default()).ExtractTranslation()
        np.testing.assert_allclose(at, station.position_m)
        assert prim.GetAttribute("tlsplan:order").Get() == station.order
        assert prim.GetAttribute("tlsplan:floorId").Get() == station.floor
        assert prim.GetAttribute("tlsplan:instrumentHeight").Get() == station.instrument_height_m
        assert (plan_folder / "viewer" / prim.GetAttribute("tlsplan:cloudUri").Get()).is_file()
        assert Kind.Registry.IsA(Usd.ModelAPI(prim).GetKind(), "component")


def test_every_link_is_a_line_of_its_own_between_its_stations(plan: Plan, plan_folder: Path) -> None:
    stage = opened(plan_folder, "plan.usda")
    at = {station.id: station.position_m for station in plan.stations}
    prims = list(stage.GetPrimAtPath("/Plan/Links").GetChildren())
    assert [prim.GetAttribute("tlsplan:overlap").Get() for prim in prims] == [link.overlap for link in plan.links]
    for prim, link in zip(prims, plan.links, strict=True):
        assert [prim.GetAttribute(f"tlsplan:station{end}").Get() for end in "AB"] == [link.a, link.b]
        np.testing.assert_allclose(prim.GetAttribute("points").Get(), [at[link.a], at[link.b]], atol=1e-6)


def test_links_of_stations_whose_joined_names_are_equal_stay_apart(plan: Plan) -> None:
    ids = ("A", "A_B", "B_C", "C")
    stations = tuple(
        dataclasses.replace(plan.stations[0], id=name, position_m=np.array([float(n), 1.0, 1.5]))
        for n, name in enumerate(ids)
    )
    links = (Link("A", "B_C", 0.5, 0.12345678901234567), Link("A_B", "C", 0.25, 0.1 + 1e-12))
    layer = new_layer()
    author_stations(layer, dataclasses.replace(plan, stations=stations, links=links), flat=False)
    prims = list(layer.GetPrimAtPath("/Plan/Links").nameChildren)
    assert [prim.attributes["tlsplan:overlap"].default for prim in prims] == [0.5, 0.25]
    # To what every processor computes alike.
    assert [prim.attributes["tlsplan:strength"].default for prim in prims] == [0.123457, 0.1]
    assert [prim.attributes["points"].default[0][0] for prim in prims] == [0.0, 1.0]


@pytest.mark.parametrize("name", VIEWS)
def test_floors_end_where_the_next_begins(plan_folder: Path, name: str) -> None:
    floors = opened(plan_folder, name).GetPrimAtPath("/Plan/Floors").GetChildren()
    spans = [(f.GetAttribute("tlsplan:elevation").Get(), f.GetAttribute("tlsplan:top").Get()) for f in floors]
    assert spans == [(0.0, 2.8), (2.8, 5.6)]


def test_clouds_are_payloads_whose_points_lie_on_the_scene(plan: Plan, engine: ScanEngine, plan_folder: Path) -> None:
    stage = opened(plan_folder, "plan.usda")
    stage.Unload()
    assert not stage.GetPrimAtPath("/Plan/Stations/S001/Cloud").GetAttribute("points").Get()
    stage.Load()
    points = UsdGeom.Points(stage.GetPrimAtPath("/Plan/Stations/S003/Cloud"))
    local = np.array(points.GetPointsAttr().Get(), dtype=np.float64)
    assert len(local) > 1000
    origin = plan.stations[2].position_m
    hits = engine.cast_rays(np.broadcast_to(origin, local.shape), local, range_max_m=10.0)
    np.testing.assert_allclose(hits.range_m, np.linalg.norm(local, axis=1), atol=2e-4)


def test_moved_folder_still_composes(plan_folder: Path, tmp_path: Path) -> None:
    moved = tmp_path / "elsewhere" / "plan"
    shutil.copytree(plan_folder, moved)
    stage = opened(moved, "plan.usda")
    assert list(stage.GetCompositionErrors()) == []
    used = {Path(layer.realPath).resolve() for layer in stage.GetUsedLayers() if layer.realPath}
    assert len(used) == 9  # root, review, heat maps, results, stations, building and three clouds
    assert [path for path in used if not path.is_relative_to(moved.resolve())] == []


def test_review_layer_is_the_strongest(plan_folder: Path, tmp_path: Path) -> None:
    shutil.copytree(plan_folder, tmp_path / "plan")
    review = tmp_path / "plan" / "review.usda"
    change = 'over "Plan"\n{\nover "Stations"\n{\nover "S001"\n{\nint tlsplan:order = 9\n}\n}\n}\n'
    review.write_text(review.read_text() + change)
    stage = opened(tmp_path / "plan", "plan.usda")
    assert stage.GetPrimAtPath("/Plan/Stations/S001").GetAttribute("tlsplan:order").Get() == 9


def test_browser_stage_keeps_to_what_a_thin_reader_can_read(plan_folder: Path) -> None:
    stage = opened(plan_folder, "viewer/stage.usdc")
    assert len(stage.GetUsedLayers(includeClipLayers=True)) == 2  # itself and the session layer
    types = {"Xform", "Scope", "Mesh", "Material", "Shader", "Sphere"}
    for prim in stage.TraverseAll():
        assert prim.GetTypeName() in types
        assert len(prim.GetChildren()) <= MAX_SIBLINGS
        assert not prim.IsInstanceable()
        for attribute in prim.GetAttributes():
            if attribute.HasAuthoredValue():
                assert str(attribute.GetTypeName()) in BROWSER_TYPES, attribute.GetPath()
                if attribute.GetTypeName() in ("int", "int[]"):
                    assert np.min(attribute.Get()) >= 0, attribute.GetPath()
        if prim.IsA(UsdGeom.Xformable):
            assert len(UsdGeom.Xformable(prim).GetOrderedXformOps()) == 1


def test_one_material_is_bound_at_the_root_and_shows_display_colour(plan_folder: Path) -> None:
    stage = opened(plan_folder, "plan.usda")
    bound = [prim for prim in stage.TraverseAll() if prim.GetRelationship("material:binding").HasAuthoredTargets()]
    assert [str(prim.GetPath()) for prim in bound] == ["/Plan"]
    material, _ = UsdShade.MaterialBindingAPI(meshes(stage)[0]).ComputeBoundMaterial()
    surface, _, _ = material.ComputeSurfaceSource()
    reader = surface.GetInput("diffuseColor").GetConnectedSource()[0]
    assert UsdShade.Shader(reader.GetPrim()).GetInput("varname").Get() == "displayColor"


def test_more_elements_than_siblings_are_allowed_are_grouped() -> None:
    n = 2 * MAX_SIBLINGS + 1
    names = ("", "Wall", "1st", "Tür", "a.b", "墙")
    elements = tuple(Element(names[i % len(names)], "IfcWall", "", 0 if i % 2 else -1) for i in range(n))
    scene = Scene.__new__(Scene)
    object.__setattr__(scene, "elements", elements)
    object.__setattr__(scene, "element_of_triangle", np.arange(n, dtype=np.int32))
    places = mesh_places(scene)
    paths = [place.path for place in places]
    assert len(set(paths)) == n
    storeys = [elements[place.element].storey for place in places]
    assert storeys == sorted(storeys, reverse=True)  # those of no storey come last
    assert max(Counter(path.rsplit("/", 1)[0] for path in paths).values()) <= MAX_SIBLINGS
    assert all(part.isascii() and part.isidentifier() for path in paths for part in path[1:].split("/"))


@pytest.mark.parametrize("text", ["", "  ", "07", "Ünï", "x" * 200, "a/b:c"])
def test_prim_name_is_empty_or_an_identifier(text: str) -> None:
    name = prim_name(text)
    assert name == "" or (name.isidentifier() and name.isascii() and len(name) < 60)

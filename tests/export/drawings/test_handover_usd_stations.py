import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdValidation

from planner_core.export.options import Options
from planner_core.export.usd_stations import write_usd_stations
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.progress import silent


@pytest.fixture(scope="module")
def stations_file(house_in_munich: PlanSource, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("usd") / "stations.usda"
    assert write_usd_stations(house_in_munich, path, Options(), silent) == ()
    return path


def test_layer_opens_alone_and_passes_all_validators(stations_file):
    stage = Usd.Stage.Open(str(stations_file))
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) > 10
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    assert [(error.GetName(), error.GetMessage()) for error in errors] == []
    assert stage.GetDefaultPrim().GetPath() == "/Plan"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    layers = stage.GetUsedLayers()
    assert [layer.realPath for layer in layers if not layer.anonymous] == [str(stations_file.resolve())]


def test_stations_are_components_at_their_sensors_with_their_figures(stations_file, house_in_munich):
    stage = Usd.Stage.Open(str(stations_file))
    group = stage.GetPrimAtPath("/Plan/Stations")
    assert len(group.GetChildren()) == len(house_in_munich.stations)
    for station in house_in_munich.stations:
        prim = stage.GetPrimAtPath(f"/Plan/Stations/{station.id}")
        assert Usd.ModelAPI(prim).GetKind() == "component"
        world = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default())
        offset_m = np.array(stage.GetPrimAtPath("/Plan").GetAttribute("tlsplan:offset").Get())
        assert np.allclose(np.array(world.ExtractTranslation()) + offset_m, station.position_m, atol=1e-9)
        assert np.array_equal(prim.GetAttribute("tlsplan:site").Get(), station.site_m)
        assert np.array_equal(prim.GetAttribute("tlsplan:siteGround").Get(), station.site_ground_m)
        assert prim.GetAttribute("tlsplan:instrumentHeight").Get() == station.instrument_height_m
        assert prim.GetAttribute("tlsplan:order").Get() == station.order
        assert prim.GetAttribute("tlsplan:floorName").Get() == station.floor_name


def test_tripods_stand_on_the_ground(stations_file, house_in_munich):
    stage = Usd.Stage.Open(str(stations_file))
    boxes = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_])
    for station in house_in_munich.stations:
        mesh = stage.GetPrimAtPath(f"/Plan/Stations/{station.id}/Tripod")
        box = boxes.ComputeWorldBound(mesh).ComputeAlignedRange()
        assert box.GetMin()[2] == pytest.approx(station.ground_m[2], abs=1e-5)
        assert box.GetMax()[2] == pytest.approx(station.position_m[2] + 0.15, abs=1e-5)
        mesh = UsdGeom.Mesh(mesh)
        assert UsdGeom.Mesh.ValidateTopology(
            mesh.GetFaceVertexIndicesAttr().Get(), mesh.GetFaceVertexCountsAttr().Get(), len(mesh.GetPointsAttr().Get())
        )[0]


def test_cameras_look_along_the_horizon_to_the_next_station(stations_file, house_in_munich):
    stage = Usd.Stage.Open(str(stations_file))
    stations = house_in_munich.stations
    for here, following in pairwise(stations):
        camera = UsdGeom.Camera(stage.GetPrimAtPath(f"/Plan/Stations/{here.id}/Camera")).GetCamera()
        frustum = camera.frustum
        assert np.allclose(frustum.position, here.position_m, atol=1e-9)
        view, up = np.array(frustum.ComputeViewDirection()), np.array(frustum.ComputeUpVector())
        towards = (following.position_m - here.position_m)[:2]
        if np.hypot(*towards) > 1e-6:
            assert np.allclose(view[:2], towards / np.hypot(*towards), atol=1e-9)
        assert view[2] == pytest.approx(0)
        assert np.allclose(up, [0, 0, 1])
        assert camera.GetFieldOfView(Gf.Camera.FOVHorizontal) == pytest.approx(90, abs=1e-3)


def test_layer_says_its_coordinate_system(stations_file, house_in_munich):
    told = Sdf.Layer.FindOrOpen(str(stations_file)).customLayerData["tlsplan"]
    assert told["crs"] == "EPSG:25832"
    assert told["verticalCrs"] == "EPSG:7837"
    matrix = np.array([float(value) for value in told["sceneToSite"].split()]).reshape(4, 4)
    assert np.array_equal(matrix, house_in_munich.frame.matrix)


def test_laid_over_the_plan_it_adds_to_the_stations_there(stations_file, house_folder, house, tmp_path):
    over = Sdf.Layer.CreateNew(str(tmp_path / "over.usda"))
    over.subLayerPaths[:] = [str(stations_file), str(house_folder / "plan.usda")]
    over.Save()
    stage = Usd.Stage.Open(str(tmp_path / "over.usda"), Usd.Stage.LoadNone)
    prims = stage.GetPrimAtPath("/Plan/Stations").GetChildren()
    assert len(prims) == len(house.stations)
    for prim in prims:
        assert {"Marker", "Tripod", "Camera"} <= {child.GetName() for child in prim.GetChildren()}


def test_far_scene_keeps_its_digits_by_the_offset(house, tmp_path):
    offset_m = np.array([691_000.25, 5_336_000.5, 515.0])
    far = tuple(replace(each, position_m=each.position_m + offset_m) for each in house.stations)
    scene = {**house.document["scene"], "offset": offset_m.tolist()}
    write_usd_stations(
        replace(house, stations=far, document={**house.document, "scene": scene}),
        tmp_path / "far.usda",
        Options(),
        silent,
    )
    stage = Usd.Stage.Open(str(tmp_path / "far.usda"))
    world = UsdGeom.Xformable(stage.GetPrimAtPath(f"/Plan/Stations/{far[0].id}")).ComputeLocalToWorldTransform(0)
    local_m = np.array(world.ExtractTranslation())
    assert np.abs(local_m).max() < 100
    assert np.allclose(local_m + offset_m, far[0].position_m, rtol=0, atol=1e-8)


def test_ids_that_are_no_names_become_ones_and_unknown_heights_stay_unknown(house, tmp_path):
    odd = replace(house.stations[0], id="7 / Süd", instrument_height_m=math.nan)
    write_usd_stations(replace(house, stations=(odd,)), tmp_path / "odd.usda", Options(), silent)
    stage = Usd.Stage.Open(str(tmp_path / "odd.usda"))
    (prim,) = stage.GetPrimAtPath("/Plan/Stations").GetChildren()
    assert prim.GetAttribute("tlsplan:stationId").Get() == "7 / Süd"
    assert not prim.HasAttribute("tlsplan:instrumentHeight")
    assert not prim.HasAttribute("tlsplan:siteGround")
    camera = UsdGeom.Camera(stage.GetPrimAtPath(f"{prim.GetPath()}/Camera")).GetCamera()
    assert np.allclose(camera.frustum.ComputeViewDirection(), [0, 1, 0])

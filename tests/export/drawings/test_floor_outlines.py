"""Floors of GeoJSON and KML, read back with GDAL: their area against the triangles of the ground, by GEOS."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyogrio
import pytest
import shapely

from planner_core.export.floor_outlines import BOUNDS, GROUND, nested, outlines_of
from planner_core.export.geojson import write_geojson
from planner_core.export.kml import write_kml
from planner_core.export.options import Options
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.progress import silent
from planner_core.scene.floors import find_floors
from planner_core.scene.load import load_scene


@pytest.fixture(scope="module")
def ground(house_file: Path) -> list[Any]:
    """The ground of each floor, scene frame: GEOS' union of its triangles, from the scene file itself."""
    scene = load_scene(house_file)
    return [
        shapely.union_all(
            shapely.polygons(scene.vertices_m[scene.triangles[floor.ground_triangles]][:, :, :2] + scene.offset_m[:2])
        )
        for floor in find_floors(scene).floors
    ]


def floors_of(path: Path, **asked: Any) -> list[Any]:
    """The geometries of floors, as GDAL reads them."""
    meta, _, geometry, columns = pyogrio.raw.read(path, **asked)
    fields = dict(zip(meta["fields"], columns, strict=True))
    chosen = fields["kind"] == "floor" if "kind" in fields else np.ones(len(geometry), dtype=np.bool_)
    return [*shapely.from_wkb(geometry[chosen])]


@pytest.mark.slow
def test_floors_are_the_ground_with_its_openings(house: PlanSource, ground: list[Any], tmp_path: Path) -> None:
    path = tmp_path / "out.geojson"
    write_geojson(house, path, Options(geojson_crs="local"), silent)
    floors = floors_of(path)
    assert len(floors) == len(ground) == 2
    for found, truth in zip(floors, ground, strict=True):
        assert found.is_valid
        assert found.area == pytest.approx(truth.area, abs=1e-6)
        assert shapely.symmetric_difference(found, truth).area < 1e-6
    assert [len(floor.interiors) for floor in floors] == [0, 1]  # the stairs' opening
    assert floors[1].area == pytest.approx(80.0 - 1.0 * 3.12)


@pytest.mark.slow
def test_outer_rings_run_counter_clockwise_and_openings_clockwise(house: PlanSource, tmp_path: Path) -> None:
    path = tmp_path / "out.geojson"
    write_geojson(house, path, Options(geojson_crs="local"), silent)
    upper = floors_of(path)[1]
    assert shapely.is_ccw(upper.exterior)
    assert [shapely.is_ccw(ring) for ring in upper.interiors] == [False]


@pytest.mark.slow
def test_areas_on_earth_are_those_of_the_scene(house_in_munich: PlanSource, ground: list[Any], tmp_path: Path) -> None:
    import pyproj

    path = tmp_path / "out.geojson"
    write_geojson(house_in_munich, path, Options(), silent)
    for found, truth in zip(floors_of(path), ground, strict=True):
        on_earth_m2, _ = pyproj.Geod(ellps="GRS80").geometry_area_perimeter(found)
        assert on_earth_m2 == pytest.approx(truth.area, rel=1.5e-3)  # of the grid's scale, squared
        assert on_earth_m2 > 0


def test_kml_has_the_same_floors(house_in_munich: PlanSource, tmp_path: Path) -> None:
    write_geojson(house_in_munich, tmp_path / "out.geojson", Options(), silent)
    write_kml(house_in_munich, tmp_path / "out.kml", Options(), silent)
    in_kml = floors_of(tmp_path / "out.kml", layer="floors")
    for one, other in zip(in_kml, floors_of(tmp_path / "out.geojson"), strict=True):
        assert len(one.interiors) == len(other.interiors)
        assert shapely.symmetric_difference(shapely.force_2d(one), other).area < 1e-6 * other.area


def test_what_is_said_of_an_outline_is_what_it_is(house: PlanSource, ground: list[Any]) -> None:
    outlines, remarks = outlines_of(house, house.floors)
    assert remarks == ()
    assert [outlines[floor.id].made_of for floor in house.floors] == [GROUND, GROUND]
    assert [outlines[floor.id].area_m2 for floor in house.floors] == pytest.approx([each.area for each in ground])


def test_without_a_stage_floors_are_rectangles_and_remarks_say_so(house: PlanSource, tmp_path: Path) -> None:
    bare = replace(house, folder=tmp_path)
    outlines, (remark,) = outlines_of(bare, bare.floors)
    assert [outlines[floor.id].made_of for floor in bare.floors] == [BOUNDS, BOUNDS]
    assert outlines["F1"].area_m2 == 80.0
    assert remark.startswith("floors are the rectangles around their ground: ")
    assert remark.endswith("is not in the plan folder")
    assert remark in write_geojson(bare, tmp_path / "out.geojson", Options(geojson_crs="local"), silent)


def square(x: float, y: float, size: float) -> np.ndarray:
    return np.array([[x, y], [x + size, y], [x + size, y + size], [x, y + size]])


def test_an_island_in_an_opening_is_a_polygon_of_its_own() -> None:
    rings = [square(4, 4, 2), square(0, 0, 10), square(2, 2, 6), square(20, 0, 1), square(4.5, 4.5, 1)]
    polygons = [shapely.Polygon(rings[0], rings[1:]) for rings in nested(rings)]
    assert sorted((each.area, len(each.interiors)) for each in polygons) == [(1.0, 0), (3.0, 1), (64.0, 1)]
    assert all(shapely.is_ccw(each.exterior) and not any(map(shapely.is_ccw, each.interiors)) for each in polygons)


def test_rings_that_touch_are_sorted_alike() -> None:
    beside, inside = square(10, 10, 5), np.array([[0.0, 0.0], [6.0, 2.0], [2.0, 6.0]])  # shares a corner with the outer
    polygons = nested([square(0, 0, 10), beside, inside])
    assert [len(rings) for rings in polygons] == [2, 1]

"""State Plane systems in feet: against pyproj, and figures worked out by hand from 0.3048 m and 1200/3937 m."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
import pytest
from tlsplan.coordinates import frame_request

from planner_core.coordinates.crs import map_crs, metric_crs, vertical_crs
from planner_core.coordinates.frame import matrix_of, site_frame
from planner_core.coordinates.request import FrameRequest
from planner_core.errors import CoordinatesError
from planner_core.model import FOOT, METRE, US_SURVEY_FOOT

#: Manhattan, in US survey feet of EPSG:2263.
EAST_FT, NORTH_FT, HEIGHT_FT = 987_654.321, 211_234.567, 33.25
FOOT_US_M = 1200.0 / 3937.0
NOTHING_TOLD: dict[str, Any] = {
    "crs": "", "vertical_crs": "", "origin": None, "units": None, "rotation": None, "scale": None,
    "control_points": None, "parameters": None, "fixed_scale": False, "residual_limit": None,
    "by_site_placement": False, "scene_coordinates": False, "accept_implausible": False,
}  # fmt: skip


def plan_of(told: dict[str, Any] | None = None, unit_m: float = 1.0) -> dict[str, Any]:
    return {
        "scene": {"file": "house.ifc", "georeference": told, "metres_per_unit": unit_m},
        "floors": [{"elevation_m": 0.0, "bounds": [[0.0, 0.0], [10.0, 8.0]]}],
        "stations": [{"position": [5.0, 4.0, 1.5]}],
    }


def georeference(to_map: np.ndarray, map_unit: str) -> dict[str, Any]:
    texts = dict.fromkeys(
        ("crs_text", "description", "geodetic_datum", "vertical_datum", "map_projection", "map_zone"), ""
    )
    places = dict.fromkeys(
        ("site_latitude_deg", "site_longitude_deg", "site_elevation_m", "site_position", "true_north")
    )
    return {
        "operation": "IfcMapConversion", "to_map": to_map.tolist(), "crs_name": "EPSG:2263", "map_unit": map_unit,
        "warnings": [], **texts, **places,
    }  # fmt: skip


def asked(**told: Any) -> FrameRequest:
    return frame_request({**NOTHING_TOLD, **told})


@pytest.mark.parametrize(
    ("code", "unit", "foot_m", "east", "north"),
    [
        ("EPSG:2263", US_SURVEY_FOOT, FOOT_US_M, 987_654.321, 211_234.567),  # New York Long Island
        ("EPSG:2229", US_SURVEY_FOOT, FOOT_US_M, 6_487_000.0, 1_842_000.0),  # California zone 5
        ("EPSG:2222", FOOT, 0.3048, 700_000.0, 900_000.0),  # Arizona East
    ],
)
def test_places_on_earth_are_those_of_pyproj_in_the_foot_of_the_system(
    code: str, unit: object, foot_m: float, east: float, north: float
) -> None:
    plane, _ = map_crs(code)
    assert plane.unit is unit
    to_earth = pyproj.Transformer.from_crs(code, "EPSG:4326", always_xy=True)
    expected = to_earth.transform(east, north)
    found = plane.degrees(np.array([[east * foot_m, north * foot_m]]))[0]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11)
    back = plane.east_north(*expected)
    np.testing.assert_allclose(back, (east * foot_m, north * foot_m), rtol=0, atol=1e-4)
    assert plane.outside_m(np.array([[east * foot_m, north * foot_m]])) == 0.0


def test_the_wrong_foot_is_1_2_metres_off_at_two_million_feet() -> None:
    plane, _ = map_crs("EPSG:2229")
    feet = np.array([2_000_000.0, 2_000_000.0])
    right, wrong = (plane.degrees((feet * foot_m)[None])[0] for foot_m in (FOOT_US_M, 0.3048))
    _, _, off_m = pyproj.Geod(ellps="GRS80").inv(*right, *wrong)
    # 2 000 000 ft * 2 ppm = 4 ft = 1.2192 m in each direction; outside the zone the grid is not true to scale.
    assert np.abs(feet * (FOOT_US_M - 0.3048)) == pytest.approx(1.2192, abs=1e-4)
    assert off_m == pytest.approx(1.2192 * math.sqrt(2), rel=0.1)


@pytest.mark.parametrize("code", ["EPSG:2263", "EPSG:2222", "EPSG:2263+6360"])
def test_the_same_system_in_metres_gives_the_same_places(code: str) -> None:
    own, metric = pyproj.CRS.from_user_input(code), metric_crs(code)
    assert {axis.unit_conversion_factor for axis in metric.axis_info} == {1.0}
    assert metric.to_authority(min_confidence=100) is None
    foot_m = own.axis_info[0].unit_conversion_factor
    feet = (1_000_000.0, 200_000.0)
    expected = pyproj.Transformer.from_crs(own.sub_crs_list[0] if own.is_compound else own, "EPSG:4326").transform(
        *feet
    )
    plane = pyproj.CRS.from_wkt(metric.to_wkt("WKT1_GDAL"))
    plane = plane.sub_crs_list[0] if plane.is_compound else plane
    found = pyproj.Transformer.from_crs(plane, "EPSG:4326").transform(*(value * foot_m for value in feet))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10)


def test_heights_have_a_foot_of_their_own() -> None:
    assert vertical_crs("EPSG:6360").unit is US_SURVEY_FOOT
    assert vertical_crs("EPSG:8228").unit is FOOT
    assert vertical_crs("EPSG:5703").unit is METRE
    plane, height = map_crs("EPSG:2263+6360")
    assert (plane.unit, height and height.unit) == (US_SURVEY_FOOT, US_SURVEY_FOOT)


def test_an_origin_in_the_feet_of_its_crs_is_metres_inside_and_feet_again_when_written() -> None:
    request = asked(crs="EPSG:2263+6360", origin=f"{EAST_FT},{NORTH_FT},{HEIGHT_FT}")
    frame = site_frame(plan_of(), request)
    expected_m = np.array([EAST_FT, NORTH_FT, HEIGHT_FT]) * FOOT_US_M
    np.testing.assert_allclose(frame.matrix[:3, 3], expected_m, rtol=1e-15)
    np.testing.assert_allclose(
        frame.in_unit(frame.to_site(np.array([3.048, 0.0, 0.0]))),
        [EAST_FT + 3.048 / FOOT_US_M, NORTH_FT, HEIGHT_FT],
        rtol=0,
        atol=1e-6,
    )
    assert frame.unit is US_SURVEY_FOOT
    assert frame.crs_line == (
        "EPSG:2263 NAD83 / New York Long Island (ftUS), in US survey feet; heights EPSG:6360 NAVD88 height (ftUS)"
    )
    assert frame.in_metres().crs_line == (
        "EPSG:2263 NAD83 / New York Long Island (ftUS), in metres; heights EPSG:6360 NAVD88 height (ftUS), in metres"
    )
    assert frame.warnings == ()
    plane = pyproj.Proj("EPSG:2263")
    told = plane.get_factors(*plane(EAST_FT, NORTH_FT, inverse=True))
    on_grid = math.sqrt(told.areal_scale) / (1 + (HEIGHT_FT + 2.5) * FOOT_US_M / 6_371_000)
    (note,) = (line for line in frame.notes if line.startswith("at the site a foot on the ground is "))
    assert float(note.split()[9]) == pytest.approx(on_grid, abs=2e-7)


@pytest.mark.parametrize(
    ("told", "east_m"),
    [
        ({"origin": "1000000,200000,10"}, 1_000_000 * FOOT_US_M),
        ({"origin": "1000000,200000,10", "units": "ft"}, 304_800.0),
        ({"origin": "1000000ft,200000ftUS,3.048m"}, 304_800.0),
        ({"origin": "304800,60960,3", "units": "m"}, 304_800.0),
    ],
)
def test_numbers_without_a_unit_are_in_that_of_the_option_else_of_the_crs(told: dict[str, Any], east_m: float) -> None:
    frame = site_frame(plan_of(), asked(crs="EPSG:2263", **told))
    assert frame.matrix[0, 3] == pytest.approx(east_m, rel=1e-14)


def test_a_metric_system_may_be_written_in_feet_and_says_so() -> None:
    frame = site_frame(plan_of(), asked(crs="EPSG:25832", origin="458870,5438260,110", units="m"))
    assert frame.crs_line == "EPSG:25832 ETRS89 / UTM zone 32N; vertical datum not given"
    request = asked(crs="EPSG:25832", vertical_crs="EPSG:7837", origin="458870m,5438260m,110m", units="ft")
    frame = site_frame(plan_of(), request)
    assert frame.crs_line == "EPSG:25832 ETRS89 / UTM zone 32N, in feet; heights EPSG:7837 DHHN2016 height, in feet"
    assert frame.in_unit(np.array([0.3048, 3.048, 30.48])) == pytest.approx([1.0, 10.0, 100.0])


def test_scene_coordinates_may_be_written_in_feet() -> None:
    assert site_frame(plan_of(), asked(units="ft")).crs_line == "scene coordinates, no CRS, in feet"
    assert site_frame(plan_of(), asked(scene_coordinates=True)).crs_line == "scene coordinates, no CRS"


def test_metres_given_for_feet_are_told_with_the_unit_that_fits() -> None:
    origin = f"{EAST_FT * FOOT_US_M},{NORTH_FT * FOOT_US_M},10"
    frame = site_frame(plan_of(), asked(crs="EPSG:2263", origin=origin))
    (line,) = frame.warnings
    assert line.startswith("the plan lies at E 301054, N 64398 ftUS, ")
    assert line.endswith("taken as metres: their unit looks wrong; give US survey feet, or the unit with --units")


# ------------------------------------------------------------------------------------------- control points
def control_points(tmp_path: Path, header: str, scene_unit_m: float, site_unit_m: float) -> Path:
    """Three points, turned by 30 degrees on the grid, at `EAST_FT`, ... in US survey feet."""
    scene = np.array([[0.0, 0.0, 0.0], [30.0, 0.0, 0.0], [30.0, 20.0, 3.0]])
    turn = math.radians(30.0)
    rotation = np.array([[math.cos(turn), -math.sin(turn), 0], [math.sin(turn), math.cos(turn), 0], [0, 0, 1]])
    site_m = scene @ rotation.T + np.array([EAST_FT, NORTH_FT, HEIGHT_FT]) * FOOT_US_M
    rows = np.hstack([scene / scene_unit_m, site_m / site_unit_m]).tolist()
    path = tmp_path / "points.csv"
    lines = [f"P{number}," + ",".join(f"{value:.6f}" for value in row) for number, row in enumerate(rows)]
    path.write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("header", "scene_unit_m", "site_unit_m", "units"),
    [
        ("name,x,y,z,E,N,H", 1.0, FOOT_US_M, None),
        ("name,x_ft,y_ft,z_ft,E,N,H", 0.3048, FOOT_US_M, None),
        ("name,x,y,z,E_m,N_m,H_m", 1.0, 1.0, None),
        ("Point,X [m],Y [m],Z [m],Easting (US survey feet),Northing (USft),Elevation (ftUS)", 1.0, FOOT_US_M, "m"),
        ("name,x,y,z,E,N,H", 1.0, 0.3048, "ft"),
        ("name,x,y,z,E-us_ft,N-us_ft,H-us_ft", 1.0, FOOT_US_M, "ft"),
    ],
)  # fmt: skip
def test_control_points_are_read_in_their_units(
    tmp_path: Path, header: str, scene_unit_m: float, site_unit_m: float, units: str | None
) -> None:
    path = control_points(tmp_path, header, scene_unit_m, site_unit_m)
    frame = site_frame(plan_of(), asked(crs="EPSG:2263", control_points=path, units=units))
    np.testing.assert_allclose(
        frame.matrix[:3, 3], np.array([EAST_FT, NORTH_FT, HEIGHT_FT]) * FOOT_US_M, rtol=0, atol=2e-6
    )
    assert frame.horizontal_scale == pytest.approx(1.0, abs=1e-7)
    assert max(frame.residuals_m) < 2e-6


def test_residuals_are_told_in_the_unit_of_the_crew(tmp_path: Path) -> None:
    path = control_points(tmp_path, "name,x,y,z,E,N,H", 1.0, FOOT_US_M)
    frame = site_frame(plan_of(), asked(crs="EPSG:2263", control_points=path))
    assert any("largest residual 0.0000 ftUS" in note for note in frame.notes)


def test_control_points_in_metres_that_are_read_as_feet_are_refused(tmp_path: Path) -> None:
    path = control_points(tmp_path, "name,x,y,z,E,N,H", 1.0, 1.0)
    with pytest.raises(CoordinatesError, match=r"scale .* is 0\.3048\d*, as if one side were in feet.*E_ftUS"):
        site_frame(plan_of(), asked(crs="EPSG:2263", control_points=path))


# ------------------------------------------------------------------------------------------- map conversions
def test_a_map_conversion_in_the_other_foot_is_told_with_how_far_it_is_off() -> None:
    to_map = matrix_of((EAST_FT * 0.3048, NORTH_FT * 0.3048, 0.0), 0.0, 1.0)
    frame = site_frame(plan_of(georeference(to_map, "foot")))
    # hypot(987 654, 211 235) ft = 1 009 990 ft, and 2 ppm of that.
    assert [line for line in frame.warnings if "off by 2.02 ftUS if the file means the other foot" in line]
    assert frame.unit is US_SURVEY_FOOT
    of_project = site_frame(plan_of(georeference(to_map, ""), unit_m=0.3048))
    assert [line for line in of_project.warnings if "the other foot" in line]


@pytest.mark.parametrize(("map_unit", "unit_m"), [("us survey foot", 1.0), ("metre", 0.3048), ("", FOOT_US_M)])
def test_a_map_conversion_in_the_foot_of_its_system_or_in_metres_is_in_order(map_unit: str, unit_m: float) -> None:
    to_map = matrix_of((EAST_FT * FOOT_US_M, NORTH_FT * FOOT_US_M, 0.0), 0.0, 1.0)
    frame = site_frame(plan_of(georeference(to_map, map_unit), unit_m))
    assert not [line for line in frame.warnings if "foot" in line]

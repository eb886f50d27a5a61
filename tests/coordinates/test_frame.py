"""From a plan's document and a request to a frame: each way there, the order of who has a say, and every doubt."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from slow_cases import all_slow_but

from planner_core.coordinates.frame import georeference_of, matrix_of, site_frame
from planner_core.coordinates.request import FrameRequest
from planner_core.errors import CoordinatesError, PlanFolderError
from planner_core.model import SiteFrame

ORIGIN = (458_870.0, 5_438_260.0, 110.25)
TURN = math.radians(24.5)
TOLD: dict[str, Any] = {
    "operation": "IfcMapConversion",
    "to_map": matrix_of(ORIGIN, TURN, 1.0).tolist(),
    "crs_name": "EPSG:25832",
    "crs_text": "",
    "description": "",
    "geodetic_datum": "ETRS89",
    "vertical_datum": "DHHN2016",
    "map_projection": "UTM",
    "map_zone": "32N",
    "map_unit": "metre",
    "site_latitude_deg": 49.095814889,
    "site_longitude_deg": 8.43659043,
    "site_elevation_m": 110.25,
    "site_position": [0.0, 0.0, 0.0],
    "true_north": [math.sin(TURN + 0.00743222), math.cos(TURN + 0.00743222)],
    "warnings": [],
}
UTM = FrameRequest(crs="EPSG:25832", origin_m=ORIGIN)


def plan_of(told: dict[str, Any] | None = None, *, at: tuple[float, float] = (0.0, 0.0)) -> dict[str, Any]:
    x, y = at
    return {
        "scene": {"file": "house.ifc", "georeference": told},
        "floors": [{"elevation_m": 0.0, "bounds": [[x, y], [x + 10.0, y + 8.0]]}],
        "stations": [{"position": [x + 5.0, y + 4.0, 1.5]}],
    }


def points_file(tmp_path: Path, site: np.ndarray, scene: np.ndarray | None = None) -> Path:
    scene = CORNERS if scene is None else scene
    path = tmp_path / "points.csv"
    rows = [f"P{i}," + ",".join(map(repr, row)) for i, row in enumerate(np.hstack([scene, site]).tolist())]
    path.write_text("name,x,y,z,E,N,H\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return path


CORNERS = np.array([[0.0, 0, 0], [10, 0, 0], [10, 8, 0], [0, 8, 3]])


def only(lines: tuple[str, ...], *words: str) -> str:
    (found,) = [line for line in lines if all(word in line for word in words)]
    return found


def surely_wrong(document: dict[str, Any], asked: FrameRequest) -> tuple[str, ...]:
    """The warnings that are had where one insists; without that they are the refusal."""
    with pytest.raises(
        CoordinatesError, match=r"^coordinates: .*; --accept-implausible accepts them anyway$"
    ) as caught:
        site_frame(document, asked)
    said = str(caught.value)
    assert "\n" not in said
    warnings = site_frame(document, replace(asked, accept_implausible=True)).warnings
    assert any(line in said for line in warnings)
    return warnings


# -------------------------------------------------------------------------------------------- ways to it
@pytest.mark.parametrize("document", [plan_of(), {**plan_of(), "scene": {"file": "x.obj"}}])
def test_nothing_told_is_scene_coordinates(document: dict[str, Any]) -> None:
    frame = site_frame(document)
    assert frame.is_scene
    assert frame.matrix.tolist() == np.eye(4).tolist()
    assert frame.warnings == frame.notes == ()


def test_the_scene_file_tells_its_map_conversion() -> None:
    frame = site_frame(plan_of(TOLD))
    assert frame.source == "ifc map conversion"
    assert (frame.crs, frame.name) == ("EPSG:25832", "EPSG:25832 ETRS89 / UTM zone 32N")
    assert (frame.vertical_crs, frame.vertical_name) == ("EPSG:7837", "EPSG:7837 DHHN2016 height")
    assert frame.to_site(np.zeros(3)).tolist() == list(ORIGIN)
    assert frame.grid_north_rad == pytest.approx(TURN)
    assert frame.warnings == ()
    assert frame.place == "49.09581 N, 8.43659 E"


def test_the_user_has_the_last_word_on_the_frame() -> None:
    assert site_frame(plan_of(TOLD), FrameRequest(scene_coordinates=True)).is_scene
    frame = site_frame(plan_of(TOLD), FrameRequest(crs="EPSG:25832", origin_m=(500_000.0, 5_400_000.0, 3.0)))
    assert (frame.source, frame.to_site(np.zeros(3)).tolist()) == ("given epsg", [500_000.0, 5_400_000.0, 3.0])


def test_a_crs_alone_renames_the_file_s_and_says_so() -> None:
    same = site_frame(plan_of(TOLD), FrameRequest(crs="25832", vertical_crs="EPSG:5783"))
    assert (same.source, same.vertical_crs, same.warnings) == ("ifc map conversion", "EPSG:5783", ())
    other = site_frame(plan_of(TOLD), FrameRequest(crs="EPSG:32632"))
    assert other.crs == "EPSG:32632"
    assert only(other.warnings, "EPSG:25832", "is taken to be in", "EPSG:32632", "0.0 m from where it was")


@pytest.mark.slow
def test_a_crs_of_another_datum_is_a_warning_with_how_far() -> None:
    # ED50 and ETRS89 are about 200 m apart in UTM: which of the two the file means, its user may know better.
    (line,) = site_frame(plan_of(TOLD), FrameRequest(crs="EPSG:23032")).warnings
    found = re.search(r"is taken to be in EPSG:23032 .*, (\d+\.\d) m from where it was$", line)
    assert found
    assert 100 < float(found[1]) < 300


@pytest.mark.parametrize("crs", all_slow_but(["EPSG:25833"], ["EPSG:25833", "EPSG:31467", "EPSG:2056", "EPSG:32732"]))
def test_a_crs_of_another_zone_over_a_map_conversion_is_refused(crs: str) -> None:
    asked = FrameRequest(crs=crs)
    line = only(surely_wrong(plan_of(TOLD), asked), "is taken to be in", crs)
    assert "--crs labels coordinates and does not convert them: leave it out, or place the scene" in line
    assert site_frame(plan_of(TOLD), FrameRequest(crs=crs, accept_implausible=True)).crs == crs


@pytest.mark.slow
def test_six_degrees_between_two_zones_are_as_far_as_on_the_ground() -> None:
    line = only(surely_wrong(plan_of(TOLD), FrameRequest(crs="EPSG:25833")), "is taken to be in")
    found = re.search(r"(\d+) km from where it was", line)
    assert found
    assert int(found[1]) == pytest.approx(math.radians(6) * 6371 * math.cos(math.radians(49.096)), abs=3)


def test_a_system_that_is_not_known_keeps_the_file_s_words() -> None:
    told = {**TOLD, "crs_name": "Platform grid 7", "vertical_datum": "Doorstep"}
    frame = site_frame(plan_of(told))
    assert (frame.crs, frame.name, frame.vertical_crs, frame.vertical_name) == ("", "Platform grid 7", "", "Doorstep")
    assert only(frame.warnings, "the scene file's CRS", "Platform grid 7")
    assert only(frame.notes, "Doorstep", "is known")


def test_wkt_of_the_file_goes_before_its_name() -> None:
    from pyproj import CRS

    frame = site_frame(plan_of({**TOLD, "crs_name": "ours", "crs_text": CRS("EPSG:25832").to_wkt()}))
    assert frame.crs == "EPSG:25832"


def test_a_crs_without_anything_else_takes_scene_coordinates_as_they_are() -> None:
    frame = site_frame(plan_of(at=ORIGIN[:2]), FrameRequest(crs="EPSG:25832"))
    assert (frame.is_scene, frame.crs, frame.warnings) == (False, "EPSG:25832", ())
    assert np.array_equal(frame.matrix, np.eye(4))
    near_zero = surely_wrong(plan_of(), FrameRequest(crs="EPSG:25832"))
    assert only(near_zero, "taken as they are", "--origin")


def test_an_origin_with_turn_and_scale_is_the_textbook_s_formula() -> None:
    frame = site_frame(plan_of(), FrameRequest(origin_m=ORIGIN, rotation_rad=TURN, scale=0.9996))
    x, y, z = 7.0, 5.0, 2.0
    east = ORIGIN[0] + 0.9996 * (x * math.cos(TURN) - y * math.sin(TURN))
    north = ORIGIN[1] + 0.9996 * (x * math.sin(TURN) + y * math.cos(TURN))
    assert frame.to_site(np.array([x, y, z])) == pytest.approx([east, north, ORIGIN[2] + z], abs=1e-8)
    assert (frame.crs, frame.name) == ("", "local site coordinates")


def test_control_points_give_the_frame_and_their_residuals(tmp_path: Path) -> None:
    site = SiteFrame(matrix=matrix_of(ORIGIN, TURN, 0.9996)).to_site(CORNERS)
    site[1, 0] += 0.01
    request = FrameRequest(crs="EPSG:25832", control_points=points_file(tmp_path, site))
    frame = site_frame(plan_of(), request)
    assert frame.source == "control points"
    assert len(frame.residuals_m) == 4
    assert 0.002 < max(frame.residuals_m) < 0.01
    assert frame.residuals_m == pytest.approx(np.linalg.norm(site - frame.to_site(CORNERS), axis=1), abs=1e-8)
    assert only(frame.notes, "4 control points, 4 parameters", "sigma")
    assert frame.warnings == ()
    strict = FrameRequest(control_points=request.control_points, residual_limit_m=0.004)
    assert only(site_frame(plan_of(), strict).warnings, "control point P1 has a residual of 0.00")


def test_seven_parameters_are_had_on_demand(tmp_path: Path) -> None:
    tilt = np.eye(4)
    tilt[:3, :3] = [[1, 0, 0.01], [0, 1, 0], [-0.01, 0, 1]]
    tilt[:3, :3] /= math.sqrt(1.0001)
    tilt[1, 1] = 1.0
    tilt[:3, 3] = ORIGIN
    request = FrameRequest(control_points=points_file(tmp_path, SiteFrame(matrix=tilt).to_site(CORNERS)), parameters=7)
    frame = site_frame(plan_of(), request)
    assert np.abs(frame.matrix - tilt).max() < 1e-7
    assert only(frame.warnings, "tilt the scene by 0.573 degrees")


@pytest.mark.parametrize("wrong_m", [0.5, 500.0])
def test_the_one_wrong_point_is_named(tmp_path: Path, wrong_m: float) -> None:
    scene = np.vstack([CORNERS, [[5.0, 4.0, 1.0]]])
    site = SiteFrame(matrix=matrix_of(ORIGIN, TURN, 1.0)).to_site(scene)
    site[3, 1] += wrong_m
    request = FrameRequest(control_points=points_file(tmp_path, site, scene))
    if wrong_m < 1:
        assert only(site_frame(plan_of(), request).warnings, "without P3 all others fit to 0.000 m")
    else:
        with pytest.raises(CoordinatesError, match="P3 looks wrong"):
            site_frame(plan_of(), request)


def test_no_point_is_suspected_where_all_are_off(tmp_path: Path) -> None:
    site = SiteFrame(matrix=matrix_of(ORIGIN, TURN, 1.0)).to_site(CORNERS)
    site += np.random.default_rng(4).normal(0, 0.05, site.shape)
    warnings = site_frame(plan_of(), FrameRequest(control_points=points_file(tmp_path, site))).warnings
    assert any("has a residual of" in line for line in warnings)
    assert not any("looks wrong" in line for line in warnings)


def test_two_points_are_taken_with_a_warning(tmp_path: Path) -> None:
    site = SiteFrame(matrix=matrix_of(ORIGIN, TURN, 1.0)).to_site(CORNERS[:2])
    request = FrameRequest(control_points=points_file(tmp_path, site, CORNERS[:2]))
    assert only(site_frame(plan_of(), request).warnings, "two control points")
    three = np.array([[0.0, 0, 0], [5, 0, 0], [10, 0, 0]])
    site = SiteFrame(matrix=matrix_of(ORIGIN, TURN, 1.0)).to_site(three)
    request = FrameRequest(control_points=points_file(tmp_path, site, three))
    assert only(site_frame(plan_of(), request).warnings, "all in one line")


def test_the_site_s_place_is_used_when_asked_for() -> None:
    only_placed = {**TOLD, "operation": "", "to_map": None, "crs_name": "", "vertical_datum": ""}
    assert site_frame(plan_of(only_placed)).is_scene
    frame = site_frame(plan_of(only_placed), FrameRequest(crs="EPSG:25832", by_site_placement=True))
    assert frame.source == "ifc site placement"
    # Latitude, longitude and true north of TOLD are of the same place and turn as its map conversion.
    by_map = site_frame(plan_of(TOLD))
    assert np.abs(frame.to_site(CORNERS) - by_map.to_site(CORNERS)).max() < 1e-3
    assert only(frame.warnings, "metres or worse")


def test_the_site_s_place_is_of_its_own_position() -> None:
    there = {**TOLD, "site_position": [100.0, 50.0, 2.0]}
    frame = site_frame(plan_of(there), FrameRequest(crs="EPSG:25832", by_site_placement=True))
    assert frame.to_site(np.array([100.0, 50.0, 2.0])) == pytest.approx(ORIGIN, abs=1e-3)


# ------------------------------------------------------------------------------------------------ refusals
@pytest.mark.parametrize(
    ("request_", "told"),
    [
        (FrameRequest(origin_m=ORIGIN, scene_coordinates=True), "--origin and --scene-coordinates"),
        (FrameRequest(crs="EPSG:25832", scene_coordinates=True), "with a CRS"),
        (FrameRequest(vertical_crs="EPSG:7837"), "expected both; add --crs"),
        (FrameRequest(origin_m=ORIGIN, scale=0.001), "as if one side were in millimetres"),
        (FrameRequest(origin_m=ORIGIN, scale=0.3048), "as if one side were in feet"),
        (FrameRequest(origin_m=ORIGIN, scale=-1.0), "scale is -1, expected about 1"),
        (FrameRequest(origin_m=(math.nan, 0.0, 0.0)), "finite"),
        (FrameRequest(by_site_placement=True), "add --crs"),
        (FrameRequest(by_site_placement=True, crs="EPSG:25832"), "has no latitude"),
        (FrameRequest(control_points=Path("no-such.csv")), "no such file"),
    ],
)  # fmt: skip
def test_requests_that_make_no_sense_are_refused_in_one_line(request_: FrameRequest, told: str) -> None:
    with pytest.raises(CoordinatesError, match=told) as caught:
        site_frame(plan_of(), request_)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("size", "unit"), [(1000.0, "millimetres"), (100.0, "centimetres"), (1 / 0.3048, "feet")])
def test_control_points_in_other_units_are_refused_by_name(tmp_path: Path, size: float, unit: str) -> None:
    site = SiteFrame(matrix=matrix_of(ORIGIN, TURN, 1.0)).to_site(CORNERS)
    request = FrameRequest(control_points=points_file(tmp_path, site, CORNERS * size))
    with pytest.raises(CoordinatesError, match=unit):
        site_frame(plan_of(), request)


def test_a_place_that_the_grid_does_not_have_is_refused() -> None:
    told = {**TOLD, "site_latitude_deg": 0.0, "site_longitude_deg": 99.0}
    with pytest.raises(CoordinatesError, match="far outside"):
        site_frame(plan_of(told), FrameRequest(crs="EPSG:25832", by_site_placement=True))


@pytest.mark.parametrize("broken", [{**TOLD, "to_map": [["x"]]}, {**TOLD, "site_position": [1.0]}, 5])
def test_a_georeference_that_nobody_wrote_is_refused(broken: Any) -> None:
    with pytest.raises(PlanFolderError, match="georeference"):
        georeference_of(plan_of(broken))


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("to_map", [[1.0, 0.0, 0.0, math.nan], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]),
        ("to_map", [[1.0, 0.0], [0.0, 1.0, 0.0]]),
        ("to_map", [[1.0, 0.0, 0.0, 0.0]]),
        ("true_north", [math.inf, 1.0]),
        ("site_position", [0.0, math.nan, 0.0]),
        ("site_latitude_deg", math.nan),
        ("site_elevation_m", -math.inf),
    ],
)
def test_numbers_of_a_georeference_that_are_none_are_refused_in_one_line(key: str, value: Any) -> None:
    with pytest.raises(PlanFolderError, match=r"scene.georeference.*plan again") as caught:
        site_frame(plan_of({**TOLD, key: value}))
    assert "\n" not in str(caught.value)


# -------------------------------------------------------------------------------------------------- doubts
def test_swapped_axes_are_refused() -> None:
    asked = FrameRequest(crs="EPSG:25832", origin_m=(ORIGIN[1], ORIGIN[0], 0.0))
    assert only(surely_wrong(plan_of(), asked), "look swapped; exchange them")


def test_swapped_control_points_are_refused(tmp_path: Path) -> None:
    # Both pairs swapped: a proper fit, at a place that is none.
    site = SiteFrame(matrix=matrix_of(ORIGIN, TURN, 1.0)).to_site(CORNERS)[:, [1, 0, 2]]
    path = points_file(tmp_path, site, CORNERS[:, [1, 0, 2]])
    assert only(surely_wrong(plan_of(), FrameRequest(crs="EPSG:25832", control_points=path)), "look swapped")


@pytest.mark.parametrize(("size", "unit"), [(1000.0, "millimetres"), (1 / 0.3048, "feet"), (0.001, "kilometres")])
def test_other_units_are_refused_by_name(size: float, unit: str) -> None:
    east, north, _ = (value * size for value in ORIGIN)
    asked = FrameRequest(crs="EPSG:25832", origin_m=(east, north, 0.0))
    assert only(surely_wrong(plan_of(), asked), f"taken as {unit}", "give metres")


@pytest.mark.slow
def test_a_grid_elsewhere_is_not_taken_for_millimetres() -> None:
    asked = FrameRequest(crs="EPSG:27700", origin_m=ORIGIN)
    assert "taken as" not in only(surely_wrong(plan_of(), asked), "outside the area of")


@pytest.mark.slow
def test_a_scene_file_that_is_surely_wrong_is_refused_once_somebody_asks_for_its_coordinates() -> None:
    swapped = matrix_of((ORIGIN[1], ORIGIN[0], 0.0), TURN, 1.0).tolist()
    told = {**TOLD, "to_map": swapped, "site_latitude_deg": None}
    assert only(surely_wrong(plan_of(told), FrameRequest()), "look swapped")
    assert only(site_frame(plan_of(told)).warnings, "look swapped")  # a plan is written of it nevertheless
    assert site_frame(plan_of(told), FrameRequest(scene_coordinates=True)).is_scene


def test_a_projection_that_nobody_surveys_in_is_told() -> None:
    frame = site_frame(plan_of(), FrameRequest(crs="EPSG:3857", origin_m=(939_000.0, 6_290_000.0, 110.0)))
    assert only(frame.warnings, "% too short for EPSG:3857")
    assert site_frame(plan_of(), UTM).warnings == ()


def test_a_plan_outside_the_area_of_use_is_told_with_how_far() -> None:
    frame = site_frame(plan_of(), FrameRequest(crs="EPSG:25832", origin_m=(800_000.0, 5_438_260.0, 0.0)))
    assert only(frame.warnings, "outside the area of", "km")
    # The zone next door goes on: countries of two zones survey in one.
    beside = site_frame(plan_of(), FrameRequest(crs="EPSG:25832", origin_m=(1_200_000.0, 5_438_260.0, 0.0)))
    assert only(beside.warnings, "check origin and CRS")
    far = FrameRequest(crs="EPSG:25832", origin_m=(458_870.0, 1_000_000.0, 0.0))
    assert only(surely_wrong(plan_of(), far), "check origin and CRS")


@pytest.mark.slow
def test_coordinates_that_are_shifted_twice_are_refused() -> None:
    warnings = surely_wrong(plan_of(TOLD, at=ORIGIN[:2]), FrameRequest())
    assert only(warnings, "site coordinates already")
    with pytest.raises(CoordinatesError, match="georeferenced twice; pass --origin 0,0,0 with --crs EPSG:25832"):
        site_frame(plan_of(TOLD, at=ORIGIN[:2]), FrameRequest())


@pytest.mark.parametrize(
    "asked",
    [
        FrameRequest(crs="EPSG:25832"),
        FrameRequest(crs="EPSG:25832", origin_m=(*ORIGIN[:2], 0.0)),
        FrameRequest(crs="EPSG:25832", vertical_crs="EPSG:7837"),
    ],
    ids=["crs alone", "origin again", "with heights"],
)
def test_what_is_advised_for_coordinates_that_are_shifted_twice_is_accepted(asked: FrameRequest) -> None:
    document = plan_of(TOLD, at=ORIGIN[:2])
    with pytest.raises(CoordinatesError, match="pass --origin 0,0,0 with --crs"):
        site_frame(document, asked)
    frame = site_frame(document, replace(asked, crs="EPSG:25832", origin_m=(0.0, 0.0, 0.0)))
    assert frame.crs and not [line for line in frame.warnings if "outside" in line or "already" in line]
    np.testing.assert_array_equal(frame.to_site(np.array([[*ORIGIN[:2], 0.0]])), [[*ORIGIN[:2], 0.0]])


@pytest.mark.slow
@pytest.mark.parametrize(("longitude", "told"), [(9.5, "78 km from where"), (-171.6, "half the earth|km from where")])
def test_a_map_conversion_and_a_latitude_of_two_places_are_seen(longitude: float, told: str) -> None:
    (line,) = site_frame(plan_of({**TOLD, "site_longitude_deg": longitude})).warnings
    assert re.search(told, line)
    assert site_frame(plan_of({**TOLD, "site_longitude_deg": 8.5})).warnings == ()
    assert site_frame(plan_of({**TOLD, "site_latitude_deg": None})).warnings == ()


def test_what_the_file_doubts_is_handed_on() -> None:
    assert "odd units" in site_frame(plan_of({**TOLD, "warnings": ["odd units"]})).warnings


def test_the_distortion_at_the_site_is_told() -> None:
    note = only(site_frame(plan_of(TOLD)).notes, "a metre on the ground")
    assert "projection -379 ppm, height -17 ppm" in note
    assert "0.4258 degrees west of true north" in note
    assert "over 100 m they are 39.7 mm too long" in note
    true = 0.9996208 * 6_371_000 / 6_371_110.25
    held = site_frame(plan_of(), FrameRequest(crs="EPSG:25832", origin_m=ORIGIN, scale=true))
    assert "scene lengths" not in only(held.notes, "a metre on the ground")


def test_an_untold_height_datum_is_told() -> None:
    assert only(site_frame(plan_of(), UTM).notes, "vertical datum is not given")

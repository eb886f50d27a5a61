"""Systems by name: which are taken, which are refused and why, and what they say of a place."""

from __future__ import annotations

import math

import numpy as np
import pyproj
import pytest

from planner_core.coordinates.crs import map_crs, vertical_crs, vertical_crs_of_datum
from planner_core.errors import CoordinatesError

KARLSRUHE = np.array([[458_870.0, 5_438_260.0]])


@pytest.mark.parametrize("text", ["EPSG:25832", "25832", " epsg : 25832 ", "ETRS89 / UTM zone 32N"])
def test_a_system_is_known_by_code_and_name(text: str) -> None:
    plane, height = map_crs(text)
    assert (plane.text, plane.name, height) == ("EPSG:25832", "EPSG:25832 ETRS89 / UTM zone 32N", None)


def test_wkt_of_a_registered_system_is_named_by_its_code() -> None:
    plane, _ = map_crs(pyproj.CRS("EPSG:2056").to_wkt())
    assert plane.text == "EPSG:2056"


def test_wkt_of_a_system_of_its_own_stays_wkt() -> None:
    own = pyproj.CRS("+proj=tmerc +lat_0=49 +lon_0=8.4 +k=1 +x_0=10000 +y_0=20000 +ellps=GRS80 +units=m")
    plane, _ = map_crs(own.to_wkt())
    assert pyproj.CRS(plane.text) == own
    assert plane.name == "unnamed system (Transverse Mercator)"
    assert plane.outside_m(np.array([[10_000.0, 20_000.0]])) == 0.0


def test_a_compound_system_names_heights_too() -> None:
    plane, height = map_crs("EPSG:5555")
    assert plane.text == "EPSG:25832"
    assert height is not None
    assert height.text == "EPSG:5783"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("EPSG:4326", "geographic"),
        ("EPSG:4978", "geocentric"),
        ("EPSG:7837", "vertical"),
        ("EPSG:2314", "units of Clarke's foot, expected metres, feet"),
        ("EPSG:2053", "south and west"),
        ("EPSG:999999", "not a known coordinate reference system"),
        ("nonsense", "not a known coordinate reference system"),
        ("", "not a known coordinate reference system"),
        ("PROJCRS[" * 40, r"\.\.\.'"),
    ],
)
def test_systems_that_site_coordinates_can_not_be_in_are_refused(text: str, told: str) -> None:
    with pytest.raises(CoordinatesError, match=told) as caught:
        map_crs(text)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("text", "told"), [("EPSG:25832", "projected"), ("EPSG:5614", "vertical CRS"), ("x", "known")])
def test_systems_that_are_none_of_heights_in_metres_are_refused(text: str, told: str) -> None:
    with pytest.raises(CoordinatesError, match=told):
        vertical_crs(text)


def test_depths_are_refused() -> None:
    with pytest.raises(CoordinatesError, match="expected a vertical CRS"):
        vertical_crs("EPSG:5715")


@pytest.mark.slow
def test_words_of_a_file_name_a_datum() -> None:
    found = vertical_crs_of_datum("DHHN2016")
    assert found is not None
    assert (found.text, found.name) == ("EPSG:7837", "EPSG:7837 DHHN2016 height")
    assert vertical_crs_of_datum("the caretaker's doorstep") is None


def test_degrees_and_back_are_the_same_place() -> None:
    plane, _ = map_crs("EPSG:25832")
    longitude, latitude = plane.degrees(KARLSRUHE)[0]
    assert (longitude, latitude) == pytest.approx((8.43659, 49.09581), abs=1e-4)
    assert plane.east_north(longitude, latitude) == pytest.approx(tuple(KARLSRUHE[0]), abs=1e-3)


def test_axes_named_north_first_are_still_east_north() -> None:
    plane, _ = map_crs("EPSG:31467")  # its axes are northing, easting
    assert plane.outside_m(np.array([[3_458_870.0, 5_439_900.0]])) == 0.0
    assert plane.outside_m(np.array([[5_439_900.0, 3_458_870.0]])) > 1e5


def test_distance_outside_the_area_of_use_is_measured() -> None:
    plane, _ = map_crs("EPSG:25832")
    edge = pyproj.CRS("EPSG:25832").area_of_use.east
    assert plane.outside_m(KARLSRUHE) == 0.0
    east = plane.east_north(13.0, 50.0)
    _, _, expected = pyproj.Geod(ellps="WGS84").inv(13.0, 50.0, edge, 50.0)
    assert plane.outside_m(np.array([east])) == pytest.approx(expected, rel=1e-6)
    assert plane.outside_m(np.array([KARLSRUHE[0], east])) == pytest.approx(expected, rel=1e-6)
    assert math.isinf(plane.outside_m(np.array([[1e12, 1e12]])))


def test_an_area_of_use_across_180_degrees_holds_both_sides() -> None:
    plane, _ = map_crs("EPSG:3832")  # PDC Mercator, 98.69 E to 68 W
    for longitude, outside in ((179.0, False), (-179.0, False), (-75.0, False), (20.0, True)):
        there = np.array([plane.east_north(longitude, 10.0)])
        assert (plane.outside_m(there) > 0) == outside, longitude


def test_scale_and_convergence_are_those_of_small_steps_on_the_ellipsoid() -> None:
    plane, _ = map_crs("EPSG:25832")
    longitude, latitude = plane.degrees(KARLSRUHE)[0]
    north_lon, north_lat, _ = pyproj.Geod(ellps="GRS80").fwd(longitude, latitude, 0.0, 100.0)
    east, north = np.array(plane.east_north(north_lon, north_lat)) - KARLSRUHE[0]
    grid = plane.grid_at(KARLSRUHE)
    assert grid is not None
    assert math.hypot(east, north) / 100.0 == pytest.approx(grid.scale, abs=2e-8)
    # True north's direction on the grid, clockwise, is the opposite of grid north's from true north.
    assert math.atan2(east, north) == pytest.approx(-grid.convergence_rad, abs=1e-6)
    assert grid.combined_scale(637.1) == pytest.approx(grid.scale * (1 - 1e-4), abs=1e-7)

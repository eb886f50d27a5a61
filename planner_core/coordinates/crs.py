"""Coordinate reference systems by name: what pyproj's registry knows of them, checked for use on a site.

In metres and in feet; positions are metres here, too, and are turned into the system's own unit on the way to PROJ.

pyproj is imported here only, and only when a system is named.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from planner_core.errors import CoordinatesError
from planner_core.model import METRE, FloatArray, LengthUnit
from planner_core.model.site_frame import unit_of_size

if TYPE_CHECKING:
    from pyproj import CRS

_CODE = re.compile(r"\s*(?:EPSG)?\s*:?\s*(\d{4,6})\s*", re.IGNORECASE)
_EARTH_RADIUS_M = 6_371_000.0


@dataclass(frozen=True)
class GridAt:
    """How a map projection distorts at a place. scale : metres on the grid of one on the ellipsoid.

    convergence_rad : of grid north, clockwise from true north.
    """

    latitude_deg: float
    longitude_deg: float
    scale: float
    convergence_rad: float

    def combined_scale(self, height_m: float) -> float:
        """Metres on the grid of one metre measured at a height above the ellipsoid, with a sphere for the earth."""
        return self.scale * _EARTH_RADIUS_M / (_EARTH_RADIUS_M + height_m)


class MapCrs:
    """A projected system with axes to the east and the north.

    text : what names it to programs: `EPSG:25832`, else WKT. name : for people. unit : of its axes.
    """

    def __init__(self, crs: CRS, unit: LengthUnit = METRE) -> None:
        self._crs = crs
        self.unit = unit
        self.text = _text(crs)
        self.name = f"{self.text} {crs.name}" if self.text.startswith("EPSG:") else _own_name(crs)

    @property
    def wkt(self) -> str:
        """WKT2."""
        return str(self._crs.to_wkt())

    def degrees(self, east_north_m: FloatArray) -> FloatArray:
        """(N, 2) easting, northing, metres -> (N, 2) longitude, latitude; inf where there is nothing of the kind."""
        points = self.unit.of_array(np.atleast_2d(np.asarray(east_north_m, dtype=np.float64)))
        return np.stack(self._transformer().transform(points[:, 0], points[:, 1]), axis=1)

    def east_north(self, longitude_deg: float, latitude_deg: float) -> tuple[float, float]:
        """Easting and northing of a place on WGS 84, metres."""
        east, north = self._transformer().transform(longitude_deg, latitude_deg, direction="INVERSE")
        return float(east) * self.unit.metres, float(north) * self.unit.metres

    def outside_m(self, east_north_m: FloatArray) -> float:
        """How far the farthest of (N, 2) points lies outside the system's area of use; 0: all are inside; inf: nowhere.

        The area of use is a box of longitudes and latitudes, as the registry has it. Unknown: all are inside.
        """
        area = self._crs.area_of_use
        if area is None:
            return 0.0
        longitude, latitude = self.degrees(east_north_m).T
        if not (np.isfinite(longitude).all() and np.isfinite(latitude).all()):
            return math.inf
        from pyproj import Geod

        nearest_lat = np.clip(latitude, area.south, area.north)
        nearest_lon = _nearest_longitude(longitude, area.west, area.east)
        _, _, away_m = Geod(ellps="WGS84").inv(longitude, latitude, nearest_lon, nearest_lat)
        return float(np.max(away_m))

    def area_name(self) -> str:
        """Words for the area of use, short ones."""
        area = self._crs.area_of_use
        return "" if area is None else str(area.name).partition(":")[0].rstrip(".")

    def grid_at(self, east_north_m: FloatArray) -> GridAt | None:
        """Scale and convergence at one place; None where the projection has none there."""
        from pyproj import Proj

        longitude, latitude = self.degrees(east_north_m)[0]
        if not (math.isfinite(longitude) and math.isfinite(latitude)):
            return None
        factors = Proj(self._crs).get_factors(longitude, latitude)
        scale = math.sqrt(float(factors.areal_scale))
        if not math.isfinite(scale):
            return None
        return GridAt(float(latitude), float(longitude), scale, math.radians(float(factors.meridian_convergence)))

    def _transformer(self) -> Any:
        from pyproj import Transformer

        return Transformer.from_crs(self._crs, "EPSG:4326", always_xy=True)


def geodesic_m(one_deg: FloatArray, other_deg: FloatArray) -> float:
    """Metres on WGS 84 between two places (2,) of longitude and latitude; inf where one is none."""
    if not (np.isfinite(one_deg).all() and np.isfinite(other_deg).all()):
        return math.inf
    from pyproj import Geod

    _, _, away_m = Geod(ellps="WGS84").inv(one_deg[0], one_deg[1], other_deg[0], other_deg[1])
    return float(away_m)


@dataclass(frozen=True)
class VerticalCrs:
    """A vertical CRS, upwards. text : `EPSG:7837`, else WKT. name : for people. unit : of its axis."""

    text: str
    name: str
    unit: LengthUnit = METRE


def map_crs(text: str, *, option: str = "--crs") -> tuple[MapCrs, VerticalCrs | None]:
    """Return the system of a code, a name or WKT; with that of heights where it is compound.

    Raises
    ------
    CoordinatesError
        There is none, or it is none that site coordinates in metres or feet can be in.
    """
    crs = _known(text, option)
    vertical = None
    if crs.is_compound:
        plane, height = crs.sub_crs_list
        crs, vertical = plane, _vertical(height, option)
    if not crs.is_projected:
        raise CoordinatesError(
            f"{option}: {text!r} is {crs.name}, a {crs.type_name.lower()}, expected a projected one, such as "
            "EPSG:25832; give the grid of the survey"
        )
    unit = _unit(crs, option)
    directions = {str(axis.direction) for axis in crs.axis_info[:2]}
    if directions != {"east", "north"}:
        raise CoordinatesError(
            f"{option}: axes of {crs.name} point {' and '.join(sorted(directions))}, expected east and north; give a "
            "CRS whose axes do"
        )
    return MapCrs(crs, unit), vertical


def vertical_crs(text: str, *, option: str = "--vertical-crs") -> VerticalCrs:
    """Return the vertical CRS of a code, a name or WKT; raises as `map_crs`."""
    return _vertical(_known(text, option), option)


def vertical_crs_of_datum(words: str) -> VerticalCrs | None:
    """Return the vertical CRS of a datum as a file names it, such as `DHHN2016`; None: not known."""
    for text in (words, f"{words} height"):
        try:
            return vertical_crs(text)
        except CoordinatesError:
            continue
    return None


def _known(text: str, option: str) -> CRS:
    from pyproj import CRS
    from pyproj.exceptions import CRSError

    code = _CODE.fullmatch(text)
    try:
        return CRS.from_user_input(f"EPSG:{code[1]}" if code else text.strip())
    except CRSError as error:
        shown = text if len(text) <= 60 else f"{text[:57]}..."
        raise CoordinatesError(
            f"{option}: got {shown!r}, which is not a known coordinate reference system, expected a code such as "
            "EPSG:25832, or WKT; check the code"
        ) from error


def _vertical(crs: CRS, option: str) -> VerticalCrs:
    if not crs.is_vertical or crs.axis_info[0].direction != "up":
        raise CoordinatesError(
            f"{option}: {crs.name} is a {crs.type_name.lower()}, expected a vertical CRS, such as EPSG:7837"
        )
    unit = _unit(crs, option)
    text = _text(crs)
    return VerticalCrs(text, f"{text} {crs.name}" if text.startswith("EPSG:") else str(crs.name), unit)


def metric_crs(text: str) -> CRS:
    """Return the system of a code or WKT with its axes in metres: what names coordinates in files that know no feet.

    Projection and datum stay as they are, so that positions are the same on earth; no registry has a code for it.
    """
    from pyproj import CRS

    document = CRS.from_user_input(text).to_json_dict()
    for part in document.get("components", [document]):
        axes = part.get("coordinate_system", {}).get("axis", [])
        if any(axis.get("unit") != "metre" for axis in axes):
            part.pop("id", None)
            part["name"] = f"{part['name']} in metres"
            for axis in axes:
                axis["unit"] = "metre"
    if "components" in document:
        document.pop("id", None)
        document["name"] = " + ".join(part["name"] for part in document["components"])
    return CRS.from_json_dict(document)


def _unit(crs: CRS, option: str) -> LengthUnit:
    units = {unit_of_size(axis.unit_conversion_factor) for axis in crs.axis_info}
    unit = units.pop() if len(units) == 1 else None
    if unit is None:
        names = " and ".join(dict.fromkeys(str(axis.unit_name) for axis in crs.axis_info))
        raise CoordinatesError(
            f"{option}: {crs.name} has units of {names}, expected metres, feet (0.3048 m) or US survey feet "
            "(1200/3937 m); give the CRS of the same grid in one of these"
        )
    return unit


def _text(crs: CRS) -> str:
    authority = crs.to_authority(min_confidence=100)
    return f"{authority[0]}:{authority[1]}" if authority and authority[0] == "EPSG" else str(crs.to_wkt())


def _own_name(crs: CRS) -> str:
    """The name of a system that is in no registry; PROJ strings have none."""
    if crs.name not in ("unknown", "unnamed", "undefined"):
        return str(crs.name)
    operation = crs.coordinate_operation
    return "unnamed system" if operation is None else f"unnamed system ({operation.method_name})"


def _nearest_longitude(longitude: FloatArray, west: float, east: float) -> FloatArray:
    """The longitude inside a box, which may reach across 180 degrees, that is nearest to each."""
    width = (east - west) % 360.0 or 360.0
    ahead = (longitude - west) % 360.0
    beyond = ahead - width
    inside = beyond <= 0
    return np.where(inside, longitude, np.where(beyond <= (360.0 - width) / 2, east, west))

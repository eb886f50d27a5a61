"""The site's coordinates: easting, northing and height, and how scene coordinates become them. Metres."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np
from pydantic import Field

from planner_core.documents import Number, document
from planner_core.model.arrays import FloatArray

# -------------------------------------------------------------------------------------------------------- length units
# Units of length that people survey in: of what comes in and goes out; inside the library every length is in metres.
# The two feet differ by 2 parts per million: at a State Plane coordinate of 2 000 000 ft by 1.2 m. So each has its
# name.


@dataclass(frozen=True)
class LengthUnit:
    """symbol : as options, headers and file names have it. many : of several, for people. metres : of one of it."""

    symbol: str
    many: str
    metres: float

    @property
    def is_feet(self) -> bool:
        """Whether it is one of the two feet."""
        return self != METRE

    def of(self, length_m: float) -> float:
        """Metres -> this unit."""
        return length_m / self.metres

    def of_array(self, lengths_m: FloatArray) -> FloatArray:
        """Metres -> this unit, of any shape."""
        return lengths_m / self.metres if self.is_feet else lengths_m

    def text(self, length_m: float, digits: int) -> str:
        """Write a length, metres, in this unit and with its symbol."""
        return f"{self.of(length_m):.{digits}f} {self.symbol}"


METRE = LengthUnit("m", "metres", 1.0)
FOOT = LengthUnit("ft", "feet", 0.3048)
"""The international foot, exactly 0.3048 m."""
US_SURVEY_FOOT = LengthUnit("ftUS", "US survey feet", 1200.0 / 3937.0)
"""The foot of most State Plane systems of NAD83: 1200/3937 m."""
LENGTH_UNITS = {unit.symbol: unit for unit in (METRE, FOOT, US_SURVEY_FOOT)}

_NAMES = {
    METRE: ("m", "metre", "metres", "meter", "meters"),
    FOOT: ("ft", "foot", "feet", "ift", "international foot", "international feet"),
    US_SURVEY_FOOT: ("ftus", "usft", "us ft", "sft", "survey foot", "survey feet", "us survey foot", "us survey feet",
                     "us survey ft", "survey ft", "foot us", "feet us", "ft us", "us foot", "us feet"),
}  # fmt: skip
_UNIT_OF_NAME = {name: unit for unit, names in _NAMES.items() for name in names}


def unit_named(name: str) -> LengthUnit | None:
    """Return the unit that a file or a person means, such as `US survey foot`, `US_Survey_Feet`, `ftUS`; None: none."""
    plain = " ".join(name.casefold().replace(".", "").replace("_", " ").replace("-", " ").split())
    return _UNIT_OF_NAME.get(plain)


def unit_of_size(metres: float) -> LengthUnit | None:
    """Return the unit of this length in metres, to a billionth; None: none of these."""
    return next((unit for unit in LENGTH_UNITS.values() if math.isclose(unit.metres, metres, rel_tol=1e-9)), None)


def feet_and_inches(length_m: float, *, parts: int = 8) -> str:
    """Write a length as crews read it off a tape: `5' 3 1/4"`, to an inch divided in `parts`, a power of two.

    The two feet are the same to such digits below a kilometre: the international one is taken.
    """
    if not math.isfinite(length_m):
        return "not known"
    count = round(abs(length_m) / 0.0254 * parts)
    feet, rest = divmod(count, 12 * parts)
    inches, part = divmod(rest, parts)
    common = math.gcd(part, parts)
    fraction = f" {part // common}/{parts // common}" if part else ""
    return f"{'-' if length_m < 0 and count else ''}{feet}' {inches}{fraction}\""


# ---------------------------------------------------------------------------------------------------------- site frame
SCENE_NAME = "scene coordinates"


def _identity() -> FloatArray:
    return np.eye(4, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class SiteFrame:
    """From the scene frame to the site's: E, N, H = `matrix` @ (x, y, z, 1).

    matrix : (4, 4) float64, affine, right-handed, z up; metres to metres. Its horizontal scale may differ from 1.
    """

    matrix: FloatArray = field(default_factory=_identity)
    crs: str = ""
    """What names the coordinate reference system to programs: `EPSG:25832` or WKT; empty: a local one."""
    vertical_crs: str = ""
    """The same of heights; empty: not given, or not known by that name."""
    vertical_name: str = ""
    """For people; empty: not given."""
    name: str = SCENE_NAME
    """For people: `EPSG:25832 ETRS89 / UTM zone 32N`, or `scene coordinates`."""
    source: str = "scene"
    """`ifc map conversion`, `ifc site placement`, `given epsg`, `control points` or `scene`."""
    residuals_m: tuple[float, ...] = ()
    """Of control points: how far each is off, in space, in their order."""
    warnings: tuple[str, ...] = ()
    """One line each, for the user: doubts."""
    notes: tuple[str, ...] = ()
    """One line each: how true distances are, which datum heights are in, what control points gave."""
    true_north_rad: float | None = None
    """In the plan of the scene, clockwise from its +y, by the scene file; None: not stated."""
    place: str = ""
    """Words for the site's place by the scene file: `49.10044 N, 8.43654 E`; no coordinates to work with."""
    unit: LengthUnit = METRE
    """In which people read and write site coordinates, and lengths beside them."""
    crs_unit: LengthUnit = METRE
    """Of the axes of `crs`."""
    vertical_unit: LengthUnit = METRE
    """Of the axis of `vertical_crs`."""

    def in_metres(self) -> SiteFrame:
        """Return the same for a format that knows metres only."""
        return replace(self, unit=METRE)

    def in_unit(self, site_m: FloatArray) -> FloatArray:
        """(..., 3) E, N, H in metres -> the same in `unit`."""
        return self.unit.of_array(np.asarray(site_m, dtype=np.float64))

    @property
    def is_scene(self) -> bool:
        """Whether site coordinates are the scene's own: nothing is known of where the site is."""
        return self.source == "scene"

    @property
    def crs_line(self) -> str:
        """Words on coordinates in every file: their system, and that of heights where it is given.

        And their unit, where that is not the metre, or not the unit of the system that is named.
        """
        unit = "" if self.unit == self.crs_unit == METRE else f", in {self.unit.many}"
        if self.is_scene:
            return f"{SCENE_NAME}, no CRS{unit}"
        of_heights = "" if self.vertical_unit is self.unit or not self.vertical_crs else f", in {self.unit.many}"
        heights = f"heights {self.vertical_name}{of_heights}" if self.vertical_name else "vertical datum not given"
        return f"{self.name if self.crs else f'{self.name}, no CRS'}{unit}; {heights}"

    @property
    def grid_north_rad(self) -> float:
        """Direction of north in the plan of the scene: clockwise from its +y, in (-pi, pi]; for north arrows.

        Of the site's grid; in scene coordinates true north, where the scene file states it, else +y.
        """
        if self.is_scene and self.true_north_rad is not None:
            return self.true_north_rad
        north = np.linalg.solve(self.matrix[:3, :3], np.array([0.0, 1.0, 0.0]))
        return math.atan2(float(north[0]), float(north[1]))

    @property
    def horizontal_scale(self) -> float:
        """Metres on the site's grid of one metre of the scene, in plan."""
        return math.sqrt(abs(float(np.linalg.det(self.matrix[:2, :2]))))

    def to_site(self, points_m: FloatArray) -> FloatArray:
        """(N, 3) or (3,) float64 of the scene frame -> the same shape of E, N, H."""
        points = np.asarray(points_m, dtype=np.float64)
        return np.asarray(points @ self.matrix[:3, :3].T + self.matrix[:3, 3])

    def to_scene(self, points_m: FloatArray) -> FloatArray:
        """(N, 3) or (3,) float64 E, N, H -> the same shape in the scene frame."""
        # The shift goes first: with northings of millions it would eat the digits of the product.
        points = np.asarray(points_m, dtype=np.float64) - self.matrix[:3, 3]
        return np.asarray(np.linalg.solve(self.matrix[:3, :3], points.T).T)


_Row = Annotated[tuple[Number, ...], Field(min_length=4, max_length=4)]


@document
@dataclass(frozen=True)
class Georeference:
    """Where on earth the scene is by its file, unchecked; texts as the file has them, empty: not given."""

    operation: str = ""
    """`IfcMapConversion`, `IfcMapConversionScaled`, `IfcRigidOperation` or `ePset_MapConversion`; empty: none."""
    to_map: Annotated[tuple[_Row, ...], Field(min_length=4, max_length=4)] | None = None
    """Rows of the matrix from scene positions to easting, northing and height, metres to metres; None: no map
    conversion."""
    crs_name: str = ""
    """Name of the coordinate reference system, mostly `EPSG:25832`."""
    crs_text: str = ""
    """The same as WKT; empty in most files."""
    description: str = ""
    """Of the coordinate reference system."""
    geodetic_datum: str = ""
    vertical_datum: str = ""
    map_projection: str = ""
    map_zone: str = ""
    map_unit: str = ""
    site_latitude_deg: Number | None = None
    """Of the site; north is positive."""
    site_longitude_deg: Number | None = None
    """Of the site; east is positive."""
    site_elevation_m: Number | None = None
    """Of the site."""
    site_position_m: Annotated[tuple[Number, Number, Number] | None, Field(alias="site_position")] = None
    """Scene position that latitude, longitude and elevation are of."""
    true_north: tuple[Number, Number] | None = None
    """Direction in the plan of the scene, of length 1; None: not given."""
    warnings: tuple[str, ...] = ()
    """What is odd about it, one line each, for the user."""

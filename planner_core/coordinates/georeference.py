"""Where on earth the scene of a plan.json is."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from planner_core.documents import Number, RoundTripModel
from planner_core.model import Georeference

_Row = tuple[Number, Number, Number, Number]


class GeoreferenceSection(RoundTripModel):
    """Where on earth the scene is by its file, unchecked; texts as the file has them, empty: not given."""

    dataclass: ClassVar = Georeference

    operation: str
    """IFC class of the map conversion; empty: the file has none."""
    to_map: tuple[_Row, _Row, _Row, _Row] | None
    """Rows of the matrix from scene positions to easting, northing and height, metres to metres; null: no map
    conversion."""
    crs_name: str
    """Name of the coordinate reference system."""
    crs_text: str
    """The same as WKT; empty in most files."""
    description: str
    """Of the coordinate reference system."""
    geodetic_datum: str
    vertical_datum: str
    map_projection: str
    map_zone: str
    map_unit: str
    site_latitude_deg: Number | None
    """Of the site; north is positive."""
    site_longitude_deg: Number | None
    """Of the site; east is positive."""
    site_elevation_m: Number | None
    """Of the site."""
    site_position_m: Annotated[tuple[Number, Number, Number] | None, Field(alias="site_position")]
    """Scene position that latitude, longitude and elevation are of."""
    true_north: tuple[Number, Number] | None
    """Direction in the plan of the scene, of length 1; null: not given."""
    warnings: tuple[str, ...]
    """What is odd about it."""

"""Longitude and latitude of the site: WGS84 degrees, by PROJ, of site coordinates whose CRS is known.

Heights are left as they are: a change of their datum would take a geoid model, which is not given.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from planner_core.errors import CrsNeededError, ExportError
from planner_core.export.options import Options
from planner_core.model import FloatArray, LengthUnit, SiteFrame

WGS84 = "EPSG:4326"
#: A tenth of a millimetre on the ground, as everywhere else.
DECIMALS = 9
_INSTEAD = {"geojson": ", or write its coordinates as they are with --geojson-crs local"}
"""The way to do without, by format."""


@dataclass(frozen=True, eq=False)
class Geographic:
    """The way from site coordinates to degrees. remarks : how good it is, a line each, for the user."""

    remarks: tuple[str, ...]
    _transformer: Any
    _crs_unit: LengthUnit

    def degrees(self, site_m: FloatArray) -> FloatArray:
        """(N, 3) E, N, H, metres -> (N, 2) longitude, latitude, rounded to `DECIMALS`.

        Raises
        ------
        ExportError
            Coordinates that the CRS can't have.
        """
        east_m, north_m = np.asarray(site_m, dtype=np.float64).reshape(-1, 3)[:, :2].T
        unit = self._crs_unit
        out = np.column_stack(self._transformer.transform(unit.of_array(east_m), unit.of_array(north_m)))
        if not np.isfinite(out).all():
            at = int(np.flatnonzero(~np.isfinite(out).all(axis=1))[0])
            raise ExportError(
                f"longitude and latitude: E {east_m[at]:.3f}, N {north_m[at]:.3f} is far outside the site's CRS, "
                "expected a position inside its area; check --crs and --origin"
            )
        return np.asarray(np.round(out, DECIMALS) + 0.0)


def needs_crs(name: str, options: Options) -> bool:
    """Whether a format has longitude and latitude, whatever else the options choose."""
    return name == "kml" or (name == "geojson" and options.geojson_crs == "wgs84")


def geographic_of(frame: SiteFrame, what: str) -> Geographic:
    """Return the way to degrees, which `what` needs.

    Raises
    ------
    CrsNeededError
        The CRS is not known.
    ExportError
        PROJ can't read it, or knows no way.
    """
    if not frame.crs:
        raise CrsNeededError(
            f"{what}: the plan is in {frame.name} without a CRS, expected a CRS for longitude and latitude; give --crs "
            f"and --origin (or --control-points){_INSTEAD.get(what, '')}"
        )
    import warnings

    from pyproj import CRS
    from pyproj.exceptions import ProjError
    from pyproj.transformer import TransformerGroup

    try:
        source = CRS.from_user_input(frame.crs).to_2d()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of grids that are missing: a remark names them
            ways = TransformerGroup(source, WGS84, always_xy=True)
    except ProjError as error:
        raise ExportError(
            f"{what}: PROJ can't read the CRS {frame.name} ({error}), expected such as EPSG:25832; check --crs"
        ) from error
    if not ways.transformers:
        raise ExportError(f"{what}: PROJ has no transformation from {frame.name} to {WGS84}; give another --crs")
    best = ways.transformers[0]
    accuracy = f"good to {best.accuracy:g} m" if best.accuracy >= 0 else "of unknown accuracy"
    remarks = [f"longitude and latitude by {best.description}, {accuracy}"]
    if not ways.best_available:
        remarks.append(
            "PROJ has a more accurate transformation to longitude and latitude, but its grid is not installed"
        )
    return Geographic(tuple(remarks), best, frame.crs_unit)

"""What every cloud file states of itself: scanner, noise, coordinates; and the names of files, one a station."""

from __future__ import annotations

import math
import uuid

from planner_core.coordinates.crs import metric_crs
from planner_core.export.clouds.points import Clouds
from planner_core.model import FloatArray, SiteFrame
from planner_core.plan_folder.plan_source import FieldStation
from planner_core.plan_folder.usd_names import prim_names_of_ids

#: Of ids that are names alone: made by `uuid5` from this and a text, so that the same cloud has the same id.
_NAMESPACE = uuid.UUID("5c0d3c4e-7a58-5d2a-9a52-0f1e6a3f8b11")


def file_names(clouds: Clouds) -> tuple[str, ...]:
    """Of the clouds' stations, in their order: fit for every disk, and unique."""
    return prim_names_of_ids([station.id for station in clouds.stations])


def facts(clouds: Clouds) -> dict[str, str]:
    """What holds for all stations, by name; no value depends on when or where it was written."""
    scanner = clouds.settings.scanner
    n_rows, n_columns = clouds.template.shape
    noise = "none" if clouds.noise is None else f"by the scanner's figures, seed {clouds.seed}"
    return {
        "plan": clouds.title,
        "scanner": f"{scanner.name}{f':{scanner.mode}' if scanner.mode else ''}",
        "beams": f"{n_rows} x {n_columns}" + (f", every {clouds.step}. of both" if clouds.step > 1 else ""),
        "noise": noise,
        "reflectivity": f"{clouds.reflectivity:g}",
        "coordinates": clouds.frame.crs_line,
    }


def facts_of(station: FieldStation) -> dict[str, str]:
    """What a station is and where it stands, by name; nothing of its ground where its height is not known."""
    values = {
        "station": station.id,
        "floor": station.floor_id,
        "number": str(station.number),
        "positionSite": numbers(station.site_m, 4),
        "positionScene": numbers(station.position_m, 6),
    }
    if math.isfinite(station.instrument_height_m):
        values["instrumentHeight"] = f"{station.instrument_height_m:.4f}"
        values["groundSite"] = numbers(station.site_ground_m, 4)
    return values


def numbers(values: FloatArray, n_decimals: int) -> str:
    """Numbers of a text, between spaces."""
    return " ".join(f"{value:.{n_decimals}f}" for value in values)


def guid_of(clouds: Clouds, station: FieldStation | None = None) -> str:
    """`{...}`: the same for the same cloud; None: of all stations together."""
    parts = [*clouds.identity, *facts(clouds).values()]
    parts.append(numbers(clouds.frame.matrix.ravel(), 9))
    for one in clouds.stations if station is None else (station,):
        parts.extend(facts_of(one).values())
    parts.append("all" if station is None else "one")
    return f"{{{uuid.uuid5(_NAMESPACE, chr(10).join(parts))}}}"


def wkt_of(frame: SiteFrame) -> str:
    """The site's coordinate reference system as point-cloud formats take it, WKT of 2001; empty: there is none.

    Heights are part of it where their system is given. A system that WKT of 2001 can't express is in that of 2019.
    Clouds are in metres: a system in feet is written with its axes in metres.
    """
    if not frame.crs:
        return ""
    import pyproj

    crs = metric_crs(frame.crs) if frame.crs_unit.is_feet else pyproj.CRS.from_user_input(frame.crs)
    if frame.vertical_crs and not crs.is_compound:
        of_heights = frame.vertical_crs
        heights = metric_crs(of_heights) if frame.vertical_unit.is_feet else pyproj.CRS.from_user_input(of_heights)
        crs = pyproj.crs.CompoundCRS(f"{crs.name} + {heights.name}", [crs, heights])
    try:
        return str(crs.to_wkt("WKT1_GDAL"))
    except pyproj.exceptions.CRSError:
        return str(crs.to_wkt())

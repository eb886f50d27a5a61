"""A plan's stations as one small USD file that needs no other: transforms, cameras, tripods, figures.

PlanSource -> usda. Paths, frame and attributes are those of the stage's stations layer (docs/formats/stage.md): local
frame, metres, z up, `scene = local + offset`. Laid over plan.usda it adds to the stations there; alone it opens, too.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from planner_core.export.chosen import chosen_stations
from planner_core.export.options import Options
from planner_core.model import FloatArray
from planner_core.plan_folder.plan_source import FieldStation, PlanSource
from planner_core.plan_folder.sdf_authoring import (
    TYPES,
    Layer,
    Sdf,
    define,
    new_layer,
    put,
    put_site,
    put_transform,
    set_stage_metadata,
)
from planner_core.plan_folder.usd_names import prim_names_of_ids
from planner_core.plan_folder.usd_stations import FARTHEST_M, author_camera, author_tripod, level_direction
from planner_core.progress import Progress, ProgressEvent


def write_usd_stations(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write the stations of the chosen floors. Returns remarks.

    Raises
    ------
    RequirementError
        A floor that is not there.
    """
    stations = chosen_stations(plan, options)
    layer = new_layer()
    offset_m = np.array(plan.document["scene"]["offset"], dtype=np.float64)
    with Sdf.ChangeBlock():
        _author_root(layer, plan, offset_m)
        names = prim_names_of_ids([station.id for station in stations])
        for number, (name, station) in enumerate(zip(names, stations, strict=True)):
            ahead_m = _ahead(stations, number)
            _author_station(layer, plan, f"/Plan/Stations/{name}", station, offset_m, ahead_m)
            progress(ProgressEvent("usd", number + 1, len(stations), station.id))
    path.write_text(layer.ExportToString(), encoding="utf-8")
    return ()


def _author_root(layer: Layer, plan: PlanSource, offset_m: FloatArray) -> None:
    set_stage_metadata(layer, "Plan")
    layer.documentation = f"Scanner stations of {plan.title}. Coordinates: {plan.frame.crs_line}."
    put_site(layer, plan.frame)
    root = define(layer, "/Plan", "Xform", kind="assembly")
    put(root, "tlsplan:offset", TYPES.Double3, tuple(offset_m.tolist()))
    put_transform(root)
    put_transform(define(layer, "/Plan/Stations", "Xform", kind="group"))


def _author_station(
    layer: Layer, plan: PlanSource, path: str, station: FieldStation, offset_m: FloatArray, ahead_m: FloatArray
) -> None:
    prim = define(layer, path, "Xform", kind="component")
    put_transform(prim, station.position_m - offset_m)
    put(prim, "tlsplan:stationId", TYPES.String, station.id)
    put(prim, "tlsplan:floorId", TYPES.String, station.floor_id)
    put(prim, "tlsplan:floorName", TYPES.String, station.floor_name)
    put(prim, "tlsplan:order", TYPES.Int, station.order)
    put(prim, "tlsplan:fixed", TYPES.Bool, station.fixed)
    put(prim, "tlsplan:coveredArea", TYPES.Double, station.covered_area_m2)
    put(prim, "tlsplan:ownArea", TYPES.Double, station.own_area_m2)
    put(prim, "tlsplan:site", TYPES.Double3, tuple(station.site_m.tolist()))
    if math.isfinite(station.instrument_height_m):
        put(prim, "tlsplan:instrumentHeight", TYPES.Double, station.instrument_height_m)
        put(prim, "tlsplan:siteGround", TYPES.Double3, tuple(station.site_ground_m.tolist()))
    author_tripod(layer, f"{path}/Tripod", station.instrument_height_m)
    range_m = float(plan.document["scanner"]["range_max_m"])
    author_camera(define(layer, f"{path}/Camera", "Camera"), ahead_m, max(range_m, FARTHEST_M))


def _ahead(stations: tuple[FieldStation, ...], number: int) -> FloatArray:
    """(3,) level direction, unit length, to the next station of the walk; from the last one back; +y where alone."""
    other = number + 1 if number + 1 < len(stations) else max(number - 1, 0)
    return level_direction(stations[number].position_m, stations[other].position_m)

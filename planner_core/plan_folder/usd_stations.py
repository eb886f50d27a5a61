"""The stage's stations layer: markers with their figures, links, routes, and the payloads of the clouds.

Local frame, metres. Links and routes are for USD viewers only: the browser takes them from plan.json.
"""

from __future__ import annotations

import math

import numpy as np

from planner_core.model import FloatArray, Plan, Station
from planner_core.plan_folder.palette import ROUTE, SEEN_OFTEN, STATION
from planner_core.plan_folder.sdf_authoring import (
    TYPES,
    Layer,
    PrimSpec,
    Sdf,
    define,
    float_array,
    int_array,
    put,
    put_colours,
    put_extent,
    put_transform,
    set_stage_metadata,
    vec3f_array,
)
from planner_core.plan_folder.tripod import foot_m, tripod
from planner_core.plan_folder.usd_names import station_prim_names
from planner_core.plan_folder.viewer_layers import range_step_m
from planner_core.scanner.template import azimuth_step_rad, first_azimuths_rad, preview_template

MARKER_RADIUS_M = 0.12
"""About the size of an instrument."""

#: A camera of 35 mm film that shows 90 degrees from left to right.
APERTURE_MM = 36.0
FOCAL_MM = 18.0
NEAREST_M = 0.05
#: Cameras show at least this far; farther where the scanner does.
FARTHEST_M = 100.0

LINK_WIDTH_M = 0.02
ROUTE_WIDTH_M = 0.04


def author_stations(layer: Layer, plan: Plan, *, flat: bool) -> None:
    """Write /Plan/Stations, and unless `flat` the payloads of their clouds, /Plan/Links and /Plan/Routes."""
    set_stage_metadata(layer, "Plan")
    put_transform(define(layer, "/Plan/Stations", "Xform", kind="group"))
    names = station_prim_names(plan.stations)
    for name, station in zip(names, plan.stations, strict=True):
        _author_station(layer, plan, name, station)
        if not flat:
            cloud = define(layer, f"/Plan/Stations/{name}/Cloud", "Points")
            cloud.payloadList.prependedItems = [Sdf.Payload(f"./clouds/{name}.usdc")]
            camera = define(layer, f"/Plan/Stations/{name}/Camera", "Camera")
            author_camera(camera, _ahead(plan, station), max(plan.settings.scanner.range_max_m, FARTHEST_M))
            author_tripod(layer, f"/Plan/Stations/{name}/Tripod", station.instrument_height_m)
    if not flat:
        _author_links(layer, plan)
        _author_routes(layer, plan)


def _author_station(layer: Layer, plan: Plan, name: str, station: Station) -> None:
    prim = define(layer, f"/Plan/Stations/{name}", "Xform", kind="component")
    put_transform(prim, station.position_m)
    template = preview_template(plan.survey.template)
    n_rows, n_columns = template.shape
    put(prim, "tlsplan:stationId", TYPES.String, station.id)
    put(prim, "tlsplan:floorId", TYPES.String, station.floor)
    put(prim, "tlsplan:order", TYPES.Int, station.order)
    put(prim, "tlsplan:instrumentHeight", TYPES.Double, station.instrument_height_m)
    put(prim, "tlsplan:coveredArea", TYPES.Double, station.covered_area_m2)
    put(prim, "tlsplan:ownArea", TYPES.Double, station.own_area_m2)
    put(prim, "tlsplan:cloudUri", TYPES.String, f"clouds/{name}.cloud")
    put(prim, "tlsplan:cloudRows", TYPES.Int, n_rows)
    put(prim, "tlsplan:cloudColumns", TYPES.Int, n_columns)
    put(prim, "tlsplan:rangeStep", TYPES.Double, range_step_m(template))
    put(prim, "tlsplan:elevations", TYPES.FloatArray, float_array(template.elevation_rad))
    put(prim, "tlsplan:azimuths", TYPES.FloatArray, float_array(first_azimuths_rad(template)))
    put(prim, "tlsplan:azimuthStep", TYPES.Double, azimuth_step_rad(template))
    marker = define(layer, f"/Plan/Stations/{name}/Marker", "Sphere")
    put(marker, "radius", TYPES.Double, MARKER_RADIUS_M)
    put_transform(marker)
    put_extent(marker, np.zeros((1, 3)), margin_m=MARKER_RADIUS_M)
    put_colours(marker, np.array([STATION]), "constant")


def author_camera(prim: PrimSpec, ahead_m: FloatArray, farthest_m: float) -> None:
    """Look along the horizon from the sensor, 90 degrees wide. ahead_m : (3,), level, of unit length.

    A camera of USD looks along its -z, with +y up.
    """
    put_transform(prim, axes=np.array([[ahead_m[1], -ahead_m[0], 0.0], [0.0, 0.0, 1.0], -ahead_m]) + 0.0)
    put(prim, "focalLength", TYPES.Float, FOCAL_MM)
    put(prim, "horizontalAperture", TYPES.Float, APERTURE_MM)
    put(prim, "verticalAperture", TYPES.Float, APERTURE_MM * 2 / 3)
    put(prim, "clippingRange", TYPES.Float2, (NEAREST_M, farthest_m))


def author_tripod(layer: Layer, path: str, height_m: float) -> None:
    """Write the mesh of `tripod` about the sensor."""
    vertices_m, triangles = tripod(height_m)
    prim = define(layer, path, "Mesh")
    put(prim, "points", TYPES.Point3fArray, vec3f_array(vertices_m))
    put(prim, "faceVertexCounts", TYPES.IntArray, int_array(np.full(len(triangles), 3)))
    put(prim, "faceVertexIndices", TYPES.IntArray, int_array(triangles.reshape(-1)))
    put(prim, "subdivisionScheme", TYPES.Token, "none", uniform=True)
    put_transform(prim)
    put_extent(prim, vertices_m)
    put_colours(prim, np.array([STATION]), "constant")


def _ahead(plan: Plan, station: Station) -> FloatArray:
    """(3,) level direction, unit length, to the next station of the walk; from the last one back; +y where alone."""
    others = sorted((each for each in plan.stations if each.order != station.order), key=lambda each: each.order)
    following = [each for each in others if each.order > station.order]
    other = following[0] if following else others[-1] if others else station
    return level_direction(station.position_m, other.position_m)


def level_direction(from_m: FloatArray, to_m: FloatArray) -> FloatArray:
    """(3,) level direction, unit length; +y between places on one plumb line."""
    x_m, y_m = (to_m - from_m)[:2].tolist()
    length_m = math.hypot(x_m, y_m)  # the same on every processor, which linear algebra is not
    return np.array([x_m / length_m, y_m / length_m, 0.0]) if length_m > 1e-6 else np.array([0.0, 1.0, 0.0])


def _author_links(layer: Layer, plan: Plan) -> None:
    """One line a link, numbered: joined names of stations would meet, as those of A and B_C, and of A_B and C, do."""
    if not plan.links:
        return
    scope = define(layer, "/Plan/Links", "Scope")
    put(scope, "purpose", TYPES.Token, "guide", uniform=True)  # hundreds of lines would hide the building
    position_of = {station.id: station.position_m for station in plan.stations}
    for index, link in enumerate(plan.links):
        ends_m = np.stack([position_of[link.a], position_of[link.b]])
        path = f"/Plan/Links/Link_{index}"
        _author_line(layer, path, ends_m, LINK_WIDTH_M, SEEN_OFTEN)
        prim = define(layer, path, "BasisCurves")
        put(prim, "tlsplan:stationA", TYPES.String, link.a)
        put(prim, "tlsplan:stationB", TYPES.String, link.b)
        put(prim, "tlsplan:overlap", TYPES.Double, link.overlap)
        if np.isfinite(link.strength):  # of linear algebra, too: what is rounded away differs by processor
            put(prim, "tlsplan:strength", TYPES.Double, round(link.strength, 6))
        if np.isfinite(link.probability):
            put(prim, "tlsplan:probability", TYPES.Double, round(link.probability, 6))


def _author_routes(layer: Layer, plan: Plan) -> None:
    """One line a floor, on the ground, from station to station in the order to visit them."""
    define(layer, "/Plan/Routes", "Scope")
    for floor in plan.survey.floors:
        feet_m = route_m(plan, floor.id)
        if len(feet_m) > 1:
            _author_line(layer, f"/Plan/Routes/{floor.id}", feet_m, ROUTE_WIDTH_M, ROUTE)


def route_m(plan: Plan, floor_id: str) -> FloatArray:
    """(K, 3) float64, local: the ground below the floor's stations in visiting order."""
    visited = sorted((s for s in plan.stations if s.floor == floor_id), key=lambda station: station.order)
    return np.array([foot_m(station) for station in visited], dtype=np.float64).reshape(-1, 3)


def _author_line(
    layer: Layer, path: str, points_m: FloatArray, width_m: float, colour: tuple[float, float, float]
) -> None:
    prim = define(layer, path, "BasisCurves")
    put(prim, "type", TYPES.Token, "linear", uniform=True)
    put(prim, "curveVertexCounts", TYPES.IntArray, int_array(np.array([len(points_m)])))
    put(prim, "points", TYPES.Point3fArray, vec3f_array(points_m))
    put(prim, "widths", TYPES.FloatArray, float_array(np.array([width_m]))).SetInfo("interpolation", "constant")
    put_extent(prim, points_m, margin_m=width_m / 2)
    put_colours(prim, np.array([colour]), "constant")

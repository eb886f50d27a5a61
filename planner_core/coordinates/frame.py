"""What the plan's scene file and the user say of coordinates -> `SiteFrame`, with every doubt about it in words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from planner_core.coordinates.checks import FAR_M, Doubt, doubts_of, doubts_of_renaming, notes_of
from planner_core.coordinates.control_points import ControlPoints, read_control_points
from planner_core.coordinates.crs import MapCrs, VerticalCrs, map_crs, vertical_crs, vertical_crs_of_datum
from planner_core.coordinates.helmert import Fit, fit_4, fit_7
from planner_core.coordinates.request import FrameRequest
from planner_core.documents import read_as
from planner_core.errors import CoordinatesError, PlanFolderError
from planner_core.model import METRE, FloatArray, Georeference, LengthUnit, SiteFrame
from planner_core.model.site_frame import unit_named, unit_of_size

LOCAL_NAME = "local site coordinates"
_SCALES = (0.99, 1.01)
"""No grid is further from 1; unit steps are."""
_SUSPECT_SHARE = 0.2
"""A point is suspect where the others, without it, are off by less than this share of what they are off with it."""
_UNITS = {0.001: "millimetres", 0.01: "centimetres", 0.3048: "feet", 0.0254: "inches", 1000.0: "kilometres"}


@dataclass(frozen=True)
class _Systems:
    """The systems of a frame, and warnings about how they were found."""

    plane: MapCrs | None = None
    plane_words: str = ""
    """Where a file names one that is not known here."""
    height: VerticalCrs | None = None
    height_words: str = ""
    of_file: MapCrs | None = None
    """The scene file's own, where `plane` goes before it."""
    warnings: tuple[str, ...] = ()


def site_frame(document: Mapping[str, Any], request: FrameRequest | None = None) -> SiteFrame:
    """Return the frame that a plan is handed over in.

    Parameters
    ----------
    document
        Of `planner_core.plan_folder.plan_json.read_plan_json`.
    request
        None: coordinates are not required yet; what is wrong with those of the scene file is a warning.

    Raises
    ------
    CoordinatesError
        The coordinates given can't be used; or they are surely wrong, and `accept_implausible` is not set.
    PlanFolderError
        `scene.georeference` of the document is not as it is written.
    """
    options = request or FrameRequest()
    _check_one_way(options)
    georeference = georeference_of(document)
    north = _true_north_rad(georeference)
    place = "" if georeference is None else _place_words(georeference)
    scene = SiteFrame(true_north_rad=north, place=place, unit=options.unit or METRE)
    if options.scene_coordinates:
        return scene
    frame, systems = _frame(options, georeference)
    if frame is None:
        return replace(scene, warnings=() if georeference is None else georeference.warnings)
    points_m = _points_of(document)
    named = _named(frame, systems, options.unit)
    doubts = doubts_of(named, systems.plane, points_m)
    if systems.of_file is not None and systems.plane is not None:
        doubts = (*doubts_of_renaming(systems.of_file, systems.plane, named.to_site(points_m)[:, :2]), *doubts)
    if request is not None and not request.accept_implausible:
        _refuse_certain(doubts)
    return replace(
        named,
        true_north_rad=north,
        place=place,
        warnings=(
            *systems.warnings,
            *frame.warnings,
            *(doubt.text for doubt in doubts),
            *_doubts_of_place(named, systems.plane, georeference),
            *_doubts_of_foot(named, systems.plane, georeference, document, points_m),
        ),
        notes=(*frame.notes, *notes_of(named, systems.plane, points_m)),
    )


def georeference_of(document: Mapping[str, Any]) -> Georeference | None:
    """Read `scene.georeference`; None where there is none, as in plans of earlier versions and of other formats."""
    scene = document.get("scene")
    row = scene.get("georeference") if isinstance(scene, Mapping) else None
    if row is None:
        return None
    where = "plan.json: scene.georeference."
    return read_as(Georeference, row, where, remedy="plan again", error=PlanFolderError)


def matrix_of(origin_m: Sequence[float], rotation_rad: float, scale: float) -> FloatArray:
    """(4, 4) of a turn about z, counter-clockwise, one scale in plan, and a shift."""
    cos, sin = scale * math.cos(rotation_rad), scale * math.sin(rotation_rad)
    matrix = np.eye(4)
    matrix[:2, :2] = [[cos, -sin], [sin, cos]]
    matrix[:3, 3] = origin_m
    return matrix


# ------------------------------------------------------------------------------------------- ways to a frame
def _frame(request: FrameRequest, georeference: Georeference | None) -> tuple[SiteFrame | None, _Systems]:
    if request.control_points is not None:
        systems = _systems_of_request(request)
        return _by_control_points(request, _unit_of(systems, request.unit)), systems
    if request.origin_m is not None:
        return _by_origin(request), _systems_of_request(request)
    if request.by_site_placement:
        systems = _systems_of_request(request)
        return _by_site_placement(georeference, systems), systems
    if georeference is not None and georeference.to_map is not None:
        systems = _systems_of_file(request, georeference)
        frame = SiteFrame(
            matrix=np.array(georeference.to_map), source="ifc map conversion", warnings=georeference.warnings
        )
        return frame, systems
    if request.crs:
        return SiteFrame(source="given epsg"), _systems_of_request(request)
    if request.vertical_crs:
        raise CoordinatesError("--vertical-crs: got it without --crs, expected both; add --crs")
    return None, _Systems()


def _check_one_way(request: FrameRequest) -> None:
    ways = {
        "--origin": request.origin_m is not None,
        "--control-points": request.control_points is not None,
        "--by-site-placement": request.by_site_placement,
        "--scene-coordinates": request.scene_coordinates,
    }
    given = [name for name, is_given in ways.items() if is_given]
    if len(given) > 1:
        raise CoordinatesError(
            f"{' and '.join(given)}: got both, expected one definition of site coordinates; drop one"
        )
    if request.scene_coordinates and (request.crs or request.vertical_crs):
        raise CoordinatesError("--scene-coordinates: got it with a CRS, which scene coordinates don't have; drop one")


def _by_origin(request: FrameRequest) -> SiteFrame:
    assert request.origin_m is not None
    numbers = (*request.origin_m, request.rotation_rad, request.scale)
    if not all(math.isfinite(value) for value in numbers):
        raise CoordinatesError(f"--origin: got {numbers}, expected finite numbers; correct them")
    _check_scale(request.scale, "--scale")
    return SiteFrame(matrix=matrix_of(request.origin_m, request.rotation_rad, request.scale), source="given epsg")


def _by_control_points(request: FrameRequest, unit: LengthUnit) -> SiteFrame:
    assert request.control_points is not None
    points = read_control_points(request.control_points, unit)
    if request.parameters not in (4, 7):
        raise CoordinatesError(f"--parameters: got {request.parameters}, expected 4 or 7")
    fit = _fitted(points, request)
    suspect = _suspect(points, fit, request, unit)
    remedy = "name units in the header, such as E_ftUS, or find a wrong point"
    _check_scale(fit.scale, "control points: the scale of their fit", suspect or remedy)
    return SiteFrame(
        matrix=fit.matrix,
        source="control points",
        residuals_m=tuple(float(value) for value in fit.off_m),
        warnings=_doubts_of_fit(points, fit, request, suspect, unit),
        notes=(_fit_words(points, fit, request, unit),),
    )


def _fitted(points: ControlPoints, request: FrameRequest) -> Fit:
    fit = fit_4 if request.parameters == 4 else fit_7
    return fit(points.scene_m, points.site_m, points.weights, fixed_scale=request.fixed_scale)


def _suspect(points: ControlPoints, fit: Fit, request: FrameRequest, unit: LengthUnit) -> str:
    """Name the point without which all others fit; empty where there is none, or too few points to tell."""
    worst_m = float(fit.off_m.max())
    n = len(points.names)
    if worst_m <= request.residual_limit_m or n < (4 if request.parameters == 4 else 5):
        return ""
    found = []
    for left_out in range(n):
        others = points.without(left_out)
        try:
            again = _fitted(others, request)
        except CoordinatesError:  # the others alone fix nothing
            continue
        if _SCALES[0] < again.scale < _SCALES[1]:
            found.append((float(again.off_m.max()), points.names[left_out]))
    off_m, name = min(found, default=(math.inf, ""))
    if off_m > max(request.residual_limit_m, _SUSPECT_SHARE * worst_m):
        return ""
    return f"without {name} all others fit to {unit.text(off_m, 3)}: {name} looks wrong"


def _by_site_placement(georeference: Georeference | None, systems: _Systems) -> SiteFrame:
    if systems.plane is None:
        raise CoordinatesError("--by-site-placement: got it without a CRS to place the site in; add --crs EPSG:CODE")
    if (
        georeference is None
        or georeference.site_latitude_deg is None
        or georeference.site_longitude_deg is None
        or not georeference.site_position_m
    ):
        raise CoordinatesError(
            "--by-site-placement: the plan has no latitude and longitude of the site, expected those of an IfcSite; "
            "give --origin or --control-points, or plan again if it is of an earlier version"
        )
    east, north = systems.plane.east_north(georeference.site_longitude_deg, georeference.site_latitude_deg)
    grid = systems.plane.grid_at(np.array([[east, north]]))
    if grid is None:
        raise CoordinatesError(
            f"--by-site-placement: {_place_words(georeference)} is far outside {systems.plane.name}, expected a "
            "position in it; give the grid of the site"
        )
    # True north is seen in the scene clockwise from +y; grid north is clockwise from true north by the convergence.
    rotation_rad = (_true_north_rad(georeference) or 0.0) + grid.convergence_rad
    height_m = georeference.site_elevation_m or 0.0
    x, y, z = georeference.site_position_m
    matrix = matrix_of((0.0, 0.0, 0.0), rotation_rad, 1.0)
    matrix[:3, 3] = np.array([east, north, height_m]) - matrix[:3, :3] @ np.array([x, y, z])
    return SiteFrame(
        matrix=matrix,
        source="ifc site placement",
        warnings=(
            f"the site is placed by latitude, longitude and true north of the scene file "
            f"({_place_words(georeference)}): good to metres or worse; use control points for setting out",
        ),
    )


def _check_scale(scale: float, what: str, remedy: str = "it is of the grid, not of units") -> None:
    if _SCALES[0] < scale < _SCALES[1]:
        return
    unit = next((f", as if one side were in {name}" for size, name in _UNITS.items()
                 if 0.99 < scale / size < 1.01 or 0.99 < scale * size < 1.01), "")  # fmt: skip
    raise CoordinatesError(f"{what} is {scale:g}{unit}, expected about 1; {remedy}")


# --------------------------------------------------------------------------------------------------- systems
def _systems_of_request(request: FrameRequest) -> _Systems:
    plane, height = map_crs(request.crs) if request.crs else (None, None)
    if request.vertical_crs:
        height = vertical_crs(request.vertical_crs)
    return _Systems(plane=plane, height=height)


def _systems_of_file(request: FrameRequest, georeference: Georeference) -> _Systems:
    """The file's systems; the user's word goes before."""
    given = _systems_of_request(request)
    warnings: tuple[str, ...] = ()
    plane, height = given.plane, given.height
    of_file: MapCrs | None = None
    words = georeference.crs_name or georeference.description
    if georeference.crs_text or georeference.crs_name:
        try:
            of_file, height_of_file = map_crs(
                georeference.crs_text or georeference.crs_name, option="the scene file's CRS"
            )
            height = height or height_of_file
        except CoordinatesError as error:
            if plane is None:
                warnings = (f"{error}; files name it as the scene file does; pass --crs",)
    plane = plane or of_file
    if height is None and georeference.vertical_datum:
        height = vertical_crs_of_datum(georeference.vertical_datum)
    return _Systems(plane, words, height, georeference.vertical_datum, of_file, warnings)


def _unit_of(systems: _Systems, unit: LengthUnit | None) -> LengthUnit:
    """Return the unit that people read coordinates in: as they ask, else that of the CRS."""
    return unit or (METRE if systems.plane is None else systems.plane.unit)


def _named(frame: SiteFrame, systems: _Systems, unit: LengthUnit | None) -> SiteFrame:
    plane, height = systems.plane, systems.height
    return replace(
        frame,
        crs="" if plane is None else plane.text,
        name=plane.name if plane is not None else systems.plane_words or LOCAL_NAME,
        vertical_crs="" if height is None else height.text,
        vertical_name=height.name if height is not None else systems.height_words,
        unit=_unit_of(systems, unit),
        crs_unit=METRE if plane is None else plane.unit,
        vertical_unit=METRE if height is None else height.unit,
    )


# ----------------------------------------------------------------------------------------------------- words
def _refuse_certain(doubts: Sequence[Doubt]) -> None:
    """Raise where one is certain; the others go with it, since one of them may say why."""
    if any(doubt.certain for doubt in doubts):
        listed = "; ".join(doubt.text for doubt in sorted(doubts, key=lambda doubt: not doubt.certain))
        raise CoordinatesError(f"coordinates: {listed}; --accept-implausible accepts them anyway")


def _doubts_of_fit(
    points: ControlPoints, fit: Fit, request: FrameRequest, suspect: str, unit: LengthUnit
) -> tuple[str, ...]:
    off_m, limit_m = fit.off_m, request.residual_limit_m
    doubts = [
        f"control point {name} has a residual of {unit.text(off, 3)}, more than {unit.of(limit_m):.4g} {unit.symbol}: "
        "check its coordinates on both sides"
        for name, off in zip(points.names, off_m, strict=True)
        if off > limit_m
    ]
    if suspect:
        doubts.append(f"control points: {suspect}")
    if len(points.names) == 2:
        doubts.append("two control points leave no redundancy to check the fit: add a third one")
    elif fit.in_line:
        doubts.append("control points are all in one line: a mirrored axis would go undetected; add one off the line")
    if math.degrees(fit.tilt_rad) > 0.1:
        doubts.append(f"control points tilt the scene by {math.degrees(fit.tilt_rad):.3f} degrees: check their heights")
    return tuple(doubts)


def _doubts_of_place(frame: SiteFrame, plane: MapCrs | None, georeference: Georeference | None) -> tuple[str, ...]:
    """A file's map conversion and the latitude of its site may be of two places: one is a default that nobody set."""
    if frame.source != "ifc map conversion" or plane is None or georeference is None:
        return ()
    if (
        georeference.site_latitude_deg is None
        or georeference.site_longitude_deg is None
        or georeference.site_position_m is None
    ):
        return ()
    placed = plane.east_north(georeference.site_longitude_deg, georeference.site_latitude_deg)
    away_m = math.dist(placed, frame.to_site(np.array(georeference.site_position_m))[:2])
    if away_m <= FAR_M:
        return ()
    how_far = f"{away_m / 1000:.0f} km" if math.isfinite(away_m) else "half the earth"
    return (
        f"the scene file states its site at {_place_words(georeference)}, {how_far} from where its map conversion puts "
        "it: one of the two is wrong",
    )


def _doubts_of_foot(
    frame: SiteFrame,
    plane: MapCrs | None,
    georeference: Georeference | None,
    document: Mapping[str, Any],
    points_m: FloatArray,
) -> tuple[str, ...]:
    """A map conversion in one foot and a system in the other are metres apart where coordinates are millions."""
    if frame.source != "ifc map conversion" or plane is None or georeference is None or not len(points_m):
        return ()
    # A map conversion without a map unit is in the unit of the project.
    of_file = unit_named(georeference.map_unit)
    if not georeference.map_unit:
        of_project = document["scene"].get("metres_per_unit")
        of_file = None if of_project is None else unit_of_size(float(of_project))
    if of_file is None or of_file is plane.unit or not (of_file.is_feet and plane.unit.is_feet):
        return ()
    reach_m = float(np.hypot(*frame.to_site(points_m)[:, :2].mean(axis=0)))
    apart_m = reach_m * abs(plane.unit.metres / of_file.metres - 1.0)
    return (
        f"the scene file's map conversion is in {of_file.many}, {plane.name} in {plane.unit.many}: the plan is off by "
        f"{plane.unit.text(apart_m, 2)} if the file means the other foot; check a control point",
    )


def _fit_words(points: ControlPoints, fit: Fit, request: FrameRequest, unit: LengthUnit) -> str:
    off_m = fit.off_m
    worst = int(np.argmax(off_m))
    sigma = f", sigma {unit.text(fit.sigma_plan_m, 4)}" if math.isfinite(fit.sigma_plan_m) else ""
    high = ""
    if request.parameters == 4 and math.isfinite(fit.sigma_height_m):
        high = f" in plan and {unit.text(fit.sigma_height_m, 4)} in height"
    return (
        f"{len(points.names)} control points, {request.parameters} parameters: turned by "
        f"{math.degrees(fit.rotation_rad):.5f} degrees, scale {fit.scale:.7f}, largest residual "
        f"{unit.text(float(off_m[worst]), 4)} ({points.names[worst]}){sigma}{high}"
    )


def _true_north_rad(georeference: Georeference | None) -> float | None:
    """Clockwise from the scene's +y."""
    return None if georeference is None or georeference.true_north is None else math.atan2(*georeference.true_north)


def _place_words(georeference: Georeference) -> str:
    latitude, longitude = georeference.site_latitude_deg, georeference.site_longitude_deg
    if latitude is None or longitude is None:
        return ""
    north, east = "N" if latitude >= 0 else "S", "E" if longitude >= 0 else "W"
    return f"{abs(latitude):.5f} {north}, {abs(longitude):.5f} {east}"


def _points_of(document: Mapping[str, Any]) -> FloatArray:
    """(N, 3) corners of floors and stations, scene frame: where the plan is."""
    corners = [
        (x, y, float(floor["elevation_m"]))
        for floor in document["floors"]
        for x in (float(floor["bounds"][0][0]), float(floor["bounds"][1][0]))
        for y in (float(floor["bounds"][0][1]), float(floor["bounds"][1][1]))
    ]
    stations = [tuple(float(value) for value in station["position"]) for station in document["stations"]]
    return np.array([*corners, *stations], dtype=np.float64).reshape(-1, 3)

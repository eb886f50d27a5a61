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
from planner_core.coordinates.georeference import GeoreferenceSection
from planner_core.coordinates.helmert import Fit, fit_4, fit_7
from planner_core.coordinates.request import FrameRequest
from planner_core.documents import read_as
from planner_core.errors import CoordinatesError, PlanFolderError
from planner_core.model import METRE, FloatArray, Georeference, LengthUnit, SiteFrame
from planner_core.model.length_units import unit_named, unit_of_size

LOCAL_NAME = "local site coordinates"
_SCALES = (0.99, 1.01)
"""No grid is further from 1; unit steps are."""
_SUSPECT_SHARE = 0.2
"""A point is suspect where the others, without it, are off by less than this share of what they are off with it."""
_UNITS = {0.001: "millimetres", 0.01: "centimetres", 0.3048: "feet", 0.0254: "inches", 1000.0: "kilometres"}


@dataclass(frozen=True)
class _Systems:
    """The systems of a frame, and what is to be told of how they were found."""

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
        None: nobody asks for coordinates yet; what is wrong with those of the scene file is a warning.

    Raises
    ------
    CoordinatesError
        What was said of coordinates can't be used; or they are surely wrong, and `accept_implausible` is not set.
    PlanFolderError
        `scene.georeference` of the document is not as it is written.
    """
    asked = request or FrameRequest()
    _check_one_way(asked)
    told = georeference_of(document)
    north = _true_north_rad(told)
    place = "" if told is None else _place_words(told)
    scene = SiteFrame(true_north_rad=north, place=place, unit=asked.unit or METRE)
    if asked.scene_coordinates:
        return scene
    frame, systems = _frame(asked, told)
    if frame is None:
        return replace(scene, warnings=() if told is None else told.warnings)
    points_m = _points_of(document)
    named = _named(frame, systems, asked.unit)
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
            *_doubts_of_place(named, systems.plane, told),
            *_doubts_of_foot(named, systems.plane, told, document, points_m),
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
    told: Georeference = read_as(GeoreferenceSection, row, where, remedy="plan again", error=PlanFolderError).read()
    return told


def matrix_of(origin_m: Sequence[float], rotation_rad: float, scale: float) -> FloatArray:
    """(4, 4) of a turn about z, counter-clockwise, one scale in plan, and a shift."""
    cos, sin = scale * math.cos(rotation_rad), scale * math.sin(rotation_rad)
    matrix = np.eye(4)
    matrix[:2, :2] = [[cos, -sin], [sin, cos]]
    matrix[:3, 3] = origin_m
    return matrix


# ------------------------------------------------------------------------------------------- ways to a frame
def _frame(asked: FrameRequest, told: Georeference | None) -> tuple[SiteFrame | None, _Systems]:
    if asked.control_points is not None:
        systems = _systems_told(asked)
        return _by_control_points(asked, _unit_of(systems, asked.unit)), systems
    if asked.origin_m is not None:
        return _by_origin(asked), _systems_told(asked)
    if asked.by_site_placement:
        systems = _systems_told(asked)
        return _by_site_placement(told, systems), systems
    if told is not None and told.to_map is not None:
        systems = _systems_of_file(asked, told)
        frame = SiteFrame(matrix=np.array(told.to_map), source="ifc map conversion", warnings=told.warnings)
        return frame, systems
    if asked.crs:
        return SiteFrame(source="given epsg"), _systems_told(asked)
    if asked.vertical_crs:
        raise CoordinatesError("--vertical-crs: got it without --crs, expected both; add --crs")
    return None, _Systems()


def _check_one_way(asked: FrameRequest) -> None:
    ways = {
        "--origin": asked.origin_m is not None,
        "--control-points": asked.control_points is not None,
        "--by-site-placement": asked.by_site_placement,
        "--scene-coordinates": asked.scene_coordinates,
    }
    told = [name for name, is_told in ways.items() if is_told]
    if len(told) > 1:
        raise CoordinatesError(f"{' and '.join(told)}: got both, expected one definition of site coordinates; drop one")
    if asked.scene_coordinates and (asked.crs or asked.vertical_crs):
        raise CoordinatesError("--scene-coordinates: got it with a CRS, which scene coordinates don't have; drop one")


def _by_origin(asked: FrameRequest) -> SiteFrame:
    assert asked.origin_m is not None
    numbers = (*asked.origin_m, asked.rotation_rad, asked.scale)
    if not all(math.isfinite(value) for value in numbers):
        raise CoordinatesError(f"--origin: got {numbers}, expected finite numbers; correct them")
    _check_scale(asked.scale, "--scale")
    return SiteFrame(matrix=matrix_of(asked.origin_m, asked.rotation_rad, asked.scale), source="given epsg")


def _by_control_points(asked: FrameRequest, unit: LengthUnit) -> SiteFrame:
    assert asked.control_points is not None
    points = read_control_points(asked.control_points, unit)
    if asked.parameters not in (4, 7):
        raise CoordinatesError(f"--parameters: got {asked.parameters}, expected 4 or 7")
    fit = _fitted(points, asked)
    suspect = _suspect(points, fit, asked, unit)
    remedy = "name units in the header, such as E_ftUS, or find a wrong point"
    _check_scale(fit.scale, "control points: the scale of their fit", suspect or remedy)
    return SiteFrame(
        matrix=fit.matrix,
        source="control points",
        residuals_m=tuple(float(value) for value in fit.off_m),
        warnings=_doubts_of_fit(points, fit, asked, suspect, unit),
        notes=(_fit_words(points, fit, asked, unit),),
    )


def _fitted(points: ControlPoints, asked: FrameRequest) -> Fit:
    fit = fit_4 if asked.parameters == 4 else fit_7
    return fit(points.scene_m, points.site_m, points.weights, fixed_scale=asked.fixed_scale)


def _suspect(points: ControlPoints, fit: Fit, asked: FrameRequest, unit: LengthUnit) -> str:
    """Name the point without which all others fit; empty where there is none, or too few points to tell."""
    worst_m = float(fit.off_m.max())
    n = len(points.names)
    if worst_m <= asked.residual_limit_m or n < (4 if asked.parameters == 4 else 5):
        return ""
    found = []
    for left_out in range(n):
        others = points.without(left_out)
        try:
            again = _fitted(others, asked)
        except CoordinatesError:  # the others alone fix nothing
            continue
        if _SCALES[0] < again.scale < _SCALES[1]:
            found.append((float(again.off_m.max()), points.names[left_out]))
    off_m, name = min(found, default=(math.inf, ""))
    if off_m > max(asked.residual_limit_m, _SUSPECT_SHARE * worst_m):
        return ""
    return f"without {name} all others fit to {unit.text(off_m, 3)}: {name} looks wrong"


def _by_site_placement(told: Georeference | None, systems: _Systems) -> SiteFrame:
    if systems.plane is None:
        raise CoordinatesError("--by-site-placement: got it without a CRS to place the site in; add --crs EPSG:CODE")
    if told is None or told.site_latitude_deg is None or told.site_longitude_deg is None or not told.site_position_m:
        raise CoordinatesError(
            "--by-site-placement: the plan has no latitude and longitude of the site, expected those of an IfcSite; "
            "give --origin or --control-points, or plan again if it is of an earlier version"
        )
    east, north = systems.plane.east_north(told.site_longitude_deg, told.site_latitude_deg)
    grid = systems.plane.grid_at(np.array([[east, north]]))
    if grid is None:
        raise CoordinatesError(
            f"--by-site-placement: {_place_words(told)} is far outside {systems.plane.name}, expected a position in "
            "it; give the grid of the site"
        )
    # True north is seen in the scene clockwise from +y; grid north is clockwise from true north by the convergence.
    rotation_rad = (_true_north_rad(told) or 0.0) + grid.convergence_rad
    height_m = told.site_elevation_m or 0.0
    x, y, z = told.site_position_m
    matrix = matrix_of((0.0, 0.0, 0.0), rotation_rad, 1.0)
    matrix[:3, 3] = np.array([east, north, height_m]) - matrix[:3, :3] @ np.array([x, y, z])
    return SiteFrame(
        matrix=matrix,
        source="ifc site placement",
        warnings=(
            f"the site is placed by latitude, longitude and true north of the scene file ({_place_words(told)}): good "
            "to metres or worse; use control points for setting out",
        ),
    )


def _check_scale(scale: float, what: str, remedy: str = "it is of the grid, not of units") -> None:
    if _SCALES[0] < scale < _SCALES[1]:
        return
    unit = next((f", as if one side were in {name}" for size, name in _UNITS.items()
                 if 0.99 < scale / size < 1.01 or 0.99 < scale * size < 1.01), "")  # fmt: skip
    raise CoordinatesError(f"{what} is {scale:g}{unit}, expected about 1; {remedy}")


# --------------------------------------------------------------------------------------------------- systems
def _systems_told(asked: FrameRequest) -> _Systems:
    plane, height = map_crs(asked.crs) if asked.crs else (None, None)
    if asked.vertical_crs:
        height = vertical_crs(asked.vertical_crs)
    return _Systems(plane=plane, height=height)


def _systems_of_file(asked: FrameRequest, told: Georeference) -> _Systems:
    """The file's systems; the user's word goes before."""
    given = _systems_told(asked)
    warnings: tuple[str, ...] = ()
    plane, height = given.plane, given.height
    of_file: MapCrs | None = None
    words = told.crs_name or told.description
    if told.crs_text or told.crs_name:
        try:
            of_file, height_of_file = map_crs(told.crs_text or told.crs_name, option="the scene file's CRS")
            height = height or height_of_file
        except CoordinatesError as error:
            if plane is None:
                warnings = (f"{error}; files name it as the scene file does; pass --crs",)
    plane = plane or of_file
    if height is None and told.vertical_datum:
        height = vertical_crs_of_datum(told.vertical_datum)
    return _Systems(plane, words, height, told.vertical_datum, of_file, warnings)


def _unit_of(systems: _Systems, asked: LengthUnit | None) -> LengthUnit:
    """Return the unit that people read coordinates in: as they ask, else that of the CRS."""
    return asked or (METRE if systems.plane is None else systems.plane.unit)


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
        told = "; ".join(doubt.text for doubt in sorted(doubts, key=lambda doubt: not doubt.certain))
        raise CoordinatesError(f"coordinates: {told}; --accept-implausible accepts them anyway")


def _doubts_of_fit(
    points: ControlPoints, fit: Fit, asked: FrameRequest, suspect: str, unit: LengthUnit
) -> tuple[str, ...]:
    off_m, limit_m = fit.off_m, asked.residual_limit_m
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


def _doubts_of_place(frame: SiteFrame, plane: MapCrs | None, told: Georeference | None) -> tuple[str, ...]:
    """A file's map conversion and the latitude of its site may be of two places: one is a default that nobody set."""
    if frame.source != "ifc map conversion" or plane is None or told is None:
        return ()
    if told.site_latitude_deg is None or told.site_longitude_deg is None or told.site_position_m is None:
        return ()
    placed = plane.east_north(told.site_longitude_deg, told.site_latitude_deg)
    away_m = math.dist(placed, frame.to_site(np.array(told.site_position_m))[:2])
    if away_m <= FAR_M:
        return ()
    how_far = f"{away_m / 1000:.0f} km" if math.isfinite(away_m) else "half the earth"
    return (
        f"the scene file says that its site is at {_place_words(told)}, {how_far} from where its map conversion puts "
        "it: one of the two is wrong",
    )


def _doubts_of_foot(
    frame: SiteFrame,
    plane: MapCrs | None,
    told: Georeference | None,
    document: Mapping[str, Any],
    points_m: FloatArray,
) -> tuple[str, ...]:
    """A map conversion in one foot and a system in the other are metres apart where coordinates are millions."""
    if frame.source != "ifc map conversion" or plane is None or told is None or not len(points_m):
        return ()
    # A map conversion without a map unit is in the unit of the project.
    of_file = unit_named(told.map_unit)
    if not told.map_unit:
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


def _fit_words(points: ControlPoints, fit: Fit, asked: FrameRequest, unit: LengthUnit) -> str:
    off_m = fit.off_m
    worst = int(np.argmax(off_m))
    sigma = f", sigma {unit.text(fit.sigma_plan_m, 4)}" if math.isfinite(fit.sigma_plan_m) else ""
    high = ""
    if asked.parameters == 4 and math.isfinite(fit.sigma_height_m):
        high = f" in plan and {unit.text(fit.sigma_height_m, 4)} in height"
    return (
        f"{len(points.names)} control points, {asked.parameters} parameters: turned by "
        f"{math.degrees(fit.rotation_rad):.5f} degrees, scale {fit.scale:.7f}, largest residual "
        f"{unit.text(float(off_m[worst]), 4)} ({points.names[worst]}){sigma}{high}"
    )


def _true_north_rad(told: Georeference | None) -> float | None:
    """Clockwise from the scene's +y."""
    return None if told is None or told.true_north is None else math.atan2(*told.true_north)


def _place_words(told: Georeference) -> str:
    latitude, longitude = told.site_latitude_deg, told.site_longitude_deg
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

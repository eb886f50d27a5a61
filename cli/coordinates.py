"""Options that say what the site's coordinates are, one definition each, and what they ask for."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from .inputs import numbers
from .options import Length

if TYPE_CHECKING:
    from planner_core.coordinates.request import FrameRequest
    from planner_core.model import LengthUnit

F = TypeVar("F")


#: By the name of what they tell.
COORDINATE_OPTIONS = {
    "crs": click.option("--crs", default="", metavar="EPSG:CODE|WKT",
                        help="Coordinate reference system (CRS) of the site. [default: that of the scene file]"),
    "vertical_crs": click.option("--vertical-crs", default="", metavar="EPSG:CODE|WKT",
                                 help="Vertical CRS of the site."),
    "origin": click.option("--origin", default=None, metavar="E,N,H",
                           help="Site coordinates of the scene's origin, in the unit of --units or with their own."),
    "units": click.option("--units", type=click.Choice(["m", "ft", "ftUS"]), default=None,
                          help="Unit of site coordinates, and of lengths beside them: of files that are written, of "
                               "lists and numbers that don't say theirs. ftUS: the US survey foot. [default: that of "
                               "the CRS, else m]"),
    "rotation": click.option("--rotation", default=None, type=float, metavar="DEGREES",
                             help="With --origin: rotation from scene to grid, counter-clockwise. [default: 0]"),
    "scale": click.option("--scale", default=None, type=float,
                          help="With --origin: grid scale factor, in plan. [default: 1]"),
    "control_points": click.option("--control-points", type=click.Path(path_type=Path), default=None, metavar="FILE",
                                   help="Instead of --origin: control points, CSV name,x,y,z,E,N,H[,weight]."),
    "parameters": click.option("--parameters", type=click.Choice(["4", "7"]), default=None,
                               help="Helmert transformation: 4 parameters plus height shift, or 7. [default: 4]"),
    "fixed_scale": click.option("--fixed-scale", is_flag=True, help="With --control-points: scale fixed to 1."),
    "residual_limit": click.option("--residual-limit", type=Length(least=0.0, least_open=True), default=None,
                                   metavar="LENGTH", help="With --control-points: residual above which a warning is "
                                       "given. "
                                                     "[default: 0.02]"),
    "by_site_placement": click.option("--by-site-placement", is_flag=True,
                                      help="Instead of --origin, with --crs: latitude and longitude of the IFC site."),
    "scene_coordinates": click.option("--scene-coordinates", is_flag=True,
                                      help="Scene coordinates, even if the scene file has a CRS."),
    "accept_implausible": click.option("--accept-implausible", is_flag=True,
                                       help="Accept implausible coordinates, such as swapped ones, with a warning."),
}  # fmt: skip


def coordinate_options(function: F) -> F:
    """Give a command these options; it passes their values on to `frame_request`."""
    for option in reversed(COORDINATE_OPTIONS.values()):
        function = option(function)  # type: ignore[type-var]
    return function


def frame_request(values: Mapping[str, Any]) -> FrameRequest:
    """Return what the values of `coordinate_options`, by name, ask for.

    Raises
    ------
    CoordinatesError, RequirementError
        Options that belong to another one that is not there.
    """
    from planner_core.coordinates.request import FrameRequest
    from planner_core.errors import CoordinatesError
    from planner_core.model import LENGTH_UNITS

    _check_belonging(values, CoordinatesError)
    unit = None if values["units"] is None else LENGTH_UNITS[values["units"]]
    origin = None if values["origin"] is None else _origin_m(values["origin"], unit, values["crs"])
    limit_m = values["residual_limit"]
    return FrameRequest(
        crs=values["crs"],
        vertical_crs=values["vertical_crs"],
        origin_m=None if origin is None else (origin[0], origin[1], origin[2]),
        rotation_rad=math.radians(values["rotation"] or 0.0),
        scale=1.0 if values["scale"] is None else values["scale"],
        control_points=values["control_points"],
        parameters=int(values["parameters"] or 4),
        fixed_scale=values["fixed_scale"],
        residual_limit_m=FrameRequest.residual_limit_m if limit_m is None else limit_m,
        by_site_placement=values["by_site_placement"],
        scene_coordinates=values["scene_coordinates"],
        accept_implausible=values["accept_implausible"],
        unit=unit,
    )


def _origin_m(text: str, unit: LengthUnit | None, crs: str) -> list[float]:
    """E, N, H in metres; numbers without a unit are of `unit`, else of the CRS."""
    from planner_core.coordinates.crs import map_crs

    if unit is None and crs:
        unit = map_crs(crs)[0].unit
    return numbers(text, "--origin", "E,N,H", (3,), unit=unit)


def _check_belonging(values: Mapping[str, Any], error: type[Exception]) -> None:
    belonging = {"origin": ("rotation", "scale"), "control_points": ("parameters", "fixed_scale", "residual_limit")}
    for owner, names in belonging.items():
        for name in names:
            if values[name] not in (None, False) and values[owner] is None:
                option, needed = (f"--{text.replace('_', '-')}" for text in (name, owner))
                raise error(f"{option}: got it without {needed}, which it belongs to; add that")

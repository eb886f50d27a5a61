"""Doubts about a site frame, and what a surveyor has to know of it: where the plan lies in its CRS, how true that is.

A frame can be wrong in ways that no formula notices: axes swapped, millimetres, coordinates shifted twice. Each shows
in where the plan comes to lie. Some of it is certain: nobody builds where the CRS is nowhere near.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from planner_core.coordinates.crs import MapCrs, geodesic_m
from planner_core.model import FOOT, METRE, FloatArray, SiteFrame

FAR_M = 20_000.0
"""A plan further from its origin, or from where its CRS is used, is hardly meant to be there."""
NOWHERE_NEAR_M = 1_000_000.0
"""Further than this from where its CRS is used no plan can be, whichever zone next door a country goes on with."""
_TELLING_PPM = 1.0
_UNITS = {0.001: "millimetres", FOOT.metres: "feet", METRE.metres: "metres", 1000.0: "kilometres"}
_ON_EARTH_M = 2e7
"""No easting or northing in metres is larger, and none in millimetres that is not near zero is smaller."""
_SURVEYED_PPM = 2000.0
"""Grids that people survey in distort less, heights included."""


@dataclass(frozen=True)
class Doubt:
    """text : one line for the user. certain : it is no doubt: the coordinates are wrong."""

    text: str
    certain: bool = False


def doubts_of(frame: SiteFrame, plane: MapCrs | None, points_m: FloatArray) -> tuple[Doubt, ...]:
    """Return what may be, or is, wrong.

    Parameters
    ----------
    frame
        Named, without these doubts.
    plane
        Its system; None where it is not known.
    points_m
        (N, 3) of the plan, scene frame.
    """
    if not len(points_m):
        return ()
    doubts = []
    away_m = float(np.hypot(*points_m[:, :2].mean(axis=0)))
    moved = not np.array_equal(frame.matrix, np.eye(4))
    if moved and away_m > FAR_M:
        doubts.append(
            Doubt(
                f"the plan lies {away_m / 1000:.0f} km from the scene's origin, which is also placed on the site: "
                "the scene may be in site coordinates already, then pass --origin 0,0,0 with --crs"
            )
        )
    if plane is not None:
        twice = moved and away_m > FAR_M and plane.outside_m(points_m[:, :2]) == 0.0
        doubts += _where_doubts(frame, plane, frame.to_site(points_m)[:, :2], twice=twice)
    return tuple(doubts)


def _where_doubts(frame: SiteFrame, plane: MapCrs, east_north_m: FloatArray, *, twice: bool) -> list[Doubt]:
    """Doubts about the place. twice : the scene's coordinates as they are lie inside the system's area."""
    outside_m = plane.outside_m(east_north_m)
    middle_m = east_north_m.mean(axis=0)
    if outside_m == 0.0:
        return [Doubt(line) for line in _scale_doubts(frame, plane, middle_m)]
    unit = frame.unit
    where = f"E {unit.of(middle_m[0]):.0f}, N {unit.of(middle_m[1]):.0f}{f' {unit.symbol}' if unit.is_feet else ''}"
    how_far = "far outside" if math.isinf(outside_m) else f"{_kilometres(outside_m)} outside the area of"
    line = f"the plan lies at {where}, {how_far} {plane.name} ({plane.area_name()})"
    nowhere_near = outside_m > NOWHERE_NEAR_M
    if np.array_equal(frame.matrix, np.eye(4)):
        as_they_are = f"{line}: the scene's coordinates are taken as they are; give --origin or --control-points"
        return [Doubt(as_they_are, nowhere_near)]
    if twice:
        shifted = f"{line}, and inside by the scene's own coordinates: it is georeferenced twice; pass --origin 0,0,0"
        return [Doubt(f"{shifted} with --crs {plane.name}", outside_m > FAR_M)]
    if plane.outside_m(east_north_m[:, ::-1]) == 0.0:
        swapped = f"{line}, and inside with E and N exchanged: they look swapped; exchange them"
        return [Doubt(swapped, outside_m > FAR_M)]
    for size, name in _UNITS.items():
        if name == unit.many or (size == 0.001 and np.abs(middle_m).max() < _ON_EARTH_M):
            continue
        if plane.outside_m(east_north_m * (size / unit.metres)) == 0.0:
            remedy = (
                f"give {unit.many}, or the unit with --units" if name in ("feet", "metres") else f"give {unit.many}"
            )
            taken = f"{line}, and inside where coordinates are taken as {name}: their unit looks wrong; {remedy}"
            return [Doubt(taken, nowhere_near or size == 0.001)]
    far = ": check origin and CRS" if outside_m > FAR_M else ""
    return [Doubt(line + far, nowhere_near)]


def doubts_of_renaming(of_file: MapCrs, given: MapCrs, east_north_m: FloatArray) -> tuple[Doubt, ...]:
    """Return what is wrong with taking coordinates of the scene file's system for those of another one.

    Two names of one grid, or two datums, leave the plan within metres of where it was; two zones or two grids do not.

    Parameters
    ----------
    east_north_m
        (N, 2) of the plan, by the scene file's map conversion.
    """
    if given.text == of_file.text or not len(east_north_m):
        return ()
    middle_m = east_north_m.mean(axis=0)[None, :]
    was, now = of_file.degrees(middle_m)[0], given.degrees(middle_m)[0]
    line = f"the scene file's map conversion is in {of_file.name}, and is taken to be in {given.name}"
    if not np.isfinite(was).all():  # the plan's place is not known, a doubt of its own
        return (Doubt(line),)
    away_m = geodesic_m(was, now)
    if away_m <= FAR_M:
        return (Doubt(f"{line}, {away_m:.1f} m from where it was"),)
    how_far = f"{away_m / 1000:.0f} km from" if math.isfinite(away_m) else "nowhere near"
    return (
        Doubt(
            f"{line}, {how_far} where it was; --crs labels coordinates and does not convert them: leave it out, or "
            "place the scene in it with --origin or --control-points",
            certain=True,
        ),
    )


def _scale_doubts(frame: SiteFrame, plane: MapCrs, middle_m: FloatArray) -> list[str]:
    grid = plane.grid_at(middle_m[None, :])
    ppm = 0.0 if grid is None else (frame.horizontal_scale / grid.scale - 1.0) * 1e6
    if abs(ppm) <= _SURVEYED_PPM:
        return []
    return [
        f"scene lengths are {abs(ppm) / 1e4:.1f} % too {'long' if ppm > 0 else 'short'} for {plane.name}, which is "
        "hardly the grid of the survey: give the CRS of its control points"
    ]


def notes_of(frame: SiteFrame, plane: MapCrs | None, points_m: FloatArray) -> tuple[str, ...]:
    """Return what is to be known beside the coordinates; parameters as `doubts_of`."""
    notes = []
    if not frame.vertical_name:
        notes.append("the vertical datum is not given: give it with --vertical-crs")
    elif not frame.vertical_crs:
        notes.append(
            f"heights are in {frame.vertical_name}, as the scene file has it; no vertical CRS of that name is known"
        )
    if plane is not None and len(points_m):
        notes += _distortion(frame, plane, frame.to_site(points_m).mean(axis=0))
    return tuple(notes)


def _distortion(frame: SiteFrame, plane: MapCrs, middle_m: FloatArray) -> list[str]:
    """By how much distances between coordinates differ from measured ones."""
    grid = plane.grid_at(middle_m[None, :2])
    if grid is None or plane.outside_m(middle_m[None, :2]) > FAR_M:
        return []
    true = grid.combined_scale(float(middle_m[2]))
    of_frame = frame.horizontal_scale
    ppm = (of_frame / true - 1.0) * 1e6
    held, feet = "", frame.unit.is_feet
    one, symbol = ("foot", "ft") if feet else ("metre", "m")
    if abs(ppm) >= _TELLING_PPM:
        off = f"1000 ft they are {abs(ppm) * 1e-3:.3f} ft" if feet else f"100 m they are {abs(ppm) * 0.1:.1f} mm"
        held = (
            f"; scene lengths are written with scale {of_frame:.7f}, so that over {off} too "
            f"{'long' if ppm > 0 else 'short'} for the grid"
        )
    projection_ppm, height_ppm = (grid.scale - 1.0) * 1e6, (true / grid.scale - 1.0) * 1e6
    return [
        f"at the site a {one} on the ground is {true:.7f} {symbol} on the grid (projection {projection_ppm:+.0f} "
        f"ppm, height {height_ppm:+.0f} ppm), and grid north is {abs(math.degrees(grid.convergence_rad)):.4f} degrees "
        f"{'east' if grid.convergence_rad > 0 else 'west'} of true north{held}"
    ]


def _kilometres(length_m: float) -> str:
    return f"{length_m / 1000:.0f} km" if length_m >= 1000 else f"{length_m:.0f} m"

"""What may be wrong with a list of stations that is not at the plan, or only seems to be, by what would bring it there.

Listed and planned stations, metres -> a line for the user: columns exchanged, another unit, a shift that all have, or
the plan's shape turned and shifted. Nothing here moves a list.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from planner_core.as_scanned.shape import AT_STATION_M as SHAPE_M
from planner_core.as_scanned.shape import ShapeFit, shape_fit
from planner_core.model import FloatArray
from planner_core.plan_folder.plan_source import FieldStation, PlanSource

if TYPE_CHECKING:
    from planner_core.as_scanned.station_lists import ListedStation

#: Lists are at the plan where a station is no further than this from the box around the planned ones.
_NEAR_M = 100.0
#: Differences of stations of the same names that vary by less are one shift.
_SAME_SHIFT_M = 1.0
#: Shifts whose spreads differ by less are as good as one another.
_SAME_SPREAD_M = 0.05
#: Another reading fits where so many of the stations are at planned ones: known by their names, or only by places.
_MOST, _MOST_BY_PLACE, _FEWEST, _FEWEST_BY_PLACE = 0.6, 0.8, 2, 3
AT_STATION_M = 2.0
"""Stations this near to a planned one are at it."""
#: In another unit, a list may be so much smaller than the plan, or that larger.
_LEAST_SIZE = 0.3
_SCALES = ((0.001, "millimetres"), (0.01, "centimetres"), (0.3048, "feet"), (1200.0 / 3937.0, "US survey feet"))


def is_near(at_m: FloatArray, stations: Sequence[FieldStation]) -> bool:
    """Whether any of places (N, 3), scene frame, is less than `_NEAR_M` from the box around the planned ones."""
    planned_m = np.array([station.position_m for station in stations])
    low, high = planned_m.min(axis=0) - _NEAR_M, planned_m.max(axis=0) + _NEAR_M
    return bool(((at_m >= low) & (at_m <= high)).all(axis=1).any())


def guess(listed: Sequence[ListedStation], readings: Sequence[str], plan: PlanSource, within_m: float) -> str:
    """Return what may be wrong with a list that is elsewhere, by what would bring it to the plan."""
    as_listed = np.array([each.position_m for each in listed])
    swapped = {name: _in_scene(as_listed[:, [1, 0, 2]], name, plan) for name in readings}
    if any(_fits(listed, at_m, plan, within_m) for at_m in swapped.values()):
        return _SWAPPED
    shift = _shift(listed, readings, plan)
    if shift:
        return shift
    for scale, unit in _SCALES:
        if any(_fits(listed, _in_scene(scale * as_listed, name, plan), plan, AT_STATION_M) for name in readings):
            return f"they may be in {unit}, expected metres; convert them"
    if "site" in swapped and is_near(swapped["site"], plan.stations):
        return _SWAPPED
    shape = _shape(listed, readings, plan)
    if shape:
        return shape
    what = "scene coordinates" if plan.frame.is_scene else "scene coordinates or in the site's"
    return f"expected them in {what}; give the site's with --crs and --origin or --control-points"


_SWAPPED = "easting and northing may be swapped; name the columns, or give --columns"


def _in_scene(values: FloatArray, coordinates: str, plan: PlanSource) -> FloatArray:
    return plan.frame.to_scene(values) if coordinates == "site" else values


def _shift(listed: Sequence[ListedStation], readings: Sequence[str], plan: PlanSource) -> str:
    """Return what to do about a shift that all stations have; empty where they have none in common."""
    known = {station.id.casefold(): station for station in plan.stations}
    pairs = [(each, known[each.id.casefold()]) for each in listed if each.id.casefold() in known]
    if len(pairs) < _FEWEST:
        return ""
    best: tuple[float, FloatArray, str, bool] | None = None
    for name in readings:
        for of_ground in (False, True):
            shifts_m = np.array(
                [each.position_m - _place(was, name, of_ground or each.is_ground) for each, was in pairs]
            )
            spread_m = float(np.ptp(shifts_m, axis=0).max())  # NaN, an unknown height, is not less
            if spread_m < (_SAME_SHIFT_M if best is None else best[0] - _SAME_SPREAD_M):
                best = spread_m, np.median(shifts_m, axis=0), name, of_ground
    if best is None:
        return ""
    _, shift_m, name, of_ground = best
    ground = "; their heights look like the ground's (--heights ground)" if of_ground else ""
    return f"{_shifted_words('all', shift_m, name, plan)}{ground}"


def _shifted_words(which: str, shift_m: FloatArray, coordinates: str, plan: PlanSource) -> str:
    e, n, h = (np.round(shift_m, 2) + 0.0).tolist()
    by = f"{which} are shifted by the same {e:.2f}, {n:.2f}, {h:.2f} m"
    if plan.frame.is_scene:
        return f"{by}: where that is the site's origin, give --origin {e:.2f},{n:.2f},{h:.2f}"
    return (
        f"{by} from the plan's {coordinates} coordinates: add the offset they were reduced by, or check origin and CRS"
    )


def _place(station: FieldStation, coordinates: str, of_ground: bool) -> FloatArray:
    if coordinates == "site":
        return station.site_ground_m if of_ground else station.site_m
    return station.ground_m if of_ground else station.position_m


# ---------------------------------------------------------------------------------------------- by shape
def _shape(listed: Sequence[ListedStation], readings: Sequence[str], plan: PlanSource) -> str:
    """Return what to do about a list whose names match nothing, by its shape; empty where that is not the plan's."""
    as_listed = np.array([each.position_m for each in listed])
    doubtful = ""
    for prefix, values in _variants(as_listed, _planned_m(listed, "scene", plan)):
        for name in readings:
            fit = shape_fit(values, _planned_m(listed, name, plan), may_turn=False)
            if fit is not None and fit.is_certain:
                which = f"{prefix}by their shape {_agreeing(fit, listed)}"
                return _shifted_words(which, fit.shift_m, name, plan) + _names_words(fit, listed, plan)
        fit = shape_fit(values, _planned_m(listed, "scene", plan))
        if fit is not None and fit.is_certain:
            origin = ",".join(f"{value + 0.0:.3f}" for value in fit.shift_m.tolist())
            return (
                f"{prefix}by their shape {_agreeing(fit, listed)} lie as planned, turned by {_degrees(fit)} degrees: "
                f"where that is right, give --origin {origin} --rotation {_degrees(fit)}"
                f"{_names_words(fit, listed, plan)}"
            )
        if fit is not None and not doubtful:
            doubtful = (
                f"{prefix}they have the plan's shape, but fit it in several ways, so that stations can't be "
                "distinguished; give the scene's position with --origin or --control-points"
            )
    return doubtful


def _variants(as_listed: FloatArray, planned_m: FloatArray) -> list[tuple[str, FloatArray]]:
    """The list as it is, with its columns exchanged, and in other units where its size suggests one."""
    size_m = float(np.ptp(as_listed[:, :2], axis=0).max())
    planned_size_m = float(np.ptp(planned_m[:, :2], axis=0).max())
    found = [("", as_listed), ("easting and northing look swapped (name the columns, or give --columns): exchanged, ",
                               as_listed[:, [1, 0, 2]])]  # fmt: skip
    for scale, unit in _SCALES[:3]:
        if _LEAST_SIZE * planned_size_m < scale * size_m < planned_size_m / _LEAST_SIZE:
            found.append((f"they may be in {unit}, expected metres (convert them): converted, ", scale * as_listed))
    return found


def _planned_m(listed: Sequence[ListedStation], coordinates: str, plan: PlanSource) -> FloatArray:
    """(M, 3) where the plan has stations, or the ground below them where the list has that."""
    of_ground = all(each.is_ground for each in listed)
    return np.array([_place(station, coordinates, of_ground) for station in plan.stations])


def _agreeing(fit: ShapeFit, listed: Sequence[ListedStation]) -> str:
    return f"{len(fit.pairs)} of {len(listed)} (to {fit.rms_m:.2f} m)"


def _degrees(fit: ShapeFit) -> str:
    return f"{math.degrees(fit.turn_rad) + 0.0:.4f}"


def _names_words(fit: ShapeFit, listed: Sequence[ListedStation], plan: PlanSource) -> str:
    """Say so where names that the plan has, too, are those of other stations."""
    planned = [station.id.casefold() for station in plan.stations]
    others = [listed[i].id.casefold() for i, k in fit.pairs.tolist() if listed[i].id.casefold() != planned[k]]
    return (
        "; its names belong to other stations than in the plan: give --match place"
        if set(others) & set(planned)
        else ""
    )


def shape_doubts(
    listed: Sequence[ListedStation], at_m: FloatArray, coordinates: str, plan: PlanSource, within_m: float
) -> tuple[str, ...]:
    """Return a line where a list (N, 3), read in the scene frame, is at the plan but fits it elsewhere only.

    coordinates : of the list, `scene` or `site`; in them a shift is given. Lists of planned names that are all off
    alike are reported when they are matched, see `matching.doubts`.
    """
    now = max(_at_stations(listed, at_m, plan.stations, within_m))
    if now >= _MOST * len(listed):
        return ()
    as_listed = np.array([each.position_m for each in listed])
    fit = shape_fit(as_listed, _planned_m(listed, coordinates, plan))
    if fit is None or len(fit.pairs) < 2 * now:
        return ()
    if not fit.is_certain:
        return (
            f"as listed, {now} of {len(listed)} stations are within {within_m:g} m of planned ones, and the list fits "
            "the plan's shape in several other ways: check the origin of its coordinates",
        )
    known = {station.id.casefold(): k for k, station in enumerate(plan.stations)}
    named = sum(known.get(listed[i].id.casefold()) == k for i, k in fit.pairs.tolist())
    if fit.turn_rad == 0.0 and named >= _MOST * len(listed):
        return ()
    axes = ("E", "N", "H") if coordinates == "site" else ("x", "y", "z")
    shifts = zip(axes, (np.round(fit.shift_m, 2) + 0.0).tolist(), strict=True)
    by = ", ".join(f"{axis} {value:+.2f}" for axis, value in shifts)
    moved = f"turned by {_degrees(fit)} degrees and shifted" if fit.turn_rad else f"shifted by {by} m"
    return (
        f"the list has the plan's shape, but {moved}: without that, {len(fit.pairs)} of {len(listed)} "
        f"stations are within {SHAPE_M:g} m of planned ones, as listed {now} within {within_m:g} m; check the origin "
        f"of its coordinates{_names_words(fit, listed, plan)}",
    )


# ---------------------------------------------------------------------------------------------- at the plan
def swap_doubts(
    listed: Sequence[ListedStation], at_m: FloatArray, coordinates: str, plan: PlanSource, within_m: float
) -> tuple[str, ...]:
    """Return a line where a list at the plan fits it with its first two columns exchanged, and does not as it is."""
    as_listed = np.array([each.position_m for each in listed])
    swapped_m = _in_scene(as_listed[:, [1, 0, 2]], coordinates, plan)
    now = _at_stations(listed, at_m, plan.stations, within_m)
    then = _at_stations(listed, swapped_m, plan.stations, within_m)
    if _are_most(*then, len(listed), by_name_only=True):
        were, are = now[0], then[0]
    elif _are_most(*then, len(listed)):
        were, are = max(now), then[1]
    else:
        return ()
    if 2 * were > are:
        return ()
    names = "x and y" if coordinates == "scene" else "easting and northing"
    return (
        f"{names} of the list may be swapped: exchanged, {are} of {len(listed)} stations are within "
        f"{within_m:g} m of planned ones, as listed {were}; name the columns, or give --columns",
    )


def _fits(listed: Sequence[ListedStation], at_m: FloatArray, plan: PlanSource, within_m: float) -> bool:
    """Whether most stations, (N, 3) in the scene frame, are at planned ones."""
    return _are_most(*_at_stations(listed, at_m, plan.stations, within_m), len(listed))


def _are_most(by_name: int, by_place: int, n_listed: int, *, by_name_only: bool = False) -> bool:
    if by_name >= max(_FEWEST, _MOST * n_listed):
        return True
    return not by_name_only and by_place >= max(_FEWEST_BY_PLACE, _MOST_BY_PLACE * n_listed)


def _at_stations(
    listed: Sequence[ListedStation], at_m: FloatArray, stations: Sequence[FieldStation], within_m: float
) -> tuple[int, int]:
    """Count stations at the planned one of their name; and at any, each of which counts once."""
    away_m = np.array([_away_m(at_m, station) for station in stations])
    number = {station.id.casefold(): k for k, station in enumerate(stations)}
    known = [(number[each.id.casefold()], i) for i, each in enumerate(listed) if each.id.casefold() in number]
    by_name = sum(bool(away_m[k, i] <= within_m) for k, i in known)
    taken: set[int] = set()
    there: set[int] = set()
    for k, i in sorted(np.argwhere(away_m <= within_m).tolist(), key=lambda pair: float(away_m[pair[0], pair[1]])):
        if k not in taken and i not in there:
            taken.add(k)
            there.add(i)
    return by_name, len(taken)


def _away_m(at_m: FloatArray, station: FieldStation) -> FloatArray:
    """Distances of places to a station's sensor, or to its ground point where that is nearer."""
    to_sensor = np.linalg.norm(at_m - station.position_m, axis=1)
    return np.asarray(np.fmin(to_sensor, np.linalg.norm(at_m - station.ground_m, axis=1)))

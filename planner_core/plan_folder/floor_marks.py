"""What maps and sheets mark on a floor: the route, stations, stairs, entrances, rooms out of reach, zones.

PlanSource -> lines and words in plan, scene frame, metres; whoever draws places them on paper.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise
from typing import Any

import numpy as np

from planner_core.model import BoolArray, FloatArray, LengthUnit
from planner_core.model.arrays import bounds_of
from planner_core.plan_folder.drawing.canvas import INK, Canvas
from planner_core.plan_folder.drawing.hatching import Family, spans_of_rings
from planner_core.plan_folder.drawing.marks import (
    LINKS,
    WEAK,
    DrawnZone,
    Labels,
    draw_route,
    draw_stations,
    draw_zones,
    forbidden_zone,
    link_class,
    linked_words,
    rise_words,
    zone_words,
)
from planner_core.plan_folder.plan_model.results import FloorSection
from planner_core.plan_folder.plan_source import FieldStation, PlanSource, limits_of, link_of
from planner_core.plan_folder.plan_words import area_words, length_words

Ground = Callable[[int], FloatArray]
"""Triangles (K, 3, 2) of the ground of the floor of that number, scene frame."""
OnPaper = Callable[[FloatArray], FloatArray]
"""Leads from the scene frame in plan, (..., 2) metres, to millimetres on paper."""

#: Ground this much below a floor's is still that floor's: steps, ramps, rounding.
_BELOW_M = 0.3
#: An upper floor's ground is searched where the route is not this much below it: nobody walks under it there.
_CLIMB_M = 1.0
#: A forbidden position this much below a floor is on it.
_ON_GROUND_M = 0.3
#: How exactly: a fifth of a millimetre on paper at 1:50.
_STEP_M = 0.01
#: Targets hang about this high above the ground.
_HAND_M = 1.3
#: An entrance this near to the start of the route is the start.
_SAME_PLACE_M = 1.0
#: Up to so many stations on a drawing, ids that are not their numbers are written beside them.
_MAX_IDS = 60


@dataclass(frozen=True, eq=False)
class FloorSegment:
    """A stretch of the route on one floor. points_m : (M, 2). heights_m : (M,). Scene frame.

    arrives, leaves : words where it goes over from or to another floor.
    """

    points_m: FloatArray
    heights_m: FloatArray
    arrives: str = ""
    leaves: str = ""

    @property
    def length_m(self) -> float:
        """In space."""
        return float(np.linalg.norm(np.diff(np.column_stack([self.points_m, self.heights_m]), axis=0), axis=1).sum())

    def parted_at(self, height_m: float) -> tuple[list[FloatArray], list[FloatArray]]:
        """Lines (K, 2) of what of it is up to a height, and of what is above."""
        points_m = np.column_stack([self.points_m, self.heights_m])
        corners_m = [points_m[0]]
        for a_m, b_m in pairwise(points_m):
            if (a_m[2] > height_m) != (b_m[2] > height_m):
                corners_m.append(a_m + (height_m - a_m[2]) / (b_m[2] - a_m[2]) * (b_m - a_m))
            corners_m.append(b_m)
        is_above = [bool(a_m[2] + b_m[2] > 2 * height_m) for a_m, b_m in pairwise(corners_m)]
        parts: tuple[list[FloatArray], list[FloatArray]] = ([], [])
        for above, group in groupby(range(len(is_above)), key=is_above.__getitem__):
            pieces = list(group)
            parts[above].append(np.array(corners_m[pieces[0] : pieces[-1] + 2])[:, :2])
        return parts


@dataclass(frozen=True, eq=False)
class Mark:
    """A place (2,) with a word."""

    at_m: FloatArray
    words: str


def ways_on(plan: PlanSource, floor: FloorSection, ground: Ground | None = None) -> list[FloorSegment]:
    """Stretches of the route on a floor, in the order of the route.

    ground : gives where the upper floor's ground begins; without it a way changes floors at one of its corners.
    """
    route = plan.document.get("route")
    number = {each.id: index for index, each in enumerate(plan.floors)}
    floor_of = {station.id: number[station.floor_id] for station in plan.stations if station.floor_id in number}
    ways: list[FloorSegment] = []
    for leg in [] if route is None else route["legs"]:
        points_m = np.array(leg["points"], dtype=np.float64).reshape(-1, 3)
        if len(points_m) < 2:
            continue
        floors = _floor_of_pieces(plan, points_m, leg["floors"]).tolist()
        # Stairs that end at a station are of the floor below, though the station is not.
        chain = [floor_of.get(leg["from"], floors[0]), *floors, floor_of.get(leg["to"], floors[-1])]
        stretches = _stretches(plan, points_m, chain, ground)
        for place, (here, part_m) in enumerate(stretches):
            if here == number[floor.id] and len(part_m) > 1:
                before = stretches[place - 1][0] if place else here
                after = stretches[place + 1][0] if place + 1 < len(stretches) else here
                arrives = _stairs(plan, "from", leg["from"], before) if before != here else ""
                leaves = _stairs(plan, "to", leg["to"], after) if after != here else ""
                ways.append(FloorSegment(part_m[:, :2], part_m[:, 2], arrives, leaves))
    return ways


def _stretches(
    plan: PlanSource, points_m: FloatArray, chain: list[int], ground: Ground | None
) -> list[tuple[int, FloatArray]]:
    """Cut a leg (M, 3) into stretches of one floor each, (K, 3); K is 1 where one has no length.

    chain : floors of where it starts, of its M - 1 pieces, and of where it ends.
    """
    along_m = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points_m, axis=0), axis=1)))
    corners = [corner for corner in range(len(points_m)) if chain[corner] != chain[corner + 1]]
    cuts_m, last_m = [0.0], 0.0
    for place, corner in enumerate(corners):
        until_m = float(along_m[corners[place + 1]] if place + 1 < len(corners) else along_m[-1])
        found_m = _crossing_m(plan, points_m, along_m, (last_m, until_m), (chain[corner], chain[corner + 1]), ground)
        cuts_m.append(float(along_m[corner]) if found_m is None else found_m)
        last_m = max(cuts_m[-1], float(along_m[corner]))
    cuts_m.append(float(along_m[-1]))
    floors = [chain[0], *(chain[corner + 1] for corner in corners)]
    return [
        (floor, _part(points_m, along_m, start_m, end_m))
        for floor, start_m, end_m in zip(floors, cuts_m[:-1], cuts_m[1:], strict=True)
    ]


def _part(points_m: FloatArray, along_m: FloatArray, start_m: float, end_m: float) -> FloatArray:
    """(K, 3) corners of what of a line (M, 3) is between two places along it."""
    inside_m = along_m[(along_m > start_m) & (along_m < end_m)]
    return _at(points_m, along_m, np.unique(np.concatenate([[start_m], inside_m, [end_m]])))


def _at(points_m: FloatArray, along_m: FloatArray, at_m: FloatArray) -> FloatArray:
    """(K, D) places on a line (M, D) so far along it."""
    return np.stack([np.interp(at_m, along_m, axis_m) for axis_m in points_m.T], axis=1)


def _crossing_m(
    plan: PlanSource,
    points_m: FloatArray,
    along_m: FloatArray,
    within_m: tuple[float, float],
    floors: tuple[int, int],
    ground: Ground | None,
) -> float | None:
    """Find how far along a leg the upper of two floors begins, or ends; None where its ground is not met.

    The leg is straight between its corners and stairs are not: its heights alone are half a metre of way off.
    """
    if ground is None:
        return None
    lower, upper = sorted(floors, key=lambda index: plan.floors[index].elevation_m)
    top_m = plan.floors[upper].elevation_m
    least_m = top_m - min(_CLIMB_M, 0.5 * (top_m - plan.floors[lower].elevation_m))
    at_m = np.linspace(*within_m, max(2, math.ceil((within_m[1] - within_m[0]) / _STEP_M) + 1))
    places_m = _at(points_m, along_m, at_m)
    high = places_m[:, 2] > least_m
    high[high] = _is_over(ground(upper), places_m[high, :2])
    met = np.flatnonzero(high)
    if not met.size:
        return None
    return float(at_m[met[0] if floors[1] == upper else met[-1]])


def _is_over(corners_m: FloatArray, places_m: FloatArray) -> BoolArray:
    """(N,) bool: places (N, 2) over triangles (K, 3, 2)."""
    over = np.zeros(len(places_m), dtype=np.bool_)
    if not len(places_m):
        return over
    low_m, high_m = places_m.min(axis=0), places_m.max(axis=0)
    lowest_m, highest_m = bounds_of(corners_m)
    near = (highest_m >= low_m) & (lowest_m <= high_m)
    for corner_m in corners_m[near.all(axis=1)]:
        side = np.stack([_side(corner_m[i], corner_m[(i + 1) % 3], places_m) for i in range(3)])
        over |= (side >= 0).all(axis=0) | (side <= 0).all(axis=0)
    return over


def _side(a_m: FloatArray, b_m: FloatArray, places_m: FloatArray) -> FloatArray:
    """(N,) positive where a place is to the left of the line from a to b."""
    (dx, dy), off = b_m - a_m, places_m - a_m
    return np.asarray(dx * off[:, 1] - dy * off[:, 0])


def _floor_of_pieces(plan: PlanSource, points_m: FloatArray, passed: list[str]) -> Any:
    """(M - 1,) floor on which each piece of a leg lies: of those that it passes, the highest not above its lower end.

    Stairs are of the floor below.
    """
    index = {floor.id: number for number, floor in enumerate(plan.floors)}
    there = sorted({index[name] for name in passed if name in index}, key=lambda i: plan.floors[i].elevation_m)
    if not there or len(points_m) < 2:
        return np.full(max(len(points_m) - 1, 0), there[0] if there else 0)
    grounds_m = np.array([plan.floors[i].elevation_m for i in there]) - _BELOW_M
    lower_m = np.minimum(points_m[:-1, 2], points_m[1:, 2])
    return np.array(there)[np.clip(np.searchsorted(grounds_m, lower_m, side="right") - 1, 0, None)]


def _stairs(plan: PlanSource, sense: str, station: str | None, floor: int) -> str:
    number = next((f"{each.number}, " for each in plan.stations if each.id == station), "")
    return f"{sense} {number}{plan.floors[floor].name}"


def breaks_on(plan: PlanSource, floor: FloorSection) -> list[Mark]:
    """Return stations that no path inside leads from, and the next of the route."""
    route = plan.document.get("route")
    at = {station.id: station for station in plan.stations}
    marks = []
    for leg in [] if route is None else route["legs"]:
        if leg["points"]:
            continue
        for here, other, sense in ((leg["from"], leg["to"], "then"), (leg["to"], leg["from"], "from")):
            if here in at and other in at and at[here].floor_id == floor.id:
                words = f"{sense} {at[other].number}, no path inside"
                marks.append(Mark(at[here].position_m[:2], words))
    return marks


def ends_on(plan: PlanSource, floor: FloorSection) -> list[Mark]:
    """Return where the route begins and ends, where these are places of their own, and further entrances."""
    route = plan.document.get("route") or {"start": None, "end": None, "returns": False}
    places = [(route["start"], "start and end" if route["returns"] else "start")]
    places += [] if route["returns"] else [(route["end"], "end")]
    ends = [(np.array(place, dtype=np.float64), words) for place, words in places if place is not None]
    doors = [np.array(place, dtype=np.float64) for place in plan.document.get("site", {}).get("entrances", ())]
    doors = [at_m for at_m in doors if all(np.hypot(*(at_m - end_m)[:2]) > _SAME_PLACE_M for end_m, _ in ends)]
    marks = [*((at_m, "entrance") for at_m in doors), *ends]
    return [Mark(at_m[:2], words) for at_m, words in marks if _is_on(plan, floor, float(at_m[2]))]


def targets_on(plan: PlanSource, floor: FloorSection) -> list[Mark]:
    """Return places for targets between stations that do not register without, with their heights above the floor."""
    number = {station.id: station.number for station in plan.stations}
    gaps = _gaps_to_close(plan.document["registration"])
    of_pairs = [(link.a, link.b, link.targets_m) for link in plan.links if link.targets_m]
    of_pairs += [(gap["best"]["a"], gap["best"]["b"], gap["targets"]) for gap in gaps]
    marks = []
    for a, b, places_m in of_pairs:
        ends = f"{number.get(a, a)}/{number.get(b, b)}"
        for x, y, z in places_m:
            if _is_on(plan, floor, z - _HAND_M):
                height = length_words(plan.frame.unit, z - floor.elevation_m, 1)
                marks.append(Mark(np.array([x, y]), f"target {ends}, {height} up"))
    return marks


def _gaps_to_close(registration: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Gaps with places for targets that make one network of as many as can be, nearest to counting: Kruskal's tree."""
    gaps = registration.get("gaps", ())
    network = list(range(1 + max((max(gap["networks"]) for gap in gaps), default=0)))
    closed = []
    limits = limits_of(registration)
    for gap in sorted(gaps, key=lambda gap: -link_of(gap["best"]).margin(limits)):
        one, other = (network[number] for number in gap["networks"])
        if one != other and gap.get("targets"):
            network = [one if of == other else of for of in network]
            closed.append(gap)
    return closed


def unreachable_on(plan: PlanSource, floor: FloorSection) -> list[Mark]:
    """Return rooms of a floor that nobody can walk into."""
    return [
        Mark(
            np.array(area["inside"][:2], dtype=np.float64),
            f"not reachable, {area_words(plan.frame.unit, float(area['area_m2']))}",
        )
        for area in plan.document.get("sealed", ())
        if area["floor"] == floor.id
    ]


def rooms_on(plan: PlanSource, floor: FloorSection) -> list[Mark]:
    """Return the names of a floor's rooms, where these are roomiest."""
    return [Mark(room.at_m, room.name) for room in plan.rooms if room.floor_id == floor.id]


def zones_on(plan: PlanSource, floor: FloorSection) -> list[DrawnZone]:
    """Return keep-outs, access areas and forbidden positions of a floor, scene frame."""
    site = plan.document.get("site", {})
    names = ("", floor.id.casefold(), floor.name.casefold())
    zones = [
        DrawnZone(
            np.array([*area["outline"], area["outline"][0]]), zone_words(area["name"], access=bool(area["access"]))
        )
        for area in site.get("keep_out", ())
        if area["floor"].casefold() in names
    ]
    for place in site.get("settled", ()):
        x, y, height_m = place["position"]
        # Without a floor it is of the highest one below it, as in planning.
        below = [each for each in plan.floors if each.elevation_m <= height_m + _ON_GROUND_M] or plan.floors[:1]
        here = place["floor"].casefold() in names[1:] if place["floor"] else below[-1].id == floor.id
        if place["role"] == "forbidden" and here:
            zones.append(forbidden_zone(x, y, place["radius_m"]))
    return zones


def _is_on(plan: PlanSource, floor: FloorSection, height_m: float) -> bool:
    """Whether ground of that height is nearest to this floor's."""
    nearest = min(plan.floors, key=lambda each: abs(each.elevation_m - height_m))
    return nearest.id == floor.id


def stairs_on(ways: Iterable[FloorSegment]) -> list[Mark]:
    """Return where ways go over from and to other floors."""
    return [
        Mark(at_m, words)
        for way in ways
        for words, at_m in ((way.arrives, way.points_m[0]), (way.leaves, way.points_m[-1]))
        if words
    ]


def unreachable_hatch_m(plan: PlanSource, floor: FloorSection, step_m: float) -> list[FloatArray]:
    """(2, 2) lines that hatch the rooms of a floor that nobody can walk into, `step_m` apart."""
    family = Family(step_m, np.pi / 4)
    corners_m = [
        np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
        for area in plan.document.get("sealed", ())
        if area["floor"] == floor.id
        for (x0, y0), (x1, y1) in area["rectangles"]
    ]
    return list(spans_of_rings([corners_m], family).lines(family))


def floor_links(plan: PlanSource, floor: FloorSection) -> tuple[tuple[FloatArray, ...], dict[str, tuple[int, ...]]]:
    """Return ends (K, 2, 2) of the links among stations of a floor, by class; and of each of its stations that links to
    stations of other floors, their numbers.
    """
    at = {station.id: station for station in plan.stations}
    ends: tuple[list[FloatArray], ...] = tuple([] for _ in LINKS)
    elsewhere: dict[str, list[int]] = {}
    for link in plan.links:
        kind = link_class(link, plan.limits)
        if kind is None or link.a not in at or link.b not in at:
            continue
        pair = at[link.a], at[link.b]
        here = [station.floor_id == floor.id for station in pair]
        if all(here):
            ends[kind].append(np.stack([station.position_m[:2] for station in pair]))
        elif any(here) and kind > WEAK:
            inside, outside = pair if here[0] else pair[::-1]
            elsewhere.setdefault(inside.id, []).append(outside.number)
    by_class = tuple(np.array(part).reshape(-1, 2, 2) for part in ends)
    return by_class, {name: tuple(sorted(numbers)) for name, numbers in elsewhere.items()}


# -------------------------------------------------------------------------------------------------- on paper
def draw_ways(canvas: Canvas, ways: Iterable[FloorSegment], on_paper: OnPaper, cut_at_m: float) -> None:
    """Draw stretches of the route, dashed where they climb above the cut, which is at a height of the scene frame."""
    low: list[FloatArray] = []
    high: list[FloatArray] = []
    for way in ways:
        parts = way.parted_at(cut_at_m)
        low += [on_paper(part) for part in parts[0]]
        high += [on_paper(part) for part in parts[1]]
    draw_route(canvas, [on_paper(way.points_m) for way in ways], low, high)


def draw_zone_borders(canvas: Canvas, zones: Iterable[DrawnZone], on_paper: OnPaper) -> list[DrawnZone]:
    """Draw borders of zones, and return the zones on paper."""
    placed = [DrawnZone(on_paper(zone.outline), zone.words) for zone in zones]
    draw_zones(canvas, [zone.outline for zone in placed])
    return placed


def draw_floor_stations(
    labels: Labels,
    floor: FloorSection,
    stations: Sequence[FieldStation],
    spots: FloatArray,
    *,
    scanned: frozenset[str],
    elsewhere: Mapping[str, tuple[int, ...]],
    unit: LengthUnit,
    mm_per_m: float,
    slopes: bool = False,
) -> None:
    """Draw numbered discs at spots (N, 2), and beside them ids, heights and links to other floors.

    slopes : the whole floor does, so that heights are left out.
    """
    words = [
        "  ".join(
            part
            for part in (
                "" if len(stations) > _MAX_IDS or _is_number(station.id, station.number) else station.id,
                "" if slopes else rise_words(float(station.ground_m[2]) - floor.elevation_m, unit),
                linked_words(elsewhere.get(station.id, ())),
            )
            if part
        )
        for station in stations
    ]
    numbers, before = [station.number for station in stations], [station.id in scanned for station in stations]
    draw_stations(labels, spots, numbers, words, scanned=before, mm_per_m=mm_per_m)


def _is_number(name: str, number: int) -> bool:
    """Whether an id adds nothing to the number in the disc."""
    digits = name.lstrip("S")
    return digits.isdecimal() and int(digits) == number


def draw_floor_words(
    labels: Labels,
    on_paper: OnPaper,
    *,
    stairs: Iterable[Mark],
    ends: Sequence[Mark],
    breaks: Iterable[Mark],
    targets: Iterable[Mark],
    unreachable: Iterable[Mark],
    zones: Iterable[DrawnZone],
    rooms: Iterable[Mark],
) -> None:
    """Write where the route changes floors, begins, ends and breaks off, where targets help and nobody gets in, what
    zones are, and names of rooms where there is space.

    zones : on paper.
    """
    canvas = labels.canvas
    for mark in stairs:
        at = on_paper(mark.at_m)
        canvas.area([at + 1.05 * np.array([(-1, 0), (0, -1), (1, 0), (0, 1)])], INK)
        labels.put(at, mark.words)
    for mark in (*ends, *breaks):
        labels.put(on_paper(mark.at_m), mark.words)
    for mark in ends:
        canvas.area([on_paper(mark.at_m) + 1.2 * np.array([(-1, -0.7), (1, -0.7), (0, 1)])], INK)
    for mark in targets:
        at = on_paper(mark.at_m)
        canvas.area([at + 0.75 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])], INK)
        labels.put(at, mark.words)
    for mark in unreachable:
        labels.put(on_paper(mark.at_m), mark.words, apart=0.0)
    for zone in zones:
        labels.put(zone.outline[:-1].mean(axis=0), zone.words, apart=0.0)
    for mark in rooms:
        labels.put_where_free(on_paper(mark.at_m), mark.words)

"""Report on the registration network of a plan: what is connected, on which links, and what is missing where not.

Input a plan's `Link`s, station ids and floors; output `Registration`, and warnings in words.

Links are edges, stations nodes. Bridges and articulation stations are found by one depth-first walk with low points: a
link to a child is a bridge where nothing below the child reaches back above it; the parent is an articulation where
nothing below reaches back above itself. The bottleneck is the least margin of a spanning tree of greatest margins
(Kruskal), see `LinkLimits.margin`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from types import MappingProxyType

from planner_core.coverage.percent import probability_percent, reached_percent
from planner_core.errors import RequirementError
from planner_core.model import FloatArray, Link, LinkLimits, PreAlignment
from planner_core.model.registration import FloorNetworks, NetworkGap, NetworkJoin, Registration, RegistrationNetwork
from planner_core.network.links import MIN_LISTED_OVERLAP
from planner_core.network.weak_motion import motion_words

#: More networks than these are counted, not listed one by one.
_MOST_LISTED = 6

#: In each line of `_apart` and `_alone`.
_OF_GROUPS = re.compile(r"\b(do|does) not register with the others\b|\bregister neither with one another\b")
#: Where registration starts from so little that no pair of the campaign is sure to register.
_UNPLACED: Mapping[str, str] = MappingProxyType(
    {PreAlignment.LEVEL: "only level", PreAlignment.NONE: "neither placed nor level"}
)
#: What joins groups that share no surface, and how well: Buildings 2021, 11(9), 386, which registered scans without
#: common surface by the cloud of such a pass.
HANDHELD, HANDHELD_MM = "a pass from one to the other with a handheld scanner", (18, 51)
_NO_NAMES: Mapping[str, str] = MappingProxyType({})
_Neighbours = dict[str, list[str]]
#: Of groups that no link indoors joins, where nobody has found out what stations outdoors would do.
WAY_OUT = "--join outside plans stations outdoors, too, which join through exterior doors what no door indoors joins"


def registration_report(
    links: Sequence[Link],
    station_ids: Sequence[str],
    floors: Sequence[str],
    *,
    limits: LinkLimits,
    loops: bool = False,
    only_join: Collection[str] = (),
) -> Registration:
    """Say how stations are connected.

    Parameters
    ----------
    links
        Of the stations, also those that do not count: they say what is missing. Each pair once.
    floors
        (S,) floor of each station.
    limits
        What a link needs. A figure that is NaN was not computed and is not judged.
    loops
        Whether every network of three or more stations has to survive the failure of a link.
    only_join
        Ids of stations without which all surface that is required is covered as well.

    Raises
    ------
    RequirementError
        A link between stations that are not there, a pair twice, or floors that are not one a station.
    """
    _check(links, station_ids, floors)
    good = [link for link in links if link.counts(limits)]
    floor_of = dict(zip(station_ids, floors, strict=True))
    groups = sorted(_groups(station_ids, good), key=lambda group: -len(group))
    network_of = {station: number for number, group in enumerate(groups) for station in group}
    good_of: list[list[Link]] = [[] for _ in groups]
    for link in good:
        good_of[network_of[link.a]].append(link)
    return Registration(
        limits=limits,
        loops=loops,
        networks=tuple(_network(*each, floor_of, limits) for each in zip(groups, good_of, strict=True)),
        floors=tuple(_floor(floor, floor_of, good) for floor in dict.fromkeys(floors)),
        floor_joins=tuple(link for link in good if floor_of[link.a] != floor_of[link.b]),
        gaps=_gaps(links, network_of, limits),
        doors_needed=_doors_needed(station_ids, good, len(groups)),
        joins=tuple(_joins(station_ids, good, floor_of, only_join)),
    )


def registration_warnings(
    registration: Registration,
    floor_names: Mapping[str, str] = _NO_NAMES,
    *,
    offset_m: FloatArray | tuple[float, float, float] = (0.0, 0.0, 0.0),
    pre_alignment: PreAlignment = PreAlignment.MANUAL,
    has_way_out: bool = False,
) -> tuple[str, ...]:
    """One line for each unconnected group that overlaps others, one for two that are the nearest to each other, one for
    all that overlap none, and one for each group held together by single links where a redundant network is required;
    one where stations outdoors may join what no link does; and one where registration starts from too little.

    Groups that are nearest to one another have a further line for what all of them together lack to the others: closing
    the gaps of all lines makes one network, where links can.

    floor_names : names of floor ids, for people; ids stand for themselves where they have none.
    offset_m : scene = local + offset, for places of targets. pre_alignment : where registration starts. has_way_out :
    whether exterior doors lead to places where no station of this plan may stand.
    """
    registration = replace(registration, gaps=tuple(_moved(gap, offset_m) for gap in registration.gaps))
    gaps = _best_gaps(registration)
    alone = [number for number, gap in gaps.items() if gap is None]
    near: dict[tuple[int, int], list[int]] = {}  # of both sides of a gap, where it is the best of both
    for number, gap in gaps.items():
        if gap is not None:
            near.setdefault(gap.networks, []).append(number)
    best = {gap.networks: gap for gap in gaps.values() if gap is not None}
    lines = [_apart(registration, near[pair], best[pair], floor_names) for pair in list(near)[:_MOST_LISTED]]
    more = [number for pair in list(near)[_MOST_LISTED:] for number in near[pair]]
    if not more:
        lines += _together(registration, [gap for gap in gaps.values() if gap is not None], floor_names)
    if more:
        n_stations = sum(len(registration.networks[number].stations) for number in more)
        lines.append(
            f"{len(more)} more groups, of {n_stations} stations, do not register with the others; see the "
            "links of the plan"
        )
    if alone:
        lines.append(_alone([registration.networks[number] for number in alone], floor_names))
    if has_way_out and len(set(_joined_by_gaps(registration))) > 1:
        lines.append(WAY_OUT)
    if pre_alignment in _UNPLACED and not registration.connected:
        lines.append(
            f"no pair of scans that are {_UNPLACED[pre_alignment]} registers surely; place them by hand "
            "(--pre-alignment manual), or register all with targets"
        )
    if registration.loops:
        lines += [_hangs(network) for network in registration.networks if not network.survives_a_link]
    return tuple(lines)


def targets_warning(links: Iterable[Link]) -> Iterator[str]:
    """A line about pairs of stations that targets alone register; none of none."""
    pairs = [f"{link.a} to {link.b}" for link in links if link.targets_m]
    if pairs:
        register, each = ("registers", "") if len(pairs) == 1 else ("register", " for each pair")
        yield (
            f"{_listed(pairs)} {register} by targets alone: hang three{each} where both stations see them; places are "
            "on the floor maps and in the report"
        )


def groups_first(warnings: Iterable[str]) -> list[str]:
    """Warnings of a plan, those of unconnected groups first: what is scanned in these can't be put together.

    They are known by their words, which plan folders of older versions have, too.
    """
    return sorted(warnings, key=lambda line: _OF_GROUPS.search(line) is None)


# ------------------------------------------------------------------------------------------------- graphs
def _groups(stations: Iterable[str], links: Iterable[Link]) -> list[tuple[str, ...]]:
    """Stations that links join, each group in the order of stations and groups by their first."""
    neighbours = _neighbours(stations, links)
    left = dict.fromkeys(neighbours)
    place = {station: number for number, station in enumerate(neighbours)}
    groups = []
    for station in neighbours:
        if station not in left:
            continue
        front, group = [station], []
        del left[station]
        while front:
            group.append(front.pop())
            for other in neighbours[group[-1]]:
                if other in left:
                    del left[other]
                    front.append(other)
        groups.append(tuple(sorted(group, key=lambda one: place[one])))
    return groups


def _doors_needed(stations: Sequence[str], good: Sequence[Link], n_groups: int) -> tuple[str, ...]:
    """Open doors by which links go that the network falls apart without."""
    doors = sorted({door for link in good for door in link.only_open})
    left = {door: [link for link in good if door not in link.only_open] for door in doors}
    return tuple(door for door in doors if len(_groups(stations, left[door])) > n_groups)


def _joins(
    stations: Sequence[str], good: Sequence[Link], floor_of: Mapping[str, str], only_join: Collection[str]
) -> Iterator[NetworkJoin]:
    """What stations join that coverage does not need."""
    between = [link for link in good if (link.a in only_join) != (link.b in only_join)]
    others = [station for station in stations if station not in only_join]
    groups = _groups(others, [link for link in good if link.a not in only_join and link.b not in only_join])
    group_of = {station: number for number, group in enumerate(groups) for station in group}
    joining = [station for station in stations if station in only_join]
    for cluster in _groups(joining, [link for link in good if link.a in only_join and link.b in only_join]):
        ends = {end for link in between if link.a in cluster or link.b in cluster for end in (link.a, link.b)}
        joined = {group_of[end] for end in ends if end in group_of}
        floors = dict.fromkeys(floor_of[station] for station in others if group_of[station] in joined)
        yield NetworkJoin(cluster, len(joined), tuple(floors))


def _neighbours(stations: Iterable[str], links: Iterable[Link]) -> _Neighbours:
    neighbours: _Neighbours = {station: [] for station in stations}
    for link in links:
        neighbours[link.a].append(link.b)
        neighbours[link.b].append(link.a)
    return neighbours


def _cuts(stations: Sequence[str], neighbours: _Neighbours) -> tuple[set[frozenset[str]], set[str]]:
    """Bridges, as pairs, and articulation stations of one network."""
    root = stations[0]
    entered, low = {root: 0}, {root: 0}
    bridges: set[frozenset[str]] = set()
    articulations: set[str] = set()
    n_children = 0
    path = [(root, "", iter(neighbours[root]))]
    while path:
        station, parent, others = path[-1]
        other = next(others, None)
        if other is None:
            path.pop()
            if parent:
                low[parent] = min(low[parent], low[station])
                if low[station] > entered[parent]:
                    bridges.add(frozenset((parent, station)))
                if parent == root:
                    n_children += 1
                elif low[station] >= entered[parent]:
                    articulations.add(parent)
        elif other not in entered:
            entered[other] = low[other] = len(entered)
            path.append((other, station, iter(neighbours[other])))
        elif other != parent:
            low[station] = min(low[station], entered[other])
    if n_children > 1:
        articulations.add(root)
    return bridges, articulations


def _bottleneck(stations: Sequence[str], links: Sequence[Link], limits: LinkLimits) -> Link | None:
    """Last link of a spanning tree of greatest margins; see `weakest_link`."""
    group = {station: station for station in stations}

    def head(station: str) -> str:
        while group[station] != station:
            group[station] = station = group[group[station]]
        return station

    last = None
    for link in _firmest_first(links, limits):
        a, b = head(link.a), head(link.b)
        if a != b:
            group[a], last = b, link
    return last


def _strongest_first(link: Link) -> tuple[float, float, list[str]]:
    """Key by overlap, then strength, then ids: an order that no two links of a plan share, NaN or not."""
    return -link.overlap, 0.0 if math.isnan(link.strength) else -link.strength, sorted((link.a, link.b))


def _firmest_first(links: Iterable[Link], limits: LinkLimits) -> list[Link]:
    """By margin, then overlap, then strength, then ids."""
    return sorted(sorted(links, key=_strongest_first), key=lambda link: -link.margin(limits))


def weakest_link(links: Iterable[Link], limits: LinkLimits) -> Link | None:
    """Return the link that fails first: nearest to what a link needs; None of none."""
    return next(reversed(_firmest_first(links, limits)), None)


# ------------------------------------------------------------------------------------------------- the report
def _network(
    stations: tuple[str, ...], links: Sequence[Link], floor_of: Mapping[str, str], limits: LinkLimits
) -> RegistrationNetwork:
    bridges, articulations = _cuts(stations, _neighbours(stations, links))
    return RegistrationNetwork(
        stations=stations,
        floors=tuple(dict.fromkeys(floor_of[station] for station in stations)),
        n_links=len(links),
        bridges=tuple(link for link in links if frozenset((link.a, link.b)) in bridges),
        articulations=tuple(station for station in stations if station in articulations),
        bottleneck=_bottleneck(stations, links, limits),
    )


def _floor(floor: str, floor_of: Mapping[str, str], good: Sequence[Link]) -> FloorNetworks:
    stations = [station for station, of in floor_of.items() if of == floor]
    inside = [link for link in good if floor_of[link.a] == floor == floor_of[link.b]]
    return FloorNetworks(floor, tuple(_groups(stations, inside)))


def _gaps(links: Sequence[Link], network_of: Mapping[str, int], limits: LinkLimits) -> tuple[NetworkGap, ...]:
    best: dict[tuple[int, int], Link] = {}
    for link in _firmest_first(links, limits):
        low, high = sorted((network_of[link.a], network_of[link.b]))
        if low != high:
            best.setdefault((low, high), link)
    return tuple(NetworkGap(pair, best[pair]) for pair in sorted(best))


def _check(links: Sequence[Link], station_ids: Sequence[str], floors: Sequence[str]) -> None:
    if len(set(station_ids)) != len(station_ids) or len(floors) != len(station_ids):
        raise RequirementError(
            f"stations: got {len(station_ids)} ids, {len(set(station_ids))} of them different, and {len(floors)} "
            "floors, expected as many of each; pass every station once, with its floor"
        )
    known, pairs = set(station_ids), set()
    for link in links:
        pair = frozenset((link.a, link.b))
        if len(pair) < 2 or not pair <= known or pair in pairs:
            raise RequirementError(
                f"links: got {link.a!r} to {link.b!r}, expected each pair of the {len(known)} stations once; pass the "
                "links of these stations alone"
            )
        pairs.add(pair)


# ------------------------------------------------------------------------------------------------- words
def _best_gaps(registration: Registration) -> dict[int, NetworkGap | None]:
    """Of each network but the first its gap whose link comes nearest to counting, the first of equals; None where it
    has none.
    """
    best: dict[int, NetworkGap | None] = dict.fromkeys(range(1, len(registration.networks)))
    limits = registration.limits
    for gap in registration.gaps:
        for number in gap.networks:
            before = best.get(number)
            if number and (before is None or gap.best.margin(limits) > before.best.margin(limits)):
                best[number] = gap
    return best


def _together(
    registration: Registration, closed: Sequence[NetworkGap], floor_names: Mapping[str, str]
) -> Iterator[str]:
    """A line for each gap that is left once those of `closed` are, until all groups are one where links can."""
    group = list(range(len(registration.networks)))  # the least of those that are joined to it
    for gap in closed:
        group = _joined(group, gap)
    for gap in sorted(registration.gaps, key=lambda gap: -gap.best.margin(registration.limits)):
        one, other = (group[number] for number in gap.networks)
        if one != other:
            # The one that does not hold the largest group, which is the first.
            side = [number for number, of in enumerate(group) if of == max(one, other)]
            yield _apart(registration, side, gap, floor_names, joined=True)
            group = _joined(group, gap)
    for least in sorted({of for of in group if of > 0 and group.count(of) > 1}):
        networks = [registration.networks[number] for number, of in enumerate(group) if of == least]
        yield _alone(networks, floor_names, joined=True)


def _joined_by_gaps(registration: Registration) -> list[int]:
    """The group that each network is in once all gaps are closed."""
    return reduce(_joined, registration.gaps, list(range(len(registration.networks))))


def _joined(group: Sequence[int], gap: NetworkGap) -> list[int]:
    one, other = sorted(group[number] for number in gap.networks)
    return [one if of == other else of for of in group]


def _alone(networks: Sequence[RegistrationNetwork], floor_names: Mapping[str, str], *, joined: bool = False) -> str:
    """Say that no link leads to the others. joined : even where `networks` are one network."""
    places = [_placed(network, floor_names) for network in networks]
    single = len(networks) == 1 and len(networks[0].stations) == 1
    even = ", even once joined" if joined else ""
    return (
        f"{_listed(places, '; ')} {'does' if single else 'do'} not register with the others{even}: no link reaches "
        f"{100 * MIN_LISTED_OVERLAP:g} % overlap; look for shut doors in between, or register with targets or by "
        f"{HANDHELD} (to {HANDHELD_MM[0]} to {HANDHELD_MM[1]} mm)"
    )


def _apart(
    registration: Registration,
    numbers: Sequence[int],
    gap: NetworkGap,
    floor_names: Mapping[str, str],
    *,
    joined: bool = False,
) -> str:
    """Name the best link of a gap. joined : the gap is left even where those of `numbers` are one network."""
    networks = [registration.networks[number] for number in numbers]
    places = [_placed(network, floor_names) for network in networks]
    if joined:
        head = f"{_listed(places, '; ')} do not register with the others, even once joined"
    elif len(networks) > 1:
        head = f"{_listed(places, '; ')} register neither with one another nor with the others"
    else:
        head = f"{places[0]} {'does' if len(networks[0].stations) == 1 else 'do'} not register with the others"
    best, limits = gap.best, registration.limits
    named = f"{head}: the best link, {best.a} to {best.b}, overlaps {reached_percent(best.overlap, limits.overlap)} %"
    if best.overlap < limits.overlap:
        return (
            f"{named}, {100 * limits.overlap:g} % are required; open the doors or add a station "
            f"{_between(registration, gap)}, or {_targets(gap)}"
        )
    if best.strength < limits.strength:
        return (
            f"{named} but is too weak, strength {round(best.strength, 4):g} of {limits.strength:g}"
            f"{_held_least(best)}; move one to where both see a surface that stops this, or {_targets(gap)}"
        )
    if best.counts(replace(limits, doors_change=False)):
        one = len(best.only_open) == 1
        return (
            f"{named} and registers only while {'door' if one else 'doors'} {_listed(best.only_open)} "
            f"{'is' if one else 'are'} open; add a station in the doorway, or {_targets(gap)}"
        )
    return (
        f"{named} and registers with a probability of {probability_percent(best.probability, limits.probability)} %, "
        f"{100 * limits.probability:g} % are required{_held_least(best)}; open the doors or add a station "
        f"{_between(registration, gap)}, or {_targets(gap)}"
    )


def _moved(gap: NetworkGap, offset_m: FloatArray | tuple[float, float, float]) -> NetworkGap:
    dx, dy, dz = offset_m
    return replace(gap, targets_m=tuple((x + dx, y + dy, z + dz) for x, y, z in gap.targets_m))


def _targets(gap: NetworkGap) -> str:
    if not gap.targets_m:
        return "register with targets"
    places = [f"({x:.1f}, {y:.1f}, {z:.1f})" for x, y, z in gap.targets_m]
    return (
        f"register with targets that both see, such as at {', '.join(places[:-1])} and {places[-1]} in the model's "
        "coordinates"
    )


def _held_least(link: Link) -> str:
    motion = motion_words(link.weak_motion, of_north=", north being +y")
    return f": weakest direction: {motion}" if motion else ""


def _between(registration: Registration, gap: NetworkGap) -> str:
    one, other = (set(registration.networks[number].floors) for number in gap.networks)
    return "between them" if one & other else "on the stairs between their floors"


def _hangs(network: RegistrationNetwork) -> str:
    pairs = [f"{link.a} to {link.b}" for link in network.bridges]
    return (
        f"the network of {_named(network.stations)} is held together by single links, a redundant network is required: "
        f"{_listed(pairs)}; add a station that links both sides"
    )


def _placed(network: RegistrationNetwork, floor_names: Mapping[str, str]) -> str:
    floors = ", ".join(repr(floor_names.get(floor, floor)) for floor in network.floors)
    return f"{_named(network.stations)} on {'floor' if len(network.floors) == 1 else 'floors'} {floors}"


def _named(stations: Sequence[str]) -> str:
    return f"{'station' if len(stations) == 1 else 'stations'} {_listed(stations)}"


def _listed(names: Sequence[str], separator: str = ", ") -> str:
    more = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
    return separator.join(names[:_MOST_LISTED]) + more

"""Networks, bridges, articulations and bottlenecks against networkx; warnings by what they say."""

import re
from dataclasses import replace
from itertools import combinations, pairwise
from math import inf, isnan, nan

import networkx as nx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.errors import RequirementError
from planner_core.model import Link, LinkLimits, PreAlignment, WeakMotion
from planner_core.network import network_report
from planner_core.network.network_report import (
    HANDHELD,
    groups_first,
    registration_report,
    registration_warnings,
    weakest_link,
)

THRESHOLD, MIN_STRENGTH = 0.3, 0.01
LIMITS = LinkLimits(THRESHOLD, MIN_STRENGTH)

BY_HAND = f"by {HANDHELD} (to 18 to 51 mm)"


def report(links, ids, floors=None, **options):
    options = {"limits": LIMITS, **options}
    return registration_report(links, ids, floors or ["F1"] * len(ids), **options)


@st.composite
def surveys(draw):
    """Up to ten stations on two floors with links of a few overlaps, so that many are equal, and strengths."""
    n = draw(st.integers(0, 10))
    ids = [f"S{number:03d}" for number in range(n)]
    floors = draw(st.lists(st.sampled_from(["F1", "F2"]), min_size=n, max_size=n))
    pairs = list(combinations(ids, 2))
    wanted = draw(st.sets(st.sampled_from(pairs), max_size=18)) if pairs else set()
    overlap = st.sampled_from([0.05, 0.12, 0.29, 0.3, 0.31, 0.4, 0.5, 0.8])
    strength = st.sampled_from([0.0, 0.009, 0.01, 0.02, 0.3, nan])
    return [Link(a, b, draw(overlap), draw(strength)) for a, b in sorted(wanted)], ids, floors


def good(links):
    return [link for link in links if link.overlap >= THRESHOLD and not link.strength < MIN_STRENGTH]


def graph_of(ids, links, by="overlap"):
    graph = nx.Graph()
    graph.add_nodes_from(ids)
    graph.add_edges_from((link.a, link.b, {"weight": getattr(link, by)}) for link in links)
    return graph


def pairs_of(links):
    return {frozenset((link.a, link.b)) for link in links}


@given(survey=surveys())
@settings(max_examples=40, deadline=None)
def test_networks_and_what_they_hang_on_are_networkx_s(survey):
    links, ids, floors = survey
    found = report(links, ids, floors)
    graph = graph_of(ids, good(links))
    parts = {frozenset(part) for part in nx.connected_components(graph)}
    assert {frozenset(network.stations) for network in found.networks} == parts
    assert found.connected == (len(parts) <= 1)
    sizes = [len(network.stations) for network in found.networks]
    assert sizes == sorted(sizes, reverse=True)
    for network in found.networks:
        part = graph.subgraph(network.stations)
        assert list(network.stations) == [one for one in ids if one in part]
        assert network.n_links == part.number_of_edges()
        assert pairs_of(network.bridges) == {frozenset(edge) for edge in nx.bridges(part)}
        assert set(network.articulations) == set(nx.articulation_points(part))
        assert set(network.floors) == {floors[ids.index(one)] for one in network.stations}
        if len(part) > 2:
            assert network.two_connected == nx.is_biconnected(part)
        assert network.survives_a_link == (len(part) < 3 or not list(nx.bridges(part)))
    assert {one for network in found.networks for one in network.articulations} == set(found.articulations)
    assert pairs_of(found.bridges) == {frozenset(edge) for edge in nx.bridges(graph)}


@given(survey=surveys())
@settings(max_examples=40, deadline=None)
def test_bottleneck_is_the_least_margin_that_joins_the_network(survey):
    links, ids, floors = survey
    for network in report(links, ids, floors).networks:
        inside = [link for link in good(links) if link.a in network.stations]
        part = nx.Graph()
        part.add_nodes_from(network.stations)
        part.add_edges_from((link.a, link.b, {"weight": margin(link)}) for link in inside)
        if len(part) == 1:
            assert network.bottleneck is None
            continue
        tree = nx.maximum_spanning_tree(part)
        assert margin(network.bottleneck) == min(weight for _, _, weight in tree.edges.data("weight"))
        # Without any link that is as near to what is required, it falls apart.
        better = [link for link in good(links) if margin(link) > margin(network.bottleneck)]
        assert not nx.is_connected(graph_of(ids, better).subgraph(network.stations))


def margin(link):
    """Times that a link has what is required of it, by what decides; an unknown strength does not."""
    return min(link.overlap / THRESHOLD, inf if isnan(link.strength) else link.strength / MIN_STRENGTH)


@pytest.mark.parametrize(
    ("links", "weakest"),
    [
        ([Link("A", "B", 0.302, 0.134), Link("C", "D", 0.6, 0.075)], "A"),  # a set-up 10 cm off breaks it
        ([Link("A", "B", 0.36, 0.134), Link("C", "D", 0.6, 0.011)], "C"),
        ([Link("A", "B", 0.31, nan), Link("C", "D", 0.305, 0.4)], "C"),
        ([Link("A", "B", 0.6, 0.02), Link("C", "D", 0.6, 0.4)], "A"),  # both at twice the overlap
    ],
)
def test_the_weakest_link_is_the_nearest_to_what_is_required(links, weakest):
    assert weakest_link(links, LIMITS).a == weakest


@pytest.mark.parametrize(
    ("limits", "expected"),
    [((0, 0.01), 40.0), ((0.3, 0), 2.0), ((0, 0), inf), ((0, 0, 0.99), 4.0), ((0.3, 0.2, 0.99), 2.0)],
)
def test_what_is_not_required_decides_nothing(limits, expected):
    link = Link("A", "B", 0.6, 0.4, probability=0.9975)
    assert link.margin(LinkLimits(*limits)) == pytest.approx(expected)
    assert replace(link, strength=nan, probability=nan).margin(LinkLimits(0.3, 0.2, 0.99)) == 2.0


@pytest.mark.slow
@given(survey=surveys())
@settings(max_examples=40, deadline=None)
def test_floors_have_networks_of_their_own_and_links_that_join_them(survey):
    links, ids, floors = survey
    found = report(links, ids, floors)
    assert [floor.floor for floor in found.floors] == list(dict.fromkeys(floors))
    on = dict(zip(ids, floors, strict=True))
    for floor in found.floors:
        inside = graph_of(ids, good(links)).subgraph([one for one in ids if on[one] == floor.floor])
        assert {frozenset(group) for group in floor.networks} == set(map(frozenset, nx.connected_components(inside)))
    assert list(found.floor_joins) == [link for link in good(links) if on[link.a] != on[link.b]]


@given(survey=surveys())
@settings(max_examples=40, deadline=None)
def test_gaps_are_the_best_links_between_networks_that_do_not_count(survey):
    links, ids, floors = survey
    found = report(links, ids, floors)
    of = {one: number for number, network in enumerate(found.networks) for one in network.stations}
    best = {}
    for link in links:
        pair = tuple(sorted((of[link.a], of[link.b])))
        if pair[0] != pair[1]:
            best[pair] = max(margin(link), best.get(pair, 0.0))
    assert {gap.networks: margin(gap.best) for gap in found.gaps} == best
    for gap in found.gaps:
        assert {of[gap.best.a], of[gap.best.b]} == set(gap.networks)
        assert not found.counts(gap.best)


@pytest.mark.slow
@given(survey=surveys(), seed=st.randoms(use_true_random=False))
@settings(max_examples=40, deadline=None)
def test_order_of_stations_and_links_changes_no_finding(survey, seed):
    links, ids, floors = survey
    order = list(range(len(ids)))
    seed.shuffle(order)
    shuffled = [Link(x.b, x.a, x.overlap, x.strength) if seed.random() < 0.5 else x for x in links]
    seed.shuffle(shuffled)

    def findings(found):
        return {
            frozenset(network.stations): (
                pairs_of(network.bridges),
                frozenset(network.articulations),
                pairs_of([network.bottleneck] if network.bottleneck else []),
            )
            for network in found.networks
        }, {
            frozenset(found.networks[number].stations for number in gap.networks)
            and frozenset((gap.best.a, gap.best.b))
            for gap in found.gaps
        }

    other = report(shuffled, [ids[i] for i in order], [floors[i] for i in order])
    assert findings(other) == findings(report(links, ids, floors))


def test_ring_survives_the_failure_of_a_link_and_a_chain_does_not():
    ids = ["A", "B", "C", "D"]
    chain = [Link("A", "B", 0.5, 0.1), Link("B", "C", 0.35, 0.1), Link("C", "D", 0.6, 0.1)]
    one = report(chain, ids, loops=True)
    assert one.connected
    assert not one.met
    assert one.bridges == tuple(chain)
    assert one.articulations == ("B", "C")
    assert one.networks[0].bottleneck == chain[1]
    ring = report([*chain, Link("A", "D", 0.31, 0.1)], ids, loops=True)
    assert ring.met
    assert (ring.bridges, ring.articulations) == ((), ())
    # The closing link is the worst, but nobody has to rely on it.
    assert ring.networks[0].bottleneck == chain[1]
    pair = report([Link("A", "B", 0.5, 0.1)], ["A", "B"], loops=True)
    assert pair.met
    assert pair.bridges


@pytest.mark.slow
def test_long_chains_are_walked_without_recursion():
    ids = [f"S{number}" for number in range(3000)]
    links = [Link(a, b, 0.5, 0.1) for a, b in pairwise(ids)]
    assert len(report(links, ids).bridges) == 2999


# ------------------------------------------------------------------------------------------------ warnings
def test_network_that_is_one_gives_no_warning():
    ids = ["A", "B", "C"]
    links = [Link("A", "B", 0.5, 0.1), Link("B", "C", 0.3, 0.01)]
    assert registration_warnings(report(links, ids)) == ()
    assert registration_warnings(report([], ["A"])) == registration_warnings(report([], [])) == ()


def test_warnings_name_what_is_apart_why_and_what_to_do():
    ids = ["A", "B", "C", "D", "E", "F"]
    floors = ["F1", "F1", "F1", "F2", "F1", "F1"]
    links = [
        Link("A", "B", 0.5, 0.1),
        Link("A", "C", 0.2999, 0.2),
        Link("B", "D", 0.12, 0.2),
        Link("B", "E", 0.456, 0.0004, WeakMotion("shift", (1.0, 0.0, 0.0))),
    ]
    lines = registration_warnings(report(links, ids, floors), {"F2": "Level 2"})
    assert lines == (
        "station C on floor 'F1' does not register with the others: the best link, A to C, overlaps just below 30 %, "
        "30 % are required; open the doors or add a station between them, or register with targets",
        "station D on floor 'Level 2' does not register with the others: the best link, B to D, overlaps 12.0 %, 30 % "
        "are required; open the doors or add a station on the stairs between their floors, or register with targets",
        "station E on floor 'F1' does not register with the others: the best link, B to E, overlaps 45.6 % but is too "
        "weak, strength 0.0004 of 0.01: weakest direction: shift E–W, north being +y; move one to where both see a "
        "surface that stops this, or register with targets",
        "station F on floor 'F1' does not register with the others: no link reaches 5 % overlap; look for shut doors "
        f"in between, or register with targets or {BY_HAND}",
    )


def test_places_of_targets_are_named_in_the_scene():
    found = report([Link("A", "B", 0.12, 0.2)], ["A", "B"])
    targets_m = ((1.0, 2.0, 1.5), (4.04, 2.0, 1.5), (3.0, 5.0, 1.2))
    with_targets = replace(found, gaps=(replace(found.gaps[0], targets_m=targets_m),))
    (line,) = registration_warnings(with_targets, offset_m=(100.0, 200.0, 10.0))
    assert line.endswith(
        "or register with targets that both see, such as at (101.0, 202.0, 11.5), (104.0, 202.0, 11.5) and "
        "(103.0, 205.0, 11.2) in the model's coordinates"
    )


def test_two_networks_that_are_the_nearest_to_each_other_share_a_line():
    ids = ["A", "B", "C", "D", "E"]
    links = [Link("A", "B", 0.5, 0.1), Link("C", "D", 0.5, 0.1), Link("B", "C", 0.1, 0.1), Link("D", "E", 0.264, 0.1)]
    lines = registration_warnings(report(links, ids))
    assert lines == (
        "stations C, D on floor 'F1'; station E on floor 'F1' register neither with one another nor with the others: "
        "the best link, D to E, overlaps 26.4 %, 30 % are required; open the doors or add a station between them, or "
        "register with targets",
        "stations C, D on floor 'F1'; station E on floor 'F1' do not register with the others, even once joined: the "
        "best link, B to C, overlaps 10.0 %, 30 % are required; open the doors or add a station between them, or "
        "register with targets",
    )
    lines = registration_warnings(report([links[0], links[1], links[3]], ids))
    assert lines[1:] == (
        "stations C, D on floor 'F1'; station E on floor 'F1' do not register with the others, even once joined: no "
        f"link reaches 5 % overlap; look for shut doors in between, or register with targets or {BY_HAND}",
    )


@settings(max_examples=40, deadline=None)
@given(surveys())
def test_closing_the_gaps_of_all_lines_makes_one_network_where_links_can(survey):
    """By networkx: each line that names a best link is an edge between groups, those without one are apart for good."""
    links, ids, floors = survey
    found = report(links, ids, floors)
    lines = registration_warnings(found)
    named = re.findall(r"the best link, (\S+) to (\S+?),? (?:overlaps)", " ".join(lines))
    group_of = {station: number for number, each in enumerate(found.networks) for station in each.stations}
    closed, possible = nx.Graph(), nx.Graph()
    for graph in (closed, possible):
        graph.add_nodes_from(range(len(found.networks)))
    closed.add_edges_from((group_of[a], group_of[b]) for a, b in named)
    possible.add_edges_from(gap.networks for gap in found.gaps)
    if not any("more groups" in line for line in lines):
        assert sorted(map(sorted, nx.connected_components(closed))) == sorted(
            map(sorted, nx.connected_components(possible))
        )


@settings(max_examples=40, deadline=None)
@given(surveys())
def test_warnings_of_unconnected_groups_come_first(survey):
    """Whichever of their forms they have; the others keep their order, and no other line is taken for one."""
    links, ids, floors = survey
    lines = list(registration_warnings(report(links, ids, floors)))
    others = ["storey 'Roof' is left out: its slabs are in the open", "route: no path inside the model leads from A"]
    loops = [line for line in registration_warnings(report(links, ids, floors, loops=True)) if line not in lines]
    assert groups_first([*others, *loops, *lines]) == [*lines, *others, *loops]


def test_many_networks_apart_are_counted():
    ids = [f"S{number}" for number in range(20)]
    links = [Link("S0", "S1", 0.5, 0.1), *(Link("S0", one, 0.2, 0.1) for one in ids[2:])]
    lines = registration_warnings(report(links, ids))
    assert len(lines) == 7
    assert lines[-1].startswith("12 more groups, of 12 stations,")
    assert all("\n" not in line for line in lines)


def test_networks_that_see_nothing_of_others_share_a_line():
    ids = ["A", "B", "C", "D", "E"]
    (line,) = registration_warnings(report([Link("A", "B", 0.5, 0.1), Link("C", "D", 0.5, 0.1)], ids))
    assert line == (
        "stations C, D on floor 'F1'; station E on floor 'F1' do not register with the others: no link reaches 5 % "
        f"overlap; look for shut doors in between, or register with targets or {BY_HAND}"
    )
    joined = report([Link("A", "B", 0.5, 0.1), Link("C", "D", 0.5, 0.1)], ids)
    assert registration_warnings(joined, has_way_out=True)[1:] == (
        "--join outside plans stations outdoors, too, which join through exterior doors what no door indoors joins",
    )
    near = report([Link("A", "B", 0.5, 0.1), Link("B", "C", 0.1, 0.1)], ids[:3])
    assert not any("--join" in line for line in registration_warnings(near, has_way_out=True))  # targets join these
    (line,) = registration_warnings(report([], [f"S{number}" for number in range(20)]))
    assert "S6 on floor 'F1' and 13 more do not register" in line


def test_loops_that_are_asked_and_missing_are_named():
    ids = ["A", "B", "C"]
    links = [Link("A", "B", 0.5, 0.1), Link("B", "C", 0.5, 0.1)]
    (line,) = registration_warnings(report(links, ids, loops=True))
    assert "stations A, B, C is held together by single links" in line
    assert "A to B, B to C" in line
    assert registration_warnings(report([*links, Link("A", "C", 0.4, 0.1)], ids, loops=True)) == ()


@pytest.mark.parametrize(
    ("links", "ids", "floors", "word"),
    [
        ([Link("A", "X", 0.5, 0.1)], ["A", "B"], ["F1", "F1"], "'X'"),
        ([Link("A", "A", 0.5, 0.1)], ["A", "B"], ["F1", "F1"], "links"),
        ([Link("A", "B", 0.5, 0.1), Link("B", "A", 0.4, 0.1)], ["A", "B"], ["F1", "F1"], "links"),
        ([], ["A", "A"], ["F1", "F1"], "stations"),
        ([], ["A", "B"], ["F1"], "stations"),
    ],
)
def test_lists_that_do_not_fit_are_refused(links, ids, floors, word):
    with pytest.raises(RequirementError, match=word):
        report(links, ids, floors)


@settings(max_examples=40, deadline=None)
@given(surveys())
def test_the_best_gap_of_a_network_is_the_first_that_is_nearest_to_counting(survey):
    links, ids, floors = survey
    found = report(links, ids, floors)
    best = network_report._best_gaps(found)
    for number in range(1, len(found.networks)):
        gaps = [gap for gap in found.gaps if number in gap.networks]
        assert best[number] == max(gaps, key=lambda gap: margin(gap.best), default=None)
    assert sorted(best) == list(range(1, len(found.networks)))


def test_scans_that_nobody_places_have_a_line_where_they_are_apart():
    limits = LinkLimits(0.0, 0.01, 0.99)
    likely, risky = (Link("A", "B", 0.67, 0.2, probability=each) for each in (0.995, 0.218))
    apart = report([risky], ["A", "B"], limits=limits)
    named, placed = registration_warnings(apart, pre_alignment=PreAlignment.NONE)
    assert "A to B, overlaps 67.0 % and registers with a probability of 21.8 %, 99 % are required; open" in named
    assert placed.startswith("no pair of scans that are neither placed nor level registers surely; place them by hand")
    assert len(registration_warnings(apart, pre_alignment=PreAlignment.MANUAL)) == 1
    assert registration_warnings(report([likely], ["A", "B"], limits=limits), pre_alignment=PreAlignment.NONE) == ()


def test_stations_that_coverage_does_not_need_state_what_they_join():
    """A stair of two stations, S4 and S5, joins storeys; S6 makes one of them hold, and S7 joins nothing."""
    ids = [f"S{number}" for number in range(8)]
    floors = ["F0", "F0", "F1", "F1", "F0", "F1", "F1", "F1"]
    pairs = [("S0", "S1"), ("S2", "S3"), ("S1", "S4"), ("S4", "S5"), ("S5", "S2"), ("S6", "S2"), ("S6", "S3")]
    links = [*(Link(a, b, 0.5, 0.2) for a, b in pairs), Link("S3", "S7", 0.1, 0.2)]
    found = report(links, ids, floors, only_join={"S4", "S5", "S6", "S7"})
    assert [(join.stations, join.n_groups, join.floors) for join in found.joins] == [
        (("S4", "S5"), 2, ("F0", "F1")),
        (("S6",), 1, ("F1",)),
        (("S7",), 0, ()),
    ]
    assert report(links, ids, floors).joins == ()

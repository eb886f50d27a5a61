"""The walk, unreachable rooms and links on floor maps: what is drawn where, read back from the pixels."""

import dataclasses
from pathlib import Path

import numpy as np
import OpenImageIO as Oiio
import pytest

from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import Leg, Link, LinkLimits, Plan, Route, Site, UnreachableArea
from planner_core.plan_folder import palette
from planner_core.plan_folder.drawing.canvas import Pen
from planner_core.plan_folder.drawing.marks import LINKS, ROUTE, draw_links, link_class
from planner_core.plan_folder.drawing.png_canvas import PngCanvas
from planner_core.plan_folder.floor_marks import (
    Ground,
    OnPaper,
    breaks_on,
    draw_ways,
    ends_on,
    floor_links,
    stairs_on,
    targets_on,
    unreachable_hatch_m,
    unreachable_on,
    ways_on,
)
from planner_core.plan_folder.maps import view_floor, write_floor_map, write_link_map
from planner_core.plan_folder.plan_source import source_of

MM_PER_M = 20.0
SIZE_M = (16.0, 5.0)
STRIPS_M = np.array([[[1.0, 2.5], [2.0, 3.0]], [[1.0, 3.0], [2.0, 3.5]]])


def leg(a: int, b: int, corners: list[tuple[float, float, float]], floor: list[int]) -> Leg:
    points_m = np.array(corners).reshape(-1, 3)
    length_m = float(np.linalg.norm(np.diff(points_m, axis=0), axis=1).sum()) if corners else float("inf")
    return Leg(a, b, points_m, np.array(floor, dtype=np.int32), length_m)


@pytest.fixture
def walked(plan: Plan) -> Plan:
    """From (0.5, 2) through the doorway to S002, up to the other floor to S003, and from there no way back."""
    legs = (
        leg(-1, 0, [(0.5, 2, 0), (2, 2, 0)], [0]),
        leg(0, 1, [(2, 2, 0), (4, 2, 0), (6, 2.2, 0)], [0, 0]),
        leg(1, 2, [(6, 2.2, 0), (6, 3, 0), (6, 3, 2.8), (3, 1.5, 2.8)], [0, 0, 1]),
        leg(2, 0, [], []),
    )
    route = Route(np.arange(3), legs, sum(part.length_m for part in legs[:3]), 1, True, True, legs[0].points_m[0])
    unreachable = UnreachableArea(1, 1.0, np.array([1.5, 3.0, 2.8]), STRIPS_M)
    return dataclasses.replace(plan, route=route, unreachable=(unreachable,))


class Paper:
    """A picture of 2 cm a metre, and what is drawn on it."""

    def __init__(self) -> None:
        self.canvas = PngCanvas(MM_PER_M * SIZE_M[0], MM_PER_M * SIZE_M[1])
        self.pixels: np.ndarray | None = None  # drawn when first looked at

    def near(self, x_m: float, y_m: float, colour: tuple[float, float, float], *, within_m: float = 0.04) -> bool:
        if self.pixels is None:
            self.pixels = self.canvas.drawn()[:, :, :3] / 255
        pixels = self.pixels
        pixels_per_m = pixels.shape[1] / SIZE_M[0]
        row, column = int((SIZE_M[1] - y_m) * pixels_per_m), int(x_m * pixels_per_m)
        reach = max(1, int(within_m * pixels_per_m))
        some = pixels[max(row - reach, 0) : row + reach + 1, max(column - reach, 0) : column + reach + 1]
        return bool((np.abs(some - np.array(colour)).max(axis=2) < 0.03).any())


def ground_of(plan: Plan) -> Ground:
    floors, scene = plan.survey.floors, plan.survey.scene
    return lambda number: (
        scene.vertices_m[scene.triangles[floors[number].ground_triangles]][:, :, :2] + scene.offset_m[:2]
    )


def on_paper(plan: Plan) -> OnPaper:
    return lambda points_m: MM_PER_M * (points_m - plan.survey.scene.offset_m[:2])


def test_ways_are_the_stretches_of_the_walk_on_each_floor(walked: Plan) -> None:
    source = source_of(walked)
    below, above = (ways_on(source, floor, ground_of(walked)) for floor in source.floors)
    assert [(way.arrives, way.leaves) for way in below] == [("", ""), ("", ""), ("", "to 3, Obergeschoß")]
    assert [(way.arrives, way.leaves) for way in above] == [("from 2, Erdgeschoss", "")]
    assert walked.route is not None
    assert sum(way.length_m for way in (*below, *above)) == pytest.approx(walked.route.length_m)
    assert ways_on(source_of(dataclasses.replace(walked, route=None)), source.floors[0]) == []


def test_walk_is_drawn_along_its_legs_on_its_own_floor_only(walked: Plan) -> None:
    source = source_of(walked)
    below, above = Paper(), Paper()
    for floor, paper in zip(source.floors, (below, above), strict=True):
        ways = ways_on(source, floor, ground_of(walked))
        draw_ways(paper.canvas, ways, on_paper(walked), floor.elevation_m + 1.2)
    for x_m, y_m in ((1.0, 2.0), (3.5, 2.0), (5.0, 2.1), (6.0, 2.7)):
        assert below.near(x_m, y_m, ROUTE.colour), (x_m, y_m)
        assert not above.near(x_m, y_m, ROUTE.colour), (x_m, y_m)
    assert above.near(4.5, 2.25, ROUTE.colour)
    assert not below.near(4.5, 2.4, ROUTE.colour)


def test_texts_name_stairs_breaks_start_and_further_entrances(walked: Plan) -> None:
    offset_m = walked.survey.scene.offset_m
    doors = tuple(tuple(float(v) for v in np.array(at) + offset_m) for at in ((0.6, 2.0, 0.0), (7.5, 2.0, 0.0)))
    walked = dataclasses.replace(walked, settings=dataclasses.replace(walked.settings, site=Site(entrances_m=doors)))
    source, texts = source_of(walked), []
    for floor in source.floors:
        marks = (
            stairs_on(ways_on(source, floor)), breaks_on(source, floor), ends_on(source, floor),
            unreachable_on(source, floor),
        )  # fmt: skip
        texts.append(sorted(mark.words for each in marks for mark in each))
    assert texts[0] == ["entrance", "from 3, no path inside", "start and end", "to 3, Obergeschoß"]
    assert texts[1] == ["from 2, Erdgeschoss", "not reachable, 1 m²", "then 1, no path inside"]


def test_sealed_rooms_are_hatched_and_nothing_else_is(walked: Plan) -> None:
    paper, source = Paper(), source_of(walked)
    lines = [on_paper(walked)(line) for line in unreachable_hatch_m(source, source.floors[1], 0.1)]
    paper.canvas.lines(lines, Pen(0.3, palette.INK))
    for x_m, y_m in ((1.2, 2.6), (1.8, 2.6), (1.2, 3.4), (1.8, 3.4)):
        assert paper.near(x_m, y_m, palette.INK, within_m=0.12), (x_m, y_m)
    for x_m, y_m in ((0.8, 2.7), (2.25, 3.35), (1.5, 2.3), (1.5, 3.75)):
        assert not paper.near(x_m, y_m, palette.INK, within_m=0.12), (x_m, y_m)


def test_targets_are_marked_on_their_floor_for_the_gaps_that_make_one_network(plan: Plan) -> None:
    source = source_of(plan)
    first, second, third = (station.id for station in plan.stations[:3])
    low_m, high_m = (floor.elevation_m for floor in source.floors[:2])

    def gap(networks: list[int], a: str, b: str, overlap: float, *places: list[float]) -> dict[str, object]:
        return {
            "networks": networks,
            "best": {"a": a, "b": b, "overlap": overlap, "strength": None},
            "targets": list(places),
        }

    gaps = [
        gap([0, 1], first, second, 0.1, [9.0, 9.0, low_m + 1.0]),  # what the two others join needs no third
        gap([0, 2], first, third, 0.28, [1.0, 2.0, low_m + 0.6], [4.0, 2.0, high_m + 1.5]),
        gap([1, 2], second, third, 0.2, [2.0, 3.0, low_m + 2.25]),
    ]
    registration = {**source.document["registration"], "networks": [{}, {}, {}], "gaps": gaps}
    apart = dataclasses.replace(source, document={**source.document, "registration": registration})
    ground, upper = ([(*mark.at_m, mark.words) for mark in targets_on(apart, floor)] for floor in source.floors[:2])
    assert ground == [(1.0, 2.0, "target 1/3, 0.6 m up"), (2.0, 3.0, "target 2/3, 2.2 m up")]
    assert upper == [(4.0, 2.0, "target 1/3, 1.5 m up")]
    assert targets_on(source, source.floors[0]) == []
    link = Link("S001", "S002", 0.02, 0.0, targets_m=tuple((x, 2.0, low_m + x / 5) for x in (5.0, 3.0, 4.0)))
    linked = [mark.words for mark in targets_on(dataclasses.replace(source, links=(link,)), source.floors[0])]
    assert linked == ["target 1/2, 1.0 m up", "target 1/2, 0.6 m up", "target 1/2, 0.8 m up"]


def test_links_are_classed_by_what_was_asked_for(plan: Plan) -> None:
    asked = LinkLimits(0.3, 0.01, 0.99)
    firm = asked.strength
    cases = [
        (Link("a", "b", asked.overlap, 40 * firm), 2),
        (Link("a", "b", asked.overlap, firm), 1),
        (Link("a", "b", asked.overlap, float("nan")), 1),
        (Link("a", "b", asked.overlap, 0.5 * firm), 0),
        (Link("a", "b", 0.9 * asked.overlap, 40 * firm), 0),
        (Link("a", "b", 0.1 * asked.overlap, 40 * firm), None),
        (Link("a", "b", 0.1 * asked.overlap, firm, as_set_up=True), 1),
        (Link("a", "b", asked.overlap, firm, probability=0.99), 1),
        (Link("a", "b", asked.overlap, firm, probability=0.98), 0),
        (Link("a", "b", asked.overlap, firm, probability=0.1), None),
        (Link("a", "b", 0.01, 0.0, probability=0.1, targets_m=((0.0, 0.0, 0.0),) * 3), 3),
    ]
    assert [link_class(link, asked) for link, _ in cases] == [kind for _, kind in cases]


def test_links_are_drawn_between_stations_of_a_floor_and_others_are_named(plan: Plan) -> None:
    links = (Link("S001", "S002", 0.9, 0.5), Link("S002", "S003", 0.4, 0.5))
    source = source_of(dataclasses.replace(plan, links=links))
    ends, elsewhere = floor_links(source, source.floors[0])
    assert [len(of_class) for of_class in ends] == [0, 0, 1, 0], "S003 is on another floor"
    assert elsewhere == {"S002": (3,)}
    paper, bare = Paper(), Paper()
    draw_links(paper.canvas, [on_paper(plan)(of_class) for of_class in ends])
    draw_links(bare.canvas, [np.zeros((0, 2, 2))] * 4)
    assert paper.near(4.0, 2.1, LINKS[2].colour, within_m=0.1)
    assert not bare.near(4.0, 2.1, LINKS[2].colour, within_m=0.1)


@pytest.mark.slow
def test_maps_show_the_walk_on_one_and_links_on_the_other(walked: Plan, engine: ScanEngine, tmp_path: Path) -> None:
    view = view_floor(walked, 0, engine=engine)
    share = {}
    for write, name in ((write_floor_map, "walk.png"), (write_link_map, "links.png")):
        write(walked, 0, tmp_path / name, view=view, source=source_of(walked))
        pixels = Oiio.ImageBuf(str(tmp_path / name)).get_pixels(Oiio.FLOAT)[:, :, :3]
        assert pixels.shape[1] == 1600
        assert 300 < pixels.shape[0] < 2000
        for colour in (ROUTE.colour, LINKS[2].colour, palette.SEEN_ONCE):
            share[name, colour] = int((np.abs(pixels - np.array(colour)).max(axis=2) < 0.03).sum())
    assert share["walk.png", ROUTE.colour] > 300 < share["links.png", LINKS[2].colour]
    assert share["walk.png", LINKS[2].colour] == share["links.png", ROUTE.colour] == 0
    assert share["walk.png", palette.SEEN_ONCE] > 1000 > share["links.png", palette.SEEN_ONCE]

"""The walk, sealed rooms and links on floor maps: what is drawn where, read back from the pixels."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as Oiio
import pytest

from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import Leg, Link, Plan, Route, SealedArea, Site
from planner_core.plan_folder import palette
from planner_core.plan_folder.link_drawing import LINK_CLASSES, draw_links, link_class
from planner_core.plan_folder.maps import view_floor, write_floor_map, write_link_map
from planner_core.plan_folder.sheet import axes_on_sheet, new_sheet
from planner_core.plan_folder.walk_drawing import draw_ends, draw_sealed, draw_walk, runs_on

PIXELS_PER_M = 100
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
    sealed = SealedArea(1, 1.0, np.array([1.5, 3.0, 2.8]), STRIPS_M)
    return dataclasses.replace(plan, route=route, sealed=(sealed,))


class Paper:
    """Axes of 1 cm a pixel, and what is drawn on them."""

    def __init__(self) -> None:
        self.figure: Any = new_sheet(SIZE_M[1])
        self.axes: Any = axes_on_sheet(self.figure, 0.0, 0.0, *SIZE_M)
        self.axes.set_xlim(0, SIZE_M[0])
        self.axes.set_ylim(0, SIZE_M[1])
        self.pixels: np.ndarray | None = None  # drawn when first looked at

    def near(self, x_m: float, y_m: float, colour: tuple[float, float, float], *, within_m: float = 0.04) -> bool:
        if self.pixels is None:
            self.figure.canvas.draw()
            self.pixels = np.asarray(self.figure.canvas.buffer_rgba())[:, :, :3].astype(float) / 255
        pixels = self.pixels
        row, column = int((SIZE_M[1] - y_m) * PIXELS_PER_M), int(x_m * PIXELS_PER_M)
        reach = max(1, int(within_m * PIXELS_PER_M))
        some = pixels[max(row - reach, 0) : row + reach + 1, max(column - reach, 0) : column + reach + 1]
        return bool((np.abs(some - np.array(colour)).max(axis=2) < 0.03).any())


def test_runs_are_the_stretches_of_the_walk_on_each_floor(walked: Plan) -> None:
    below, above = runs_on(walked, 0), runs_on(walked, 1)
    assert [(run.before, run.after) for run in below] == [(None, None), (None, None), (None, 1)]
    assert [(run.before, run.after, run.leg_ends) for run in above] == [(0, None, (1, 2))]
    assert walked.route is not None
    assert sum(run.length_m for run in (*below, *above)) == pytest.approx(walked.route.length_m)
    assert runs_on(dataclasses.replace(walked, route=None), 0) == []


def test_walk_is_drawn_along_its_legs_on_its_own_floor_only(walked: Plan) -> None:
    below, above = Paper(), Paper()
    draw_walk(below.axes, walked, 0, pixel_m=0.01)
    draw_walk(above.axes, walked, 1, pixel_m=0.01)
    for x_m, y_m in ((1.0, 2.0), (3.5, 2.0), (5.0, 2.1), (6.0, 2.7)):
        assert below.near(x_m, y_m, palette.ROUTE), (x_m, y_m)
        assert not above.near(x_m, y_m, palette.ROUTE), (x_m, y_m)
    assert above.near(4.5, 2.25, palette.ROUTE)
    assert not below.near(4.5, 2.4, palette.ROUTE)


def test_texts_name_stairs_breaks_start_and_further_entrances(walked: Plan) -> None:
    offset_m = walked.survey.scene.offset_m
    doors = tuple(tuple(float(v) for v in np.array(at) + offset_m) for at in ((0.6, 2.0, 0.0), (7.5, 2.0, 0.0)))
    walked = dataclasses.replace(walked, settings=dataclasses.replace(walked.settings, site=Site(entrances_m=doors)))
    texts = []
    for index, floor in enumerate(walked.survey.floors):
        paper = Paper()
        draw_walk(paper.axes, walked, index, pixel_m=0.01)
        draw_ends(paper.axes, walked, floor)
        draw_sealed(paper.axes, walked, index)
        texts.append(sorted(text.get_text() for text in paper.axes.texts))
    assert texts[0] == ["entrance", "from 3, no way inside", "start and end", "to 3, Obergeschoß"]
    assert texts[1] == ["from 2, Erdgeschoss", "no way in, 1 m²", "then 1, no way inside"]


def test_sealed_rooms_are_hatched_and_nothing_else_is(walked: Plan) -> None:
    paper = Paper()
    draw_sealed(paper.axes, walked, 1)
    for x_m, y_m in ((1.2, 2.6), (1.8, 2.6), (1.2, 3.4), (1.8, 3.4)):
        assert paper.near(x_m, y_m, palette.INK, within_m=0.12), (x_m, y_m)
    for x_m, y_m in ((0.8, 2.7), (2.25, 3.35), (1.5, 2.3), (1.5, 3.75)):
        assert not paper.near(x_m, y_m, palette.INK, within_m=0.12), (x_m, y_m)


def test_links_are_classed_by_what_was_asked_for(plan: Plan) -> None:
    asked = plan.settings.requirements
    firm = asked.min_strength
    cases = [
        (Link("a", "b", asked.overlap, 40 * firm), 2),
        (Link("a", "b", asked.overlap, firm), 1),
        (Link("a", "b", asked.overlap, float("nan")), 1),
        (Link("a", "b", asked.overlap, 0.5 * firm), 0),
        (Link("a", "b", 0.9 * asked.overlap, 40 * firm), 0),
        (Link("a", "b", 0.1 * asked.overlap, 40 * firm), None),
    ]
    assert [link_class(link, plan) for link, _ in cases] == [kind for _, kind in cases]


def test_links_are_drawn_between_stations_of_a_floor_and_others_are_named(plan: Plan) -> None:
    links = (Link("S001", "S002", 0.9, 0.5), Link("S002", "S003", 0.4, 0.5))
    paper, bare = Paper(), Paper()
    draw_links(paper.axes, dataclasses.replace(plan, links=links), "F0")
    draw_links(bare.axes, dataclasses.replace(plan, links=()), "F0")
    assert paper.near(4.0, 2.1, LINK_CLASSES[2][1])
    assert not bare.near(4.0, 2.1, LINK_CLASSES[2][1])
    assert not paper.near(4.5, 1.85, LINK_CLASSES[2][1]), "S003 is on another floor"
    assert [text.get_text() for text in paper.axes.texts] == ["↕ 3"]


def test_maps_show_the_walk_on_one_and_links_on_the_other(walked: Plan, engine: ScanEngine, tmp_path: Path) -> None:
    view = view_floor(walked, 0, engine=engine)
    share = {}
    for write, name in ((write_floor_map, "walk.png"), (write_link_map, "links.png")):
        write(walked, 0, tmp_path / name, view=view)
        pixels = Oiio.ImageBuf(str(tmp_path / name)).get_pixels(Oiio.FLOAT)[:, :, :3]
        for colour in (palette.ROUTE, palette.LINK, palette.SEEN_ONCE):
            share[name, colour] = int((np.abs(pixels - np.array(colour)).max(axis=2) < 0.03).sum())
    assert share["walk.png", palette.ROUTE] > 300 < share["links.png", palette.LINK]
    assert share["walk.png", palette.LINK] == share["links.png", palette.ROUTE] == 0
    assert share["walk.png", palette.SEEN_ONCE] > 1000 > share["links.png", palette.SEEN_ONCE]

"""Doors, windows and passages in the walls of two rooms."""

import numpy as np
import pytest
import shapely

from planner_core.drawings.arcs import SwingArc
from planner_core.drawings.openings import OpeningKind, SymbolLines, is_in_opening, openings_of
from tests.drawings.drawn_buildings import ENTRANCE, INNER_DOOR, ROOM_WALLS, WINDOW

DOOR, PANE, PASSAGE = OpeningKind.DOOR, OpeningKind.WINDOW, OpeningKind.PASSAGE


def lines(*strokes):
    return shapely.multilinestrings([shapely.linestrings(stroke) for stroke in strokes])


PANES = SymbolLines(PANE, lines([(4, 4.2), (5.5, 4.2)], [(4, 4.4), (5.5, 4.4)]), "W1")
HINGE, TIP, SHUT = np.array([3.25, 1.0]), np.array([4.15, 1.0]), np.array([3.25, 1.9])
LEAF = SymbolLines(DOOR, lines([HINGE, TIP]), "D1", (SwingArc(HINGE, TIP, SHUT, 0.9),))


def kinds_at(openings, areas):
    """Kind of the opening that covers each area exactly; None: there is none."""
    return [
        next((o.kind for o in openings if shapely.symmetric_difference(o.area, area).area < 0.01), None)
        for area in areas
    ]


def test_gaps_are_what_is_drawn_in_them():
    openings, walls = openings_of(ROOM_WALLS, [PANES, LEAF])
    assert kinds_at(openings, [INNER_DOOR, ENTRANCE, WINDOW]) == [DOOR, PASSAGE, PANE]
    assert [o.is_doubtful for o in openings] == [o.kind == PASSAGE for o in openings]
    assert len(openings) == 3
    assert walls.equals(ROOM_WALLS)


def test_symbols_over_a_wall_are_cut_out_of_it():
    whole = shapely.union_all([ROOM_WALLS, WINDOW, INNER_DOOR])
    openings, walls = openings_of(whole, [PANES, LEAF])
    assert kinds_at(openings, [INNER_DOOR, WINDOW]) == [DOOR, PANE]
    assert shapely.symmetric_difference(walls, ROOM_WALLS).area < 0.01


def test_symbol_away_from_walls_opens_nothing():
    alone = SymbolLines(PANE, lines([(1, 2), (2, 2)], [(1, 2.1), (2, 2.1)]))
    openings, walls = openings_of(ROOM_WALLS, [alone])
    assert {o.kind for o in openings} == {PASSAGE}
    assert not is_in_opening(alone, openings)
    assert walls.equals(ROOM_WALLS)


def test_leaf_at_one_end_of_a_wide_opening_does_not_fill_it():
    walls = shapely.union_all([shapely.box(0, 0, 2, 0.2), shapely.box(7, 0, 9, 0.2)])
    leaf = SymbolLines(DOOR, lines([(2, 0.1), (2.9, 0.1)]))
    assert openings_of(walls, [leaf])[0] == []


@pytest.mark.parametrize("degrees", [0.0, 33.0])
def test_corners_run_along_the_wall(degrees):
    place = [np.cos(np.deg2rad(degrees)), -np.sin(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees)),
             np.cos(np.deg2rad(degrees)), 40.0, 9.0]  # fmt: skip
    walls = shapely.affinity.affine_transform(ROOM_WALLS, place)
    openings, _ = openings_of(walls, [])
    assert sorted((round(o.width_m, 3), round(o.thickness_m, 3)) for o in openings) == [
        (0.9, 0.1), (1.0, 0.2), (1.5, 0.2),
    ]  # fmt: skip

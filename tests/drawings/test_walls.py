"""Areas of walls, beside areas known by hand."""

import numpy as np
import pytest
import shapely

from planner_core.drawings.walls import fills_area, outlined_area, straight_pieces
from tests.drawings.drawn_buildings import ROOM_WALLS


def rings(area):
    return [
        shapely.get_coordinates(ring) for part in shapely.get_parts(area) for ring in (part.exterior, *part.interiors)
    ]


def turned(area, degrees=17.0):
    return shapely.affinity.translate(shapely.affinity.rotate(area, degrees, origin=(0, 0)), 512.0, -77.0)


def same_area(a, b):
    return shapely.symmetric_difference(a, b).area


@pytest.mark.parametrize("place", [lambda area: area, turned], ids=["straight", "turned"])
def test_thin_faces_between_outlines_are_walls(place):
    walls = place(ROOM_WALLS)
    assert same_area(outlined_area(rings(walls)), walls) < 0.002


def test_pairs_of_lines_with_open_ends_are_closed():
    pair = [np.array([(0, 0), (4, 0)]), np.array([(0, 0.2), (4, 0.2)])]
    assert same_area(outlined_area(pair), shapely.box(0, 0, 4, 0.2)) < 1e-6


def test_lines_that_just_miss_each_other_meet():
    corner = [np.array([(0, 0), (4, 0), (4, 3)]), np.array([(0, 0.2), (3.79, 0.2)]), np.array([(3.8, 0.21), (3.8, 3)])]
    wall = shapely.box(0, 0, 4, 0.2) | shapely.box(3.8, 0, 4, 3)
    assert same_area(outlined_area(corner), wall) < 0.002


def test_lines_farther_apart_than_walls_are_thick_are_no_wall():
    pair = [np.array([(0, 0), (4, 0)]), np.array([(0, 0.7), (4, 0.7)])]
    assert outlined_area(pair).is_empty
    assert outlined_area([]).is_empty


def test_curved_wall_is_followed():
    angle = np.linspace(0, np.pi / 2, 40)
    arc = np.column_stack([np.cos(angle), np.sin(angle)])
    area = outlined_area([3.0 * arc, 3.3 * arc])
    assert area.area == pytest.approx(np.pi / 4 * (3.3**2 - 3.0**2), rel=0.01)


def test_stubs_beside_doors_of_thin_walls_belong_to_a_wall():
    walls = shapely.union(shapely.box(0, 0, 2, 0.05), shapely.box(1, 0.05, 1.05, 0.1))
    (piece,) = straight_pieces(turned(walls))
    assert shapely.symmetric_difference(piece.area, turned(walls)).area == pytest.approx(0.0, abs=0.0005)


def test_filled_ring_that_runs_back_on_itself_has_no_area_there():
    square = np.array([[0, 0], [2, 0], [2, 2], [0, 2], [0, 0], [-3, 0], [0, 0]], dtype=float)
    assert fills_area([[square]]).area == pytest.approx(4.0)


def test_filled_rings_count_by_the_even_odd_rule():
    outer, inner = rings(shapely.box(0, 0, 5, 5)), rings(shapely.box(0.3, 0.3, 4.7, 4.7))
    assert fills_area([[*outer, *inner]]).area == pytest.approx(25 - 4.4**2)


@pytest.mark.parametrize("place", [lambda area: area, turned], ids=["straight", "turned"])
def test_straight_pieces_divide_the_walls(place):
    walls = place(ROOM_WALLS)
    pieces = straight_pieces(walls)
    assert sum(piece.area.area for piece in pieces) == pytest.approx(walls.area, abs=0.003)
    assert same_area(shapely.union_all([piece.area for piece in pieces]), walls) < 0.003
    assert sorted({round(piece.thickness_m, 2) for piece in pieces}) == [0.1, 0.2]
    assert len(pieces) <= 9  # four sides, three of them cut once or twice, and a partition cut once

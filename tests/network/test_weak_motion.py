"""Words of links against angles in plan; the same table of words as the viewer's test has.

Weak axes of shapes whose free motions are known, and of what stations really see in a tunnel.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from stages import visible_from

from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.model import PlanSettings, Visibility, WeakMotion
from planner_core.network.links import SharedSurface, overlap_links, surface_of_patches
from planner_core.network.pair_overlap import PairSums, matrices_of, strengths_of
from planner_core.network.weak_motion import motion_words, weak_motion
from planner_core.scanner.load_scanner import load_scanner
from scenes_synthetic import hard, rooms

BEARING_DEG = {"N–S": 0.0, "NE–SW": 45.0, "E–W": 90.0, "NW–SE": 135.0}
X, Y, VERTICAL = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def level(angle_deg: float) -> tuple[float, float, float]:
    return math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg)), 0.0


@pytest.mark.parametrize(
    ("motion", "words"),
    [
        (WeakMotion("shift", X), "shift E–W"),
        (WeakMotion("shift", Y), "shift N–S"),
        (WeakMotion("shift", level(30)), "shift NE–SW"),
        (WeakMotion("shift", level(20)), "shift E–W"),
        (WeakMotion("shift", level(150)), "shift NW–SE"),
        (WeakMotion("shift", VERTICAL), "shift up–down"),
        (WeakMotion("shift", (0.77, 0.00, -0.64)), "shift on a slope"),
        (WeakMotion("turn", VERTICAL), "turn (heading)"),
        (WeakMotion("turn", X), "tilt about E–W"),
        (WeakMotion("turn", Y), "tilt about N–S"),
        (WeakMotion("turn", level(134)), "tilt about NW–SE"),
        (WeakMotion("turn", level(179)), "tilt about E–W"),
        (WeakMotion("turn", (0.00, 0.77, 0.64)), "turn about a slope"),
        (WeakMotion("turn", (0.10, 0.10, 0.99)), "turn (heading)"),
        (WeakMotion("turn", (0.70, 0.70, 0.10)), "tilt about NE–SW"),
        (None, ""),
    ],
)
def test_weak_motion_is_told_as_in_the_viewer(motion: WeakMotion | None, words: str) -> None:
    assert motion_words(motion) == words
    by_compass = any(line in words for line in BEARING_DEG)
    assert motion_words(motion, of_north=", north being +y") == words + (", north being +y" if by_compass else "")


@given(st.integers(0, 179), st.floats(-720.0, 720.0))
def test_line_that_is_named_is_the_nearest_of_four_from_any_north(angle_deg: int, north_deg: float) -> None:
    told = motion_words(WeakMotion("turn", level(angle_deg)), north_rad=math.radians(north_deg))
    named_deg = BEARING_DEG[told.removeprefix("tilt about ")]
    off_deg = abs(math.remainder(named_deg + north_deg - (90 - angle_deg), 180.0))
    assert off_deg <= 22.5 + 1e-6


@pytest.mark.parametrize(
    ("motion", "words"),
    [
        (WeakMotion("shift", X), "shift along x"),
        (WeakMotion("turn", Y), "tilt about y"),
        (WeakMotion("turn", level(134)), "tilt about the line 44° from y to -x"),
        (WeakMotion("shift", level(30)), "shift along the line 60° from y to x"),
        (WeakMotion("turn", VERTICAL), "turn (heading)"),
    ],
)
def test_weak_motion_is_told_by_axes_where_no_north_is_known(motion: WeakMotion, words: str) -> None:
    assert motion_words(motion, north_rad=None, of_north=", north being +y") == words


def plane(axis, offset_m, spread_m=(2.0, 2.0), n=8):
    """Grid of points on a plane at right angles to an axis, and their normals."""
    u, v = np.meshgrid(np.linspace(-spread_m[0], spread_m[0], n), np.linspace(-spread_m[1], spread_m[1], n))
    points = np.zeros((n * n, 3))
    others = [other for other in range(3) if other != axis]
    points[:, others[0]], points[:, others[1]], points[:, axis] = u.ravel(), v.ravel(), offset_m
    return points, np.tile(np.eye(3)[axis], (n * n, 1))


def turned(shape, degrees, axis=2):
    angle = np.radians(degrees)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.eye(3)
    i, j = ((1, 2), (2, 0), (0, 1))[axis]
    turn[i, i] = turn[j, j] = c
    turn[i, j], turn[j, i] = -s, s
    return [(points @ turn.T, normals @ turn.T) for points, normals in shape]


def matrix_of(shape):
    points, normals = (np.concatenate(parts) for parts in zip(*shape, strict=True))
    patch = np.arange(points.shape[0], dtype=np.int32)
    visibility = Visibility(np.array([0, patch.size, 2 * patch.size]), np.tile(patch, 2), patch.size)
    pair = np.array([0], dtype=np.int32), np.array([1], dtype=np.int32)
    surface = SharedSurface(points, normals)
    return matrices_of(PairSums(visibility, np.full(patch.size, 0.04), surface, np.zeros((2, 3))).of(*pair))[0]


def corridor(long=0):
    walls = [plane(axis, side) for axis in range(3) if axis != long for side in (-1.0, 1.0)]
    return [(points * np.where(np.arange(3) == long, 4.0, 1.0), normals) for points, normals in walls]


def tower():
    """A round wall between floor and ceiling: nothing tells which way it is turned."""
    angle = np.linspace(0.0, 2 * np.pi, 60, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(60)], axis=1)
    wall = np.concatenate([ring * 2 + [0, 0, z] for z in np.linspace(-1, 1, 5)])
    disc = np.concatenate([ring * r for r in (0.5, 1.0, 1.5)])
    up = np.array([0.0, 0.0, 1.0])
    flat = np.tile(up, (len(disc), 1))
    return [(wall, np.tile(ring, (5, 1))), (disc - up, flat), (disc + up, flat)]


@pytest.mark.parametrize(
    ("shape", "words"),
    [
        (corridor(0), "slides along x"),
        (corridor(1), "slides along y"),
        (corridor(2), "slides along the vertical"),
        (turned(corridor(0), 30.0), "slides along 30 degrees from x to y"),
        (turned(corridor(0), 135.0), "slides along 135 degrees from x to y"),
        (turned(corridor(0), 176.0), "slides along x"),
        (turned(corridor(0), 40.0, axis=1), "slides along (0.77, 0.00, -0.64)"),
        (turned(corridor(0), 140.0, axis=1), "slides along (0.77, 0.00, 0.64)"),
        (turned(corridor(1), 40.0, axis=0), "slides along (0.00, 0.77, 0.64)"),
        (turned(corridor(1), 130.0, axis=0), "slides along (0.00, -0.64, 0.77)"),
        (tower(), "turns about the vertical"),
        (turned(tower(), 90.0, axis=1), "tilts about x"),
        (turned(tower(), 90.0, axis=0), "tilts about y"),
        (turned(turned(tower(), 90.0, axis=1), 50.0), "tilts about 50 degrees from x to y"),
        # A single wall leaves three motions free: the first slide is named.
        ([plane(0, 3.0)], "slides along y"),
        ([plane(2, 0.0)], "slides along x"),
        # Two walls and no floor.
        ([plane(0, 3.0), plane(1, 2.0)], "slides along the vertical"),
    ],
)
def test_weak_motion_is_the_free_motion(shape, words):
    matrix = matrix_of(shape)
    assert weak_motion(matrix).by_axes == words
    assert strengths_of(matrix[None])[0] == pytest.approx(0.0, abs=1e-9)


def test_weak_motion_of_motions_that_are_held_alike_does_not_hang_on_rounding():
    wall = turned([plane(0, 3.0)], 30.0)
    assert weak_motion(matrix_of(wall)).by_axes == "slides along the vertical"
    # The three turns of a cube are held alike, about whichever axes they are taken.
    cube = [plane(axis, side) for axis in range(3) for side in (-2.0, 2.0)]
    for degrees in (0.0, 13.0, 45.0, 77.0):
        assert weak_motion(matrix_of(turned(turned(cube, degrees), degrees, axis=0))).by_axes == "tilts about x"


def test_weak_motion_is_named_of_links_that_hold_as_well():
    # A little of an end wall: the corridor still slides most easily.
    closed = matrix_of([*corridor(0), plane(0, 4.0, spread_m=(0.3, 0.3), n=3)])
    assert weak_motion(closed).by_axes == "slides along x"
    # Nine patches of 265 face along it: three times that share, a little less for the turns they hold as well.
    assert strengths_of(closed[None])[0] == pytest.approx(3 * 9 / 265, rel=0.01)


def test_nothing_in_common_has_no_weak_motion():
    assert weak_motion(np.zeros((6, 6))) is None


def _links(synthetic, positions_m):
    scanner = replace(load_scanner("hdl-64e"), range_max_m=10.0)
    survey = make_survey(synthetic, settings := PlanSettings(scanner=scanner, max_patch_area_m2=0.1))
    engine = open_engine(synthetic, survey.patches)
    at_m = np.array(positions_m) - synthetic.offset_m
    visibility = visible_from(survey, settings, engine, at_m)
    seen = np.zeros(survey.patches.n_patches, dtype=bool)
    seen[visibility.patch] = True
    ids = tuple("ABCDEF"[: len(positions_m)])
    surface = surface_of_patches(synthetic, survey.patches, seen)
    return overlap_links(visibility, survey.patches.area_m2, ids, surface, at_m)


def test_scans_in_the_middle_of_a_tunnel_slide_along_it_and_those_at_its_end_are_held():
    synthetic = hard.tunnel()
    assert synthetic.truth.slides_along == (1.0, 0.0, 0.0)
    middle, end = _links(synthetic.scene, [(38.0, 0, 1.5), (42.0, 0, 1.5), (5.0, 0, 1.5), (7.0, 0, 1.5)])
    assert (middle.a, middle.b, middle.weak_motion) == ("A", "B", WeakMotion("shift", (1.0, 0.0, 0.0)))
    assert middle.overlap > 0.3
    assert middle.strength < 1e-9
    assert (end.a, end.b) == ("C", "D")
    assert end.overlap > 0.3
    assert end.strength > 0.05


def test_links_in_a_closed_room_hold():
    scene = rooms.box().scene
    floor_m = scene.vertices_m.min(axis=0) + scene.offset_m
    top_m = scene.vertices_m.max(axis=0) + scene.offset_m
    at = [floor_m + (top_m - floor_m) * (x, y, 0.5) for x, y in ((0.3, 0.3), (0.7, 0.6))]
    (link,) = _links(scene, at)
    assert link.overlap > 0.5
    assert link.strength > 0.01
    assert link.weak_motion is not None

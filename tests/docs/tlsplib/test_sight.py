"""Sight in whole numbers: the same as in fractions, one wall at a time, and as areas that are known."""

import math
from fractions import Fraction

import numpy as np
import pytest
from tlsplib.plans import PLANS, Plan, Survey, _rings, _stations, _surfaces, hall, instance_of, rooms
from tlsplib.sight import LIMIT_CM, Surfaces, seen_from


def in_fractions(station, surfaces, p, walls, *, least_cm, most_cm):
    """Whether a surface is seen: lines cut by Cramer's rule, the angle of incidence in floating-point numbers."""
    eye = [Fraction(int(v)) for v in station]
    at = [Fraction(int(v), 2) for v in surfaces.twice_cm[p]]
    away = [a - e for a, e in zip(at, eye, strict=True)]
    distance = math.sqrt(sum(v * v for v in away))
    number = int(surfaces.wall[p])
    if number < 0:
        normal = (0.0, 0.0, 1.0)
    else:
        x0, y0, x1, y1 = (int(v) for v in walls[number])
        length = math.hypot(x1 - x0, y1 - y0)
        side = int(surfaces.side[p])
        normal = (-(y1 - y0) / length * side, (x1 - x0) / length * side, 0.0)
    cosine = -sum(float(a) * n for a, n in zip(away, normal, strict=True)) / distance
    cosine = abs(cosine) if number < 0 else cosine
    if not least_cm <= distance <= most_cm or cosine <= 0 or cosine**2 * 15 < 1 - 1e-12:
        return False
    return not any(
        other != number and in_the_way(eye[:2], at[:2], [Fraction(int(v)) for v in wall])
        for other, wall in enumerate(walls)
    )


def in_the_way(a, b, wall):
    c, d = wall[:2], wall[2:]
    run, across = (b[0] - a[0], b[1] - a[1]), (d[0] - c[0], d[1] - c[1])
    to = (c[0] - a[0], c[1] - a[1])
    turn = run[0] * across[1] - run[1] * across[0]
    if turn:
        s, t = ((to[0] * v[1] - to[1] * v[0]) / turn for v in (across, run))
        return 0 <= s <= 1 and 0 <= t <= 1
    if to[0] * run[1] - to[1] * run[0]:
        return False
    square = run[0] ** 2 + run[1] ** 2
    ends = sorted(((p[0] - a[0]) * run[0] + (p[1] - a[1]) * run[1]) / square for p in (c, d))
    return ends[0] <= 1 and ends[1] >= 0


@pytest.mark.slow
@pytest.mark.parametrize(
    "plan",
    [
        rooms(5, width=1000, depth=800, largest_m2=25),
        hall(2, width=1200, depth=1000, n_pillars=3, n_shelves=3),
        Plan(((0, 0, 900, 100), (900, 100, 700, 800), (700, 800, 450, 300), (450, 300, 50, 700), (50, 700, 0, 0))),
    ],
    ids=["rooms", "hall", "oblique"],
)
def test_sight_is_that_of_fractions(plan):
    walls = np.array(plan.walls)
    survey = Survey(grid=200, most=600, patch=150)
    stations, surfaces = _stations(walls, survey), _surfaces(walls, survey)
    sees = seen_from(stations, surfaces, walls, least_cm=survey.least, most_cm=survey.most)
    assert 0.05 < sees.mean() < 0.6
    for i, station in enumerate(stations[::3]):
        for p in range(0, surfaces.ticks.size, 2):
            told = in_fractions(station, surfaces, p, plan.walls, least_cm=survey.least, most_cm=survey.most)
            assert told == sees[3 * i, p], (station, surfaces.twice_cm[p], surfaces.wall[p])


def test_a_sight_that_touches_the_end_of_a_wall_is_blocked():
    walls = np.array([[0, 0, 100, 0], [50, 50, 50, 80]])
    surfaces = Surfaces(np.array([[100, 0, 200], [96, 0, 200]]), np.array([1, 1]), np.zeros(2, int), np.ones(2, int))
    sees = seen_from(np.array([[50, 200, 100]]), surfaces, walls, least_cm=1, most_cm=500)
    assert sees.tolist() == [[False, True]]


def test_plans_too_large_for_63_bits_are_refused():
    walls = np.array([[0, 0, LIMIT_CM, 0]])
    none = Surfaces(np.zeros((0, 3), int), np.zeros(0, int), np.zeros(0, int), np.zeros(0, int))
    with pytest.raises(ValueError, match="smaller scale"):
        seen_from(np.zeros((1, 3), int), none, walls, least_cm=1, most_cm=500)


@pytest.mark.parametrize("name", PLANS)
def test_surfaces_have_the_area_of_the_plan(name):
    size = {
        "rooms": {"width": 1000, "depth": 800, "largest_m2": 25},
        "offices": {"length": 1200, "corridor": 200, "depth": 400},
        "hall": {"width": 1000, "depth": 1000, "n_pillars": 0, "n_shelves": 2},
    }[name]
    plan = PLANS[name](7, **size)
    walls, survey = np.array(plan.walls), Survey(grid=100, most=800, patch=100)
    surfaces = _surfaces(walls, survey)
    level = surfaces.wall < 0
    assert len(_rings(walls)) == 4
    assert int(surfaces.ticks[level].sum()) == 2 * 1000 * 1000 if name == "hall" else level.any()
    length = int(np.hypot(*(walls[:, 2:] - walls[:, :2]).T).sum())
    assert int(surfaces.ticks[~level].sum()) == 2 * length * survey.height


def test_two_rooms_behind_a_wall_do_not_see_each_other():
    plan = Plan(((0, 0, 800, 0), (800, 0, 800, 400), (800, 400, 0, 400), (0, 400, 0, 0), (400, 0, 400, 400)))
    instance = instance_of("two", "rooms", {}, plan, Survey(grid=200, most=1500))
    west = instance.candidates_cm[:, 0] < 400
    assert not (instance.sees[west].any(axis=0) & instance.sees[~west].any(axis=0)).any()

"""Ground outdoors against areas known from the drawing; doors shut for scope; two dwellings joined round the house."""

from __future__ import annotations

import re
from dataclasses import replace

import networkx as nx
import numpy as np
import pytest

from planner_core.coverage.survey import make_survey
from planner_core.engine.open3d import Open3DEngine
from planner_core.engine.open_engine import open_engine
from planner_core.errors import RequirementError
from planner_core.model import (
    Doors,
    Element,
    Plan,
    PlanSettings,
    PreAlignment,
    PriorStation,
    Proven,
    Requirements,
    Role,
    Scene,
    Scope,
    Site,
    Storey,
)
from planner_core.planning.plan import make_plan
from planner_core.requirements.scope import with_scope
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.doors import exterior_doors, without_door_leaves
from planner_core.scene.floors import find_floors
from planner_core.scene.outdoor_ground import OUTDOORS_M, STRIP_M, with_exterior_doors_shut, with_outdoor_ground
from planner_core.scene.patches import make_patches
from tests.coverage.conftest import BOX_FACES, box_corners

#: Two rooms of 4 x 4 x 2.6 m that no door joins, walls of 0.3 m, to the south a gate of 3.4 and a door of 1 x 2.1 m.
LOW, HIGH = (-0.3, -0.3), (8.6, 4.3)
DOORS_X = ((0.3, 3.7), (5.8, 6.8))
SLAB, ROOF = ((*LOW, -0.2), (*HIGH, 0.0)), ((*LOW, 2.6), (*HIGH, 2.8))
TERRAIN = ((-20.0, -20.0, -0.5), (28.0, 24.0, -0.1))
WALLS = [
    ((-0.3, -0.3, 0.0), (0.0, 4.3, 2.6)), ((4.0, -0.3, 0.0), (4.3, 4.3, 2.6)), ((8.3, -0.3, 0.0), (8.6, 4.3, 2.6)),
    ((0.0, 4.0, 0.0), (4.0, 4.3, 2.6)), ((4.3, 4.0, 0.0), (8.3, 4.3, 2.6)),
    *(((x0, -0.3, 0.0), (x1, 0.0, 2.6)) for x0, x1 in ((0.0, 0.3), (3.7, 4.0), (4.3, 5.8), (6.8, 8.3))),
    *(((x0, -0.3, 2.1), (x1, 0.0, 2.6)) for x0, x1 in DOORS_X),
]  # fmt: skip
#: Walls in the garden, by which scans outdoors are held.
GARDEN = [
    ((3.4, -5.5, 0.0), (3.6, -4.0, 2.4)), ((5.0, -5.5, 0.0), (5.2, -4.0, 2.4)), ((-2.0, -6.5, 0.0), (10.0, -6.3, 1.8)),
]  # fmt: skip


def twin_house(
    *, terrain: bool = False, doors: bool = True, garden: bool = True, state: Doors = Doors.OUTSIDE
) -> Scene:
    boxes = [("IfcSlab", SLAB), ("IfcSlab", ROOF), *(("IfcWall", wall) for wall in WALLS)]
    boxes += [("IfcBuildingElementProxy", each) for each in GARDEN if garden] + [("IfcSite", TERRAIN)] * terrain
    parts = [(kind, [box]) for kind, box in boxes]
    for x0, x1 in DOORS_X if doors else ():
        jambs = [((x, -0.2, 0.0), (x + 0.05, -0.1, 2.1)) for x in (x0, x1 - 0.05)]
        parts.append(("IfcDoor", [*jambs, ((x0 + 0.05, -0.17, 0.0), (x1 - 0.05, -0.13, 2.05))]))
    owner = np.repeat(np.arange(len(parts)), [12 * len(each) for _, each in parts])
    corners = [box_corners(*box) for _, each in parts for box in each]
    scene = scene_from_arrays(
        np.concatenate(corners),
        np.concatenate([BOX_FACES + 8 * number for number in range(len(corners))]),
        element_of_triangle=owner,
        elements=[
            Element(f"{kind} {number}", kind, str(number), 0, True if kind == "IfcDoor" else None)
            for number, (kind, _) in enumerate(parts)
        ],
        storeys=[Storey("Ground floor", "0", 0.0)],
    )
    opened = without_door_leaves(scene, state) if state != Doors.SHUT else scene
    return replace(opened, source=replace(opened.source, doors=state))


def area_m2(pieces_m) -> float:
    return float(np.prod(pieces_m[:, 1] - pieces_m[:, 0], axis=1).sum())


def test_level_ground_is_assumed_in_a_strip_around_the_house_and_one_line_reports_it() -> None:
    scene = twin_house()
    before = find_floors(scene).floors
    (floor, *_), lines = with_outdoor_ground(scene, before)
    (wide, deep), strip = np.subtract(HIGH, LOW), STRIP_M
    in_strip_m2 = 2.0 * strip * (wide + deep) + np.pi * strip * strip
    assert area_m2(floor.plane_m) == pytest.approx(in_strip_m2, rel=0.05)
    assert floor.ground_area_m2 - before[0].ground_area_m2 == pytest.approx(area_m2(floor.plane_m), rel=0.02)
    rooms = ((floor.plane_m[:, 0] < np.array(HIGH) - 0.3) & (floor.plane_m[:, 1] > np.array(LOW) + 0.3)).all(axis=1)
    assert not rooms.any()
    assert (floor.bounds_m[0] <= np.array(LOW) - strip + 0.2).all()
    (line,) = lines
    assert "the model has no ground outdoors" in line
    assert "level ground at 0.00 m is assumed" in line


@pytest.mark.slow
def test_terrain_of_the_model_is_the_ground_outdoors() -> None:
    scene = twin_house(terrain=True)
    (floor, *_), lines = with_outdoor_ground(scene, find_floors(scene).floors)
    assert (area_m2(floor.plane_m), lines) == (0.0, ())
    of_site = [number for number, element in enumerate(scene.elements) if element.kind == "IfcSite"]
    assert np.isin(scene.element_of_triangle[floor.ground_triangles], of_site).sum() == 2  # the top of its box


def test_without_exterior_doors_there_is_no_way_out() -> None:
    scene = twin_house(doors=False)
    with pytest.raises(RequirementError, match=r"join outside: got no exterior door .* leave the option out"):
        with_outdoor_ground(scene, find_floors(scene).floors)


def test_panels_shut_open_doors() -> None:
    scene = twin_house()
    assert [door.element for door in exterior_doors(scene)] == [len(scene.elements) - 2, len(scene.elements) - 1]
    through = np.array([[2.0, 2.0, 1.2], [6.3, 2.0, 1.2]])
    south = np.array([[0.0, -1.0, 0.0]] * 2)
    ranges = []
    for each in (scene, with_exterior_doors_shut(scene)):
        engine = Open3DEngine(each, make_patches(each, max_area_m2=1.0))
        ranges.append(engine.cast_rays(through, south, range_max_m=100.0).range_m)
    assert (ranges[0] > 6.0).all()
    np.testing.assert_allclose(ranges[1], 2.15, atol=0.01)


def settings(*, targets: bool | None = None, min_strength: float = 0.01, **more: object) -> PlanSettings:
    return PlanSettings(
        scanner=load_scanner("rtc360"),
        requirements=Requirements(
            scope=Scope.AUTO,
            coverage=0.9,
            pre_alignment=PreAlignment.TRACKED,
            targets=targets,
            min_strength=min_strength,
        ),
        method=Proven(work_limit=0.5, prove=False),
        **{"grid_step_m": 1.0, "max_patch_area_m2": 0.25, "refine": False, **more},
    )


@pytest.mark.slow
def test_the_same_is_in_scope_as_with_shut_doors_and_stations_may_stand_beside_the_house() -> None:
    in_scope_m2 = []
    for state in (Doors.SHUT, Doors.OUTSIDE):
        survey = make_survey(twin_house(state=state), settings())
        scoped = with_scope(survey, settings().requirements, open_engine(survey.scene, survey.patches))
        in_scope_m2.append(float(scoped.patches.area_m2[scoped.scope.in_scope].sum()))
    leaves_m2 = (3.3 + 0.9) * 2.05
    assert in_scope_m2[0] - leaves_m2 - 2.0 <= in_scope_m2[1] <= in_scope_m2[0] + 1.0
    scope = scoped.scope
    # Right behind open doors, too.
    in_room = ((scope.ground_m > [0.0, 0.0, -0.1]) & (scope.ground_m < [8.3, 4.0, 0.1])).all(axis=1)
    assert in_room.sum() > 100
    assert scope.indoors[in_room].all()
    assert (scope.observed | ~scope.in_scope).all()
    seen_beside = scope.observed & ~scope.in_scope
    assert scoped.patches.area_m2[seen_beside].sum() > 100.0
    places_m = np.array([[2.0, 2.0, 0.0], [2.0, -3.0, 0.0], [2.0, -1.0 - OUTDOORS_M, 0.0], [2.0, -3.0, 9.0]])
    assert scope.surveys(places_m).tolist() == [True, False, False, False]
    assert scope.admits(places_m).tolist() == [True, True, False, False]


@pytest.mark.parametrize("scope", [Scope.ALL, Scope.EXTERIOR])
def test_only_the_interior_is_joined(scope: Scope) -> None:
    survey = make_survey(twin_house(), settings())
    engine = Open3DEngine(survey.scene, survey.patches)
    with pytest.raises(RequirementError, match=f"join outside: got scope {scope}, expected interior"):
        with_scope(survey, Requirements(scope=scope), engine)


def test_two_dwellings_become_one_network_by_stations_outdoors() -> None:
    joined = make_plan(twin_house(), settings())
    assert joined.connected
    (line,) = [line for line in joined.warnings if "outdoors, to register" in line]
    out = [each.id for each in joined.stations if each.position_m[1] < LOW[1]]
    assert out
    assert all(name in line for name in out)
    # What is required, and is covered, is indoors alone: rooms of 4 x 4 m.
    assert joined.coverage.fraction_of_achievable >= 0.9
    assert joined.coverage.total_area_m2 == pytest.approx(2 * (2 * 16.0 + 16.0 * 2.6 - 2.1), rel=0.15)


def offered(apart: Plan) -> int:
    """Number of stations outdoors that a plan in two groups offers to make it one."""
    (offer,) = [line for line in apart.warnings if "--join outside" in line]
    found = re.fullmatch(
        r"2 groups: (\d+) more stations? outdoors or at exterior doors, about (\d+) min to set up and scan, with "
        r"exterior doors open, makes? them one \(--join outside\)",
        offer,
    )
    assert found is not None, offer
    n_more = int(found[1])
    assert int(found[2]) == round(n_more * (settings().crew.set_up_s + settings().crew.scan_s) / 60)
    return n_more


@pytest.mark.slow
def test_a_plan_in_two_groups_offers_stations_outdoors_with_their_number_and_time() -> None:
    apart = make_plan(twin_house(state=Doors.OPEN), settings(max_patch_area_m2=1.0))
    assert not apart.connected
    assert offered(apart) >= 1


@pytest.mark.slow
def test_targets_are_part_of_the_offer_where_they_are_needed() -> None:
    apart = make_plan(twin_house(state=Doors.OPEN, garden=False), settings())
    (offer,) = [line for line in apart.warnings if "--join outside" in line]
    assert re.search(
        r", and three targets for (one pair|each of \d pairs), with exterior doors open, make them one", offer
    )


@pytest.mark.slow
def test_as_many_stations_outdoors_as_are_offered_join() -> None:
    apart = make_plan(twin_house(state=Doors.OPEN), settings())
    locked = tuple(
        PriorStation(each.id, tuple((each.position_m + apart.survey.scene.offset_m).tolist()), Role.LOCKED)
        for each in apart.stations
    )
    joined = make_plan(twin_house(), settings(site=Site(prior=locked), set_up_tolerance_m=0.0))
    assert joined.connected
    assert len(joined.stations) <= len(apart.stations) + offered(apart)


@pytest.mark.slow
def test_targets_join_what_slides_along_a_plain_wall_and_both_stations_see_them() -> None:
    joined = make_plan(twin_house(garden=False), settings(min_strength=0.06))
    assert joined.connected
    linked = [link for link in joined.links if link.targets_m]
    ids = [station.id for station in joined.stations]
    by_surface = [link for link in joined.links if link.counts(joined.registration.limits) and not link.targets_m]
    graph = nx.Graph([(link.a, link.b) for link in by_surface])
    graph.add_nodes_from(ids)
    assert not make_plan(twin_house(garden=False), settings(min_strength=0.06, targets=False)).connected
    assert nx.number_connected_components(graph) == len(linked) + 1 > 1  # no more targets than groups need
    assert joined.registration.doors_needed
    held = " ".join(line for line in joined.warnings if "falls apart" in line)
    assert not any(f"{link.a} to {link.b}" in held for link in linked), "targets hold as stations are set up"
    (line,) = [line for line in joined.warnings if "by targets alone" in line]
    assert all(f"{link.a} to {link.b}" in line for link in linked)
    engine = Open3DEngine(joined.survey.scene, joined.survey.patches)
    at_m = dict(zip(ids, (station.position_m for station in joined.stations), strict=True))
    for link in linked:
        away_m = np.array(link.targets_m) - np.array([at_m[link.a], at_m[link.b]])[:, None]
        range_m = np.linalg.norm(away_m, axis=2)
        assert (range_m <= 20.0).all()
        for end, to_m, far_m in zip((link.a, link.b), away_m, range_m, strict=True):
            hits = engine.cast_rays(np.tile(at_m[end], (3, 1)), to_m, range_max_m=50.0)
            np.testing.assert_allclose(hits.range_m, far_m, atol=0.006)


@pytest.mark.slow
def test_no_stations_outdoors_are_offered_that_join_nothing() -> None:
    """Along a plain wall scans slide."""
    apart = make_plan(twin_house(state=Doors.OPEN, garden=False), settings(targets=False))
    assert not apart.connected
    (line,) = [line for line in apart.warnings if "--join outside" in line]
    assert re.fullmatch(r"2 groups: none of \d+ places outdoors and at exterior doors joins any of them \(.*\)", line)

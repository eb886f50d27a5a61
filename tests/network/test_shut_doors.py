"""Doors shut: what they hide against scans of the scene with its door shut; links of counted patches by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from planner_core.engine.open3d import Open3DEngine
from planner_core.errors import RequirementError
from planner_core.model import (
    Doors,
    Element,
    Link,
    LinkLimits,
    PlacedDoor,
    PlanSettings,
    Proven,
    Requirements,
    Scene,
    Visibility,
)
from planner_core.network.candidate_links import CandidateLinks, held_in_both_states
from planner_core.network.network_report import registration_report
from planner_core.network.shut_doors import hidden_by, unknown_doors, with_doors
from planner_core.planning import plan as plans
from planner_core.planning.plan import make_plan
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.doors import without_door_leaves
from planner_core.scene.patches import make_patches, patch_triangles
from tests.coverage.conftest import BOX_FACES, box_corners

#: Two rooms of 4 x 4 x 2.6 m, between them a wall with a door of 0.9 x 2.1 m.
BOXES = [
    ("IfcSlab", ((-0.2, -0.2, -0.2), (8.4, 4.2, 0.0))), ("IfcSlab", ((-0.2, -0.2, 2.6), (8.4, 4.2, 2.8))),
    ("IfcWall", ((-0.2, -0.2, 0.0), (0.0, 4.2, 2.6))), ("IfcWall", ((8.2, -0.2, 0.0), (8.4, 4.2, 2.6))),
    ("IfcWall", ((0.0, -0.2, 0.0), (8.2, 0.0, 2.6))), ("IfcWall", ((0.0, 4.0, 0.0), (8.2, 4.2, 2.6))),
    ("IfcWall", ((4.0, 0.0, 0.0), (4.2, 1.5, 2.6))), ("IfcWall", ((4.0, 2.4, 0.0), (4.2, 4.0, 2.6))),
    ("IfcWall", ((4.0, 1.5, 2.1), (4.2, 2.4, 2.6))), ("IfcDoor", ((4.08, 1.5, 0.0), (4.12, 2.4, 2.1))),
]  # fmt: skip
STATIONS_M = np.array([[1.5, 1.9, 1.5], [3.2, 1.2, 1.8], [6.8, 2.6, 1.5], [4.1, 1.95, 1.5]])


def rooms() -> Scene:
    """The door last: patches of all else have the same numbers with and without it."""
    n = len(BOXES)
    return scene_from_arrays(
        np.concatenate([box_corners(*box) for _, box in BOXES]),
        np.concatenate([BOX_FACES + 8 * number for number in range(n)]),
        element_of_triangle=np.repeat(np.arange(n), 12),
        elements=[Element(f"{kind} {number}", kind, f"id{number}") for number, (kind, _) in enumerate(BOXES)],
    )


def test_a_shut_door_hides_what_rays_do_not_reach_with_it_shut() -> None:
    """Rays to the middles of patches, with the leaf and without; the door's own patches are left out."""
    shut = rooms()
    opened = without_door_leaves(shut)
    (door,) = opened.open_doors
    assert opened.elements[door.element].source_id == "id9"
    patches = make_patches(opened, max_area_m2=0.05)
    middle_m = patch_triangles(opened, patches).mean(axis=1)
    stations_m = STATIONS_M - opened.offset_m

    def reached(scene: Scene) -> np.ndarray:
        engine = Open3DEngine(scene, make_patches(scene, max_area_m2=0.05))
        away_m = (middle_m - stations_m[:, None]).reshape(-1, 3)
        hits = engine.cast_rays(np.repeat(stations_m, len(middle_m), axis=0), away_m, range_max_m=100.0)
        return (np.abs(hits.range_m - np.linalg.norm(away_m, axis=1)) < 1e-3).reshape(len(stations_m), -1)

    now, then = reached(opened), reached(shut)
    starts = np.cumsum([0, *now.sum(axis=1)])
    seen = Visibility(starts, np.nonzero(now)[1].astype(np.int32), patches.n_patches)
    hidden = hidden_by(door, seen, middle_m, stations_m)
    for row in range(3):
        found = np.zeros(patches.n_patches, dtype=bool)
        found[seen.row(row)[hidden[starts[row] : starts[row + 1]]]] = True
        expected = now[row] & ~then[row]
        assert expected.sum() > 50
        # The leaf is 4 cm thick, its panel nothing: rays along its edge.
        assert (found != expected).sum() <= 0.02 * expected.sum()
    assert not hidden[starts[3] :].any(), "who stands in the doorway keeps it open"


def placed(number: int, y0_m: float) -> PlacedDoor:
    return PlacedDoor(number, np.array([[4.0, y0_m, 0.0], [4.1, y0_m + 1.0, 2.1]]), np.array([1.0, 0.0]))


@pytest.mark.parametrize(
    ("seen", "is_only_open", "is_only_shut"),
    [
        pytest.param(([0, 1, 2, 3, 4, 5], [2, 3, 4, 5, 6, 7]), True, False, id="common surface beyond the door"),
        pytest.param(([0, 1, 2, 3, 4, 5], [0, 1]), False, True, id="much that one alone sees beyond the door"),
        pytest.param(([0, 1], [0, 1]), False, False, id="nothing beyond the door"),
    ],
)
def test_links_name_the_doors_that_they_need_open_or_shut(
    seen: tuple[list[int], list[int]], is_only_open: bool, is_only_shut: bool
) -> None:
    """Patches 0 and 1 lie in the stations' room, the others beyond the door."""
    centroid_m = np.array([[1.0, 0.2, 1.0], [1.0, 0.8, 1.0], *([7.0, 0.5, 1.0 + 0.05 * k] for k in range(6))])
    corner_m = 0.01 * np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, -1.0]])
    plates = scene_from_arrays(
        (centroid_m[:, None] + corner_m).reshape(-1, 3), np.arange(24).reshape(-1, 3),
        element_of_triangle=np.zeros(8, dtype=int), elements=rooms().elements,
    )  # fmt: skip
    scene = replace(plates, open_doors=(placed(0, 0.0), placed(1, 5.0)))
    survey = SimpleNamespace(scene=scene, patches=make_patches(scene, max_area_m2=1.0), scanner=load_scanner("rtc360"))
    visibility = Visibility(np.cumsum([0, *map(len, seen)]), np.concatenate(seen).astype(np.int32), len(centroid_m))
    overlap = len(np.intersect1d(*seen)) / max(map(len, seen))
    (link,) = with_doors(
        [Link("A", "B", overlap, np.nan)],
        survey,
        Requirements(overlap=0.5, min_probability=0.0, min_strength=0.0),
        visibility,
        ("A", "B"),
        np.array([[2.0, 0.4, 1.2], [2.0, 0.6, 1.2]]) - scene.offset_m,
    )
    assert link.only_open == (("id0",) if is_only_open else ())
    assert link.only_shut == (("id0",) if is_only_shut else ())


def test_the_network_names_the_doors_that_it_falls_apart_without() -> None:
    links = [
        Link("A", "B", 0.5, np.nan, only_open=("front", "back")),
        Link("B", "C", 0.5, np.nan),
        Link("A", "C", 0.5, np.nan, only_open=("back",)),
        Link("C", "D", 0.2, np.nan, only_open=("other",)),
    ]
    found = registration_report(links, "ABCD", ["F0"] * 4, limits=LinkLimits(overlap=0.3))
    assert found.doors_needed == ("back",)


def settings(*, grid_step_m: float = 1.0, special_places: bool = True, **required: object) -> PlanSettings:
    return PlanSettings(
        scanner=load_scanner("rtc360"),
        requirements=Requirements(coverage=0.9, pre_alignment="tracked", **required),
        method=Proven(work_limit=0.5, prove=False),
        grid_step_m=grid_step_m,
        special_places=special_places,
        max_patch_area_m2=0.25,
        refine=False,
    )


def test_a_network_that_holds_with_doors_shut_has_a_station_in_the_doorway() -> None:
    opened = without_door_leaves(rooms())
    opened = replace(opened, source=replace(opened.source, doors=Doors.OPEN))
    plan = make_plan(opened, settings(doors_change=True))
    assert plan.connected
    x_m = np.array([station.position_m[0] for station in plan.stations]) + opened.offset_m[0]
    assert (np.abs(x_m - 4.1) < 0.4).any()
    assert plan.registration.doors_needed == ()
    assert not [link for link in plan.links if link.counts(plan.registration.limits) and link.only_open]


def test_without_a_station_in_the_doorway_nothing_holds_with_the_door_shut_and_the_gap_names_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(plans, "with_joining_candidates", lambda pool, *_, **__: pool)
    opened = without_door_leaves(rooms())
    opened = replace(opened, source=replace(opened.source, doors=Doors.OPEN))
    beside_it = {"grid_step_m": 1.5, "special_places": False}
    plain = make_plan(opened, settings(**beside_it))
    assert plain.connected
    assert plain.registration.doors_needed == ("id9",)
    changing = make_plan(opened, settings(**beside_it, doors_change=True))
    assert len(changing.registration.networks) == 2
    (line,) = [line for line in changing.warnings if "registers only while" in line]
    assert "registers only while door id9 is open; add a station in the doorway" in line


def test_doors_that_are_modelled_ajar_without_a_frame_are_taken_as_open_and_counted() -> None:
    ajar = PlacedDoor(9, np.array([[3.5, 1.5, 0.0], [4.3, 2.4, 2.1]]), np.array([0.6, 0.8]))
    assert unknown_doors(replace(rooms(), open_doors=(placed(0, 0.0),))) == ()
    (line,) = unknown_doors(replace(rooms(), open_doors=(ajar, placed(0, 0.0))))
    assert "1 of the 2 open doors" in line


def test_doors_that_change_are_refused_where_none_is_open() -> None:
    with pytest.raises(RequirementError, match=r"doors change: got .* without an open door, expected some"):
        make_plan(rooms(), settings(doors_change=True))


def test_links_hold_in_both_states_where_all_four_pairs_of_scans_do() -> None:
    """Three candidates; rows 3 to 5 are theirs with doors shut. 0 and 1 lack one pair, 1 and 2 none."""
    pairs = [(0, 1), (0, 4), (3, 4), (1, 2), (1, 5), (4, 2), (4, 5), (0, 3), (1, 4)]
    figure = {pair: 0.9 - 0.1 * place for place, pair in enumerate(pairs)}
    both = sorted([*pairs, *((b, a) for a, b in pairs)])
    starts = np.searchsorted([a for a, _ in both], np.arange(7))
    least = np.array([figure.get((a, b), figure.get((b, a))) for a, b in both])
    neighbour = np.array([b for _, b in both], dtype=np.int32)
    found = held_in_both_states(CandidateLinks(starts, neighbour, least, least, np.zeros(6, np.int32)))
    assert found.starts.tolist() == [0, 0, 1, 2]
    assert found.neighbour.tolist() == [2, 1]
    assert found.overlap.tolist() == pytest.approx([figure[4, 5]] * 2)
    assert found.part.tolist() == [0, 1, 1]

"""Whether plans register: their stations set up beside their marks, scanned, and registered as a whole.

    python -m tests.benchmarks.bench_registration_plans [--buildings house,duplex] [--write PAGE]

Each building is planned with default requirements; its stations stand anywhere within the set-up tolerance of their
marks. Clouds and pairs are those of `bench_registration`; all pairs that the plan counts as links are registered, and
Open3D's pose graph makes one network of them, without knowing the truth. Other set-ups are not registered: counted is
how many hold the plan's groups by links that count as set up, and how many cover as much as the plan states. Not a
test: nothing here fails.
"""

from __future__ import annotations

import argparse
import os
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np

os.environ.setdefault("OMP_NUM_THREADS", "1")

from planner_core.coverage.coverage import times_seen
from planner_core.engine.open3d import import_open3d
from planner_core.engine.open_engine import open_engine
from planner_core.engine.patch_mode import mode_that_counts_parts
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import Doors, FloatArray, Optics, Plan, PlanSettings, Proven, Scope, VisibilityMode
from planner_core.network.links import overlap_links, surface_of_patches
from planner_core.network.network_report import registration_report
from planner_core.planning.plan import make_plan
from planner_core.requirements.goals import NO_COVER, OVERALL, goals_of
from planner_core.requirements.observe_candidates import observe_candidates
from planner_core.requirements.read import requirements_from
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.doors import without_door_leaves
from tests.benchmarks.bench_real_buildings import put
from tests.benchmarks.bench_registration import STARTS, pose_errors, scene_of
from tests.benchmarks.registration.clouds import moved, scan
from tests.benchmarks.registration.methods import point_to_plane, prepare
from tests.benchmarks.registration.rule import NEAR_DEG, NEAR_MM

BUILDINGS = (
    "house", "basement", "school", "corridor-comb", "stairwell", "duplex", "fzk-haus", "sample-house", "renga-house",
    "openhouse", "duplex-outside", "renga-house-outside",
)  # fmt: skip
#: Assumed standard deviations of a target's centre, and of what a compensator leaves of tilt.
TARGET_NOISE_M, LEVEL_DEG = 0.001, 0.005
SCANNERS = {"tracked": "rtc360", "manual": "focus-premium-70"}
o3d = import_open3d()
_graph = o3d.pipelines.registration


def planned(name: str, scanner: str) -> Plan:
    """Plan a building as the command does, quickly: doors open, and beams end at glass."""
    used = load_scanner(scanner)
    requirements, _ = requirements_from({}, deliverable="survey", scope=Scope.AUTO, no_cover=NO_COVER)
    settings = PlanSettings(used, requirements, method=Proven(work_limit=3.0, prove=False), refine=False)
    settings = replace(settings, scan_mode=mode_that_counts_parts(VisibilityMode.AUTO, used))
    scene = scene_of(name)
    if scene.source.doors != Doors.OUTSIDE:
        scene = without_door_leaves(scene, Doors.OPEN)
        scene = replace(scene, source=replace(scene.source, doors=Doors.OPEN))
    if (optics := scene.optics_of_triangle) is not None:
        stops = np.where(optics == Optics.PASSES, np.uint8(Optics.STOPS), optics)
        scene = replace(scene, optics_of_triangle=stops)
    return make_plan(scene, settings)


def set_up_m(plan: Plan, random: np.random.Generator) -> FloatArray:
    """(S, 3) stations set up anywhere within the tolerance of their marks."""
    marks_m = np.array([station.position_m for station in plan.stations])
    tolerance_m, turn = plan.settings.set_up_tolerance_m, 2.0 * np.pi * random.random(len(marks_m))
    away_m = tolerance_m * np.sqrt(random.random(len(marks_m)))
    rise_m = tolerance_m * (random.random(len(marks_m)) - 0.5)
    return marks_m + np.column_stack([away_m * np.cos(turn), away_m * np.sin(turn), rise_m])


def held(plan: Plan, engine: ScanEngine, n: int, random: np.random.Generator) -> tuple[int, FloatArray]:
    """Of n random set-ups, how many hold the plan's groups; and (n,) the fraction that each covers."""
    survey, required = plan.survey, plan.settings.requirements
    ids = tuple(station.id for station in plan.stations)
    floors, goals = [station.floor for station in plan.stations], goals_of(survey, required)
    area_m2 = survey.patches.area_m2 * (plan.achievable & plan.required)
    assert plan.registration is not None
    n_held, shares = 0, []
    for at_m in (set_up_m(plan, random) for _ in range(n)):
        rows = observe_candidates(survey, engine, at_m, goals, notes_needed=False).rows
        shares.append(float(area_m2[times_seen(rows.met) > 0].sum() / area_m2.sum()))
        surface = surface_of_patches(survey.scene, survey.patches, times_seen(rows.seen) > 0)
        start = plan.settings.pre_alignment
        links = overlap_links(rows.seen, survey.patches.area_m2, ids, surface, at_m, pre_alignment=start)
        targets = {(link.a, link.b): link for link in plan.links if link.targets_m}
        links = (*(link for link in links if (link.a, link.b) not in targets), *targets.values())
        found = registration_report(links, ids, floors, limits=required.link_limits.as_set_up())
        n_held += len(found.networks) <= len(plan.registration.networks)
    return n_held, np.array(shares)


def registered(plan: Plan, engine: ScanEngine, start: str, random: np.random.Generator) -> tuple[int, int, list[float]]:
    """Links that register, all links, and how far off each station comes to lie, mm, to its network's first."""
    limits = plan.settings.requirements.link_limits
    at_m = set_up_m(plan, random)
    clouds = [prepare(scan(engine, plan.survey.scene, each_m, random), random, for_all=False) for each_m in at_m]
    place = {station.id: number for number, station in enumerate(plan.stations)}
    edges, n_good = [], 0
    for link in plan.links:
        if not link.counts(limits):
            continue
        a, b = place[link.a], place[link.b]
        truth = np.linalg.inv(clouds[a].cloud.pose) @ clouds[b].cloud.pose
        if link.targets_m:
            found = by_targets(np.array(link.targets_m), clouds[a].cloud.pose, clouds[b].cloud.pose, random)
        else:
            found = point_to_plane(clouds[a], clouds[b], truth @ moved(*STARTS[start], random), start)
        off_mm, off_deg = pose_errors(truth, found)
        n_good += off_mm <= NEAR_MM and off_deg <= NEAR_DEG
        points = [clouds[each].levels[-1][0] for each in (a, b)]
        information = _graph.get_information_matrix_from_point_clouds(points[1], points[0], 0.05, found)
        edges.append((a, b, found, information))
    errors_mm = []
    assert plan.registration is not None
    for network in plan.registration.networks:
        members = [place[station] for station in network.stations]
        errors_mm += _errors_mm(members, edges, [cloud.cloud.pose for cloud in clouds])
    return n_good, len(edges), errors_mm


def by_targets(places_m: FloatArray, a: FloatArray, b: FloatArray, random: np.random.Generator) -> FloatArray:
    """Register level scans by the centres of targets (K, 3), in the scene, that each measures: a turn and a shift.

    a, b : (4, 4) true poses.
    """
    noise_m = random.normal(0.0, TARGET_NOISE_M, (2, *places_m.shape))
    of_a, of_b = (
        (places_m - pose[:3, 3] + noise) @ _tilt(random).T for pose, noise in zip((a, b), noise_m, strict=True)
    )
    from_a, from_b = of_a - of_a.mean(axis=0), of_b - of_b.mean(axis=0)
    turn = np.arctan2(
        (from_b[:, 0] * from_a[:, 1] - from_b[:, 1] * from_a[:, 0]).sum(), (from_b[:, :2] * from_a[:, :2]).sum()
    )
    found = np.eye(4)
    found[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    found[:3, 3] = of_a.mean(axis=0) - found[:3, :3] @ of_b.mean(axis=0)
    heading_a, heading_b = (np.block([[pose[:3, :3], np.zeros((3, 1))], [np.zeros((1, 3)), 1.0]]) for pose in (a, b))
    return np.asarray(heading_a.T @ found @ heading_b)


def _tilt(random: np.random.Generator) -> FloatArray:
    """What a compensator leaves of a scanner's tilt."""
    x, y = random.normal(0.0, np.radians(LEVEL_DEG), 2)
    return np.array([[1.0, 0.0, y], [0.0, 1.0, -x], [-y, x, 1.0]])


def _errors_mm(
    members: list[int], edges: list[tuple[int, int, FloatArray, FloatArray]], truth: list[FloatArray]
) -> list[float]:
    """Of one network's stations: laid out along a tree of links, then all links together."""
    node = {station: number for number, station in enumerate(members)}
    inside = [(node[a], node[b], found, information) for a, b, found, information in edges if a in node]
    pose: dict[int, FloatArray] = {0: np.eye(4)}
    tree = set()
    # The links of most information first: Prim.
    while len(pose) < len(members):
        a, b, found, _ = max(
            (edge for edge in inside if (edge[0] in pose) != (edge[1] in pose)), key=lambda edge: float(edge[3][0, 0])
        )
        tree.add((a, b))
        if a in pose:
            pose[b] = pose[a] @ found
        else:
            pose[a] = pose[b] @ np.linalg.inv(found)
    graph = _graph.PoseGraph()
    graph.nodes.extend([_graph.PoseGraphNode(pose[number]) for number in range(len(members))])
    graph.edges.extend(
        [
            _graph.PoseGraphEdge(b, a, found, information, uncertain=(a, b) not in tree)
            for a, b, found, information in inside
        ]
    )
    option = _graph.GlobalOptimizationOption(
        max_correspondence_distance=0.05, edge_prune_threshold=0.25, preference_loop_closure=1.0, reference_node=0
    )
    _graph.global_optimization(
        graph,
        _graph.GlobalOptimizationLevenbergMarquardt(),
        _graph.GlobalOptimizationConvergenceCriteria(),
        option,
    )
    first = np.linalg.inv(graph.nodes[0].pose)
    of_first = np.linalg.inv(truth[members[0]])
    return [
        pose_errors(of_first @ truth[station], first @ graph.nodes[number].pose)[0]
        for number, station in enumerate(members)
    ]


def rows(name: str, start: str, n_set_ups: int) -> tuple[str, str]:
    """Rows of both tables: what registers, and what other set-ups cover."""
    plan, random = planned(name, SCANNERS[start]), np.random.default_rng(zlib.crc32(name.encode()))
    engine = open_engine(plan.survey.scene, plan.survey.patches)
    n_good, n_links, errors_mm = registered(plan, engine, start, random)
    n_held, shares = held(plan, engine, n_set_ups, random)
    [overall] = [result for result in plan.requirements if result.name == OVERALL]
    assert plan.registration is not None and overall.as_set_up is not None
    head = f"| {name} | {start} | {len(plan.stations)} |"
    return (
        f"{head} {len(plan.registration.networks)} | {n_good} of {n_links} | "
        f"{np.median(errors_mm):.1f} | {max(errors_mm):.1f} | {n_held} of {n_set_ups} |",
        f"{head} {100 * overall.fraction_of_achievable:.2f} | {100 * overall.as_set_up:.2f} | "
        f"{(shares >= overall.as_set_up).sum()} of {n_set_ups} | {100 * shares.min():.2f} |",
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--buildings", default=",".join(BUILDINGS))
    parser.add_argument("--starts", default=",".join(SCANNERS))
    parser.add_argument("--set-ups", type=int, default=50)
    parser.add_argument("--write", type=Path)
    asked = parser.parse_args()
    tables = {
        "plans": [
            "| building | start | stations | groups | links that register | station off, median mm | most mm "
            "| set-ups that hold |",
            "|---|---|---|---|---|---|---|---|",
        ],
        "set-ups": [
            "| building | start | stations | coverage on the marks, % | as set up, % | set-ups that cover that "
            "| least of them, % |",
            "|---|---|---|---|---|---|---|",
        ],
    }
    for name in asked.buildings.split(","):
        for start in asked.starts.split(","):
            for lines, line in zip(tables.values(), rows(name, start, asked.set_ups), strict=True):
                lines.append(line)
                print(line, flush=True)
    if asked.write:
        for mark, lines in tables.items():
            put(asked.write, mark, lines)


if __name__ == "__main__":
    main()

"""What `--join outside` would do for a plan in several groups: how many stations outdoors join them.

Input a `Plan` of the interior whose groups no link joins; output a line for its warnings. The plan's stations stay;
candidates are outdoors and around exterior doors, and of these a few are taken that link groups, by the shortest ways
through the graph of links with all doors open. Links count as on the marks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planner_core.engine.open_engine import open_engine
from planner_core.model import Candidates, Doors, FloatArray, Int64Array, Plan, Role, Scope, Survey, SurveyScope
from planner_core.network.candidate_links import parts_of
from planner_core.planning.first_plan import far_apart
from planner_core.planning.pool import Pool, kept_links, links_among, make_pool, with_target_links
from planner_core.positions.admissibility import Tripods
from planner_core.positions.allowed_positions import AllowedPositions, find_positions
from planner_core.positions.free_space import free_space
from planner_core.positions.local_site import local_site
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.requirements.goals import goals_of, wanted_of
from planner_core.route.route import field_time
from planner_core.scene.doors import door_leaves, exterior_doors, without_door_leaves
from planner_core.scene.ground_planes import with_ground_planes
from planner_core.scene.outdoor_ground import OUTDOORS_M, with_outdoor_ground
from planner_core.scene.patches import make_patches
from planner_core.select.network import connect

#: Candidates that are observed at most, further apart on large sites: what this costs a plan is bounded by it.
_MOST = 120
#: About the distance between them; within so far of an exterior door all are observed, indoors, too.
_APART_M, _NEAR_DOOR_M = 1.5, 2.0
_STAGE = "way out"


def join_offer(plan: Plan, engine: str, *, progress: Progress = silent) -> str:
    """Return a line that states how many stations outdoors join which number of groups, and their time.

    engine : `opencl` or `open3d`.
    """
    requirements = replace(plan.settings.requirements, parts=(), seen_from=1)
    # Keep-outs hold outdoors, too; the plan's stations are candidates by themselves.
    site = replace(plan.settings.site, prior=tuple(s for s in plan.settings.site.prior if s.role == Role.FORBIDDEN))
    settings = replace(plan.settings, requirements=requirements, site=site)
    survey = _opened(plan.survey)
    scan_engine = open_engine(survey.scene, survey.patches, engine=engine)
    space = free_space(survey)
    survey = replace(survey, scope=_scope(plan.survey, survey, space.position_m(np.arange(space.n_nodes)), plan))
    tripods = Tripods(survey, settings, scan_engine)
    places = find_positions(tripods, local_site(survey, site), space=space)
    at = _with_stations(plan, places.candidates.take(_outdoors(survey, places)))
    given = np.arange(len(plan.stations))

    def of_stage(event: ProgressEvent) -> None:
        progress(replace(event, stage=_STAGE))

    pool = make_pool(
        survey, goals_of(survey, requirements), scan_engine, at,
        given=given, kept=given[:0], linked=True, progress=of_stage,
    )  # fmt: skip
    pool = with_target_links(pool, scan_engine)
    assert pool.network is not None and plan.registration is not None
    chosen = connect(pool.problem, pool.network, pool.given)
    for candidate in chosen[given.size :]:
        if pool.network.can_spare(chosen)(chosen.index(candidate)):
            chosen.remove(candidate)
    n_more = len(chosen) - given.size
    n_after = int(np.unique(pool.network.part[chosen]).size)
    if n_after >= (n_before := len(plan.registration.networks)):
        return (
            f"{n_before} groups: none of {at.floor.size - given.size} places outdoors and at exterior doors joins "
            "any of them (--join outside)"
        )
    n_by_targets = _n_groups_by_surface(pool, chosen) - n_after
    return _line(plan, n_before=n_before, n_after=n_after, n_more=n_more, n_by_targets=n_by_targets)


def _n_groups_by_surface(pool: Pool, chosen: Sequence[int]) -> int:
    """Groups of chosen rows without what targets join."""
    assert pool.links is not None
    rows = np.array(sorted(chosen), dtype=np.int64)
    place = np.full(pool.n_candidates, -1, dtype=np.int64)
    place[rows] = np.arange(rows.size)
    among = links_among(pool.links, rows, place)
    owner = np.repeat(np.arange(rows.size, dtype=np.int64), np.diff(among.starts))
    left = kept_links(among, among.by_surface, owner, among.part)
    return int(parts_of(left.starts, left.neighbour).max(initial=-1)) + 1


def _line(plan: Plan, *, n_before: int, n_after: int, n_more: int, n_by_targets: int) -> str:
    whole = "one" if n_after == 1 else f"{n_after}"
    pairs = "one pair" if n_by_targets == 1 else f"each of {n_by_targets} pairs"
    targets = f"three targets for {pairs}" if n_by_targets else ""
    if not n_more:
        opened = f"open exterior doors and {targets}" if targets else "open exterior doors alone"
        return f"{n_before} groups: {opened} make them {whole} (--join outside)"
    time = field_time(plan.settings.crew, n_scans=n_more, walk_m=0.0)
    what, seconds = ("to set up", time.set_up_s) if time.total_s is None else ("to set up and scan", time.total_s)
    return (
        f"{n_before} groups: {n_more} more {'station' if n_more == 1 else 'stations'} outdoors or at exterior doors, "
        f"about {max(1, round(seconds / 60))} min {what}, {f'and {targets}, ' if targets else ''}with exterior doors "
        f"open, {'make' if n_more > 1 or targets else 'makes'} them {whole} (--join outside)"
    )


def _opened(survey: Survey) -> Survey:
    """The survey with all doors open and ground outdoors."""
    scene = survey.scene
    stays = ~door_leaves(scene, Doors.ALL, shut=scene.source.doors_shut)
    number = np.cumsum(stays) - 1
    floors = tuple(
        replace(
            floor,
            ground_triangles=number[floor.ground_triangles[stays[floor.ground_triangles]]].astype(np.int32),
            plane_m=floor.plane_m[:0],  # the scene has these as triangles
        )
        for floor in survey.floors
    )
    opened = without_door_leaves(scene, Doors.ALL, shut=scene.source.doors_shut)
    opened = replace(opened, source=replace(scene.source, doors=Doors.OUTSIDE))
    floors, _ = with_outdoor_ground(opened, floors)
    opened, floors = with_ground_planes(opened, floors)
    of_floor = np.full(opened.n_triangles, -1, dtype=np.int32)
    of_floor[: number[-1] + 1] = survey.floor_of_triangle[stays]
    patches = make_patches(opened, max_area_m2=survey.patches.max_area_m2)
    return replace(survey, scene=opened, floors=floors, patches=patches, floor_of_triangle=of_floor, scope=None)


def _scope(before: Survey, survey: Survey, ground_m: FloatArray, plan: Plan) -> SurveyScope:
    """Indoors as without open doors; all surface of which something may be required is observed."""
    assert before.scope is not None
    wanted = wanted_of(survey, plan.settings.requirements)
    return SurveyScope(
        kind=Scope.INTERIOR,
        in_scope=wanted,
        observed=wanted,
        ground_m=ground_m,
        indoors=before.scope.surveys(ground_m),
        outdoors_m=OUTDOORS_M,
    )


def _outdoors(survey: Survey, places: AllowedPositions) -> Int64Array:
    """(K,) rows, sorted, of candidates outdoors, far apart, and of all near exterior doors."""
    assert survey.scope is not None
    at = places.candidates
    ground_m = at.position_m - np.column_stack([np.zeros((at.floor.size, 2)), at.instrument_height_m])
    is_out = ~survey.scope.surveys(ground_m)
    near_door = np.zeros(at.floor.size, dtype=bool)
    for door in exterior_doors(survey.scene):
        off_m = ground_m - [*door.box_m[:, :2].mean(axis=0), door.box_m[0, 2]]
        near_door |= np.linalg.norm(off_m, axis=1) <= _NEAR_DOOR_M
    rows = np.flatnonzero(is_out)
    few = rows[far_apart(at.take(rows), _APART_M, most=_MOST)] if rows.size else rows
    return np.union1d(few, np.flatnonzero(near_door))


def _with_stations(plan: Plan, more: Candidates) -> Candidates:
    """The plan's stations, and candidates behind them."""
    index = {floor.id: number for number, floor in enumerate(plan.survey.floors)}
    stations = plan.stations
    return replace(
        more,
        position_m=np.concatenate([np.stack([each.position_m for each in stations]), more.position_m]),
        floor=np.append(np.array([index[each.floor] for each in stations], dtype=np.int32), more.floor),
        instrument_height_m=np.append([each.instrument_height_m for each in stations], more.instrument_height_m),
    )

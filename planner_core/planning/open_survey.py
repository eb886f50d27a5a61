"""From a scene to a survey and the engine that scans it, for whoever plans or evaluates.

Exterior doors are open where both sides are surveyed, whatever else `Doors.OPEN` leaves shut: the crew walks through
them, and what lies behind, a loggia or a deep porch, is to register with the rooms.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import Doors, FloatArray, Paper, PlacedDoor, PlanSettings, Scene, Scope, Survey, SurveyScope
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.requirements.scope import eyes_over, with_scope
from planner_core.scene.doors import exterior_doors, fronts_m, without_door_leaves

#: Of more doors, no more are named.
_MOST_NAMES = 4
#: Before a door, places are searched for within this, within this of the height of its foot, and behind it no farther.
_FRONT_M, _SILL_M, _BEHIND_M = 2.0, 0.6, 0.4


def open_survey(
    scene: Scene,
    settings: PlanSettings,
    *,
    engine: str = "auto",
    device: str | None = None,
    progress: Progress = silent,
) -> tuple[Survey, ScanEngine]:
    """Find floors and patches, and open the engine; `SceneSource.doors_open` of the survey names doors opened here.

    Raises
    ------
    RequirementError, SceneError
        See `planner_core.coverage.survey.make_survey` and `planner_core.requirements.scope.with_scope`.
    DeviceError
        See `planner_core.engine.open_engine.open_engine`.
    """
    survey, scan_engine = _opened(scene, settings, engine, device, progress)
    if scene.source.doors != Doors.OPEN or isinstance(settings.method, Paper) or not exterior_doors(scene):
        return survey, scan_engine
    scoped = with_scope(survey, settings.requirements, scan_engine, progress=progress)
    doors = [scene.elements[door.element] for door in _between_places(scoped, scan_engine)]
    ids = [door.source_id for door in doors if door.source_id and door.source_id not in scene.source.doors_shut]
    if not ids:
        return survey, scan_engine
    opened = (*scene.source.doors_open, *ids)
    scene = without_door_leaves(scene, Doors.OPEN, opened=opened, shut=scene.source.doors_shut)
    scene = replace(scene, source=replace(scene.source, doors_open=opened))
    survey, scan_engine = _opened(scene, settings, engine, device, progress)
    names = [f"{door.name!r} ({door.source_id})" for door in doors if door.source_id in ids]
    more = f" and {len(names) - _MOST_NAMES} more" if len(names) > _MOST_NAMES else ""
    line = (
        f"doors: {len(ids)} exterior {'door is' if len(ids) == 1 else 'doors are'} open, as both sides are planned: "
        f"{', '.join(names[:_MOST_NAMES])}{more}; to keep one shut, use --door-closed with its GlobalId"
    )
    return replace(survey, warnings=(*survey.warnings, line)), scan_engine


def _opened(
    scene: Scene, settings: PlanSettings, engine: str, device: str | None, progress: Progress
) -> tuple[Survey, ScanEngine]:
    survey = make_survey(scene, settings, progress=progress)
    progress(ProgressEvent("engine", 0, 1))
    scan_engine = open_engine(survey.scene, survey.patches, engine=engine, device=device)
    progress(ProgressEvent("engine", 1, 1, f"{scan_engine.name}: {scan_engine.device}"))
    return survey, scan_engine


def _between_places(survey: Survey, engine: ScanEngine) -> tuple[PlacedDoor, ...]:
    """Exterior doors that are shut, though both sides are surveyed as the inside: to loggias and deep porches.

    survey : with its scope. On each side, a place in plain view of the door's front is indoors.
    """
    scope = survey.scope
    is_open = {door.element for door in survey.scene.open_doors}
    if scope is None or scope.kind != Scope.INTERIOR:
        return ()
    shut = [door for door in exterior_doors(survey.scene) if door.element not in is_open]
    return tuple(
        door
        for door in shut
        if all(
            _leads_indoors(scope, engine, at_m, across)
            for at_m, across in zip(fronts_m(door), (-door.across, door.across), strict=True)
        )
    )


def _leads_indoors(scope: SurveyScope, engine: ScanEngine, at_m: FloatArray, across: FloatArray) -> bool:
    """Whether a place near a point (3,) at a door's foot, in its view and not on the door's other side, is indoors."""
    away_m = scope.ground_m - at_m
    near = np.flatnonzero(
        scope.indoors
        & (np.hypot(away_m[:, 0], away_m[:, 1]) <= _FRONT_M)
        & (np.abs(away_m[:, 2]) <= _SILL_M)
        & (away_m[:, :2] @ across > -_BEHIND_M)
    )
    eye_m, to_m = eyes_over(np.tile(at_m, (near.size, 1))), eyes_over(scope.ground_m[near])
    hits = engine.cast_rays(eye_m, to_m - eye_m, range_max_m=np.inf)
    return bool((~(hits.range_m < np.linalg.norm(to_m - eye_m, axis=1))).any())

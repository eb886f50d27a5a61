"""The problem made ready: floors found, patches numbered, the beams of a scan and the way of looking around known.

Input a `Scene` and `PlanSettings`, output a `Survey`; every flow (plan, evaluate, simulate) begins here.
"""

from __future__ import annotations

import numpy as np

from planner_core.coverage.coverage import kept_rows, planned_floors
from planner_core.coverage.observations import GroundSides
from planner_core.engine.patch_mode import PatchMode, scan_mode_of
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import RequirementError
from planner_core.model import (
    Doors,
    FloatArray,
    Paper,
    PlanSettings,
    Scene,
    Survey,
    Visibility,
    VisibilityMode,
)
from planner_core.positions.ground_picks import with_ground_picks
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.scanner.template import make_template
from planner_core.scene.extent import check_extent
from planner_core.scene.floors import find_floors, floor_of_triangles
from planner_core.scene.ground_planes import with_ceilings, with_ground_planes
from planner_core.scene.outdoor_ground import with_outdoor_ground
from planner_core.scene.patches import make_patches


def make_survey(scene: Scene, settings: PlanSettings, *, progress: Progress = silent) -> Survey:
    """Find floors and patches of `scene`; what the site marks as ground, or unmarks, counts.

    Where a storey's elevation is its ground, the survey's scene has that plane as surfaces behind those of `scene`, and
    where a slab is a single sheet, its underside, which is the ceiling of the room below.

    Raises
    ------
    RequirementError
        Floors that are not there, see `planned_floors`; picks that mark no ground, see `with_ground_picks`; stations
        outdoors without an exterior door, see `with_outdoor_ground`; doors that change where none is open.
    SceneError
        A scene in the wrong unit, see `check_extent`.
    """
    check_extent(scene)
    if settings.requirements.doors_change and not scene.open_doors:
        raise RequirementError(
            f"doors change: got {scene.title or 'a scene'} without an open door, expected some (IfcDoor, and --doors "
            "not closed); leave the option out"
        )
    progress(ProgressEvent("survey", 0, 2, "floors"))
    report = with_ground_picks(scene, find_floors(scene), settings.site.ground_picks)
    planned = planned_floors(report.floors, settings.requirements.floors)
    floors, warnings = report.floors, report.warnings
    if scene.source.doors == Doors.OUTSIDE:
        floors, assumed = with_outdoor_ground(scene, floors)
        warnings = (*warnings, *assumed)
    scene, floors = with_ground_planes(scene, floors)
    floor_of_triangle = floor_of_triangles(scene, floors)
    if not isinstance(settings.method, Paper):  # which counts what is seen from either side
        scene, floor_below = with_ceilings(scene, floors, report.open_below)
        floor_of_triangle = np.append(floor_of_triangle, floor_below)
    progress(ProgressEvent("survey", 1, 2, "patches"))
    patches = make_patches(scene, max_area_m2=settings.max_patch_area_m2)
    progress(ProgressEvent("survey", 2, 2))
    template = make_template(settings.scanner)
    return Survey(
        scene=scene,
        floors=floors,
        patches=patches,
        floor_of_triangle=floor_of_triangle,
        template=template,
        scanner=settings.scanner,
        scan_mode=scan_mode_of(settings.scan_mode, template),
        planned=planned,
        reflectivity=settings.requirements.reflectivity,
        warnings=warnings,
        as_in_paper=isinstance(settings.method, Paper),
    )


def visible_from(
    survey: Survey, engine: ScanEngine, positions_m: FloatArray, *, progress: Progress = silent
) -> Visibility:
    """Patches that each of positions (N, 3), local frame, sees: by beams or by samples, by the survey's mode.

    Patches count whole, however little is seen of them.

    Raises
    ------
    RequirementError, DeviceError
        See `ScanEngine.visible_patches` and `PatchMode.visible_patches`.
    """
    only = survey.patches_observed
    if survey.scan_mode == VisibilityMode.BEAMS:
        seen = engine.visible_patches(survey.template, positions_m, progress=progress)
        seen = seen if only is None else kept_rows(seen, only[seen.patch])
    else:
        mode = PatchMode(engine, survey.scene, survey.patches, only=only)
        seen = mode.visible_patches(survey.template, positions_m, progress=progress)
    return kept_rows(seen, GroundSides(survey).counts(np.asarray(positions_m), seen.starts, seen.patch))

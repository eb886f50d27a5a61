"""Opening a plan folder for live editing: its scene loaded again, its settings read back, an engine at the ready.

Input a plan folder; output a `LivePlan`. What candidates can achieve comes from the folder; where an older plan does
not have it, they are found and scanned again.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import PlanFolderError
from planner_core.model import PlanSettings, Survey, UInt8Array, Visibility
from planner_core.plan_folder.plan_json import read_plan_json
from planner_core.plan_folder.plan_settings import ScenePaths, find_scene, load_options_of, settings_of
from planner_core.planning.live.draft import local_place
from planner_core.planning.live.live_plan import LivePlan
from planner_core.positions.admissibility import Tripods
from planner_core.positions.allowed_positions import find_positions
from planner_core.positions.free_space import free_space
from planner_core.positions.local_site import local_site
from planner_core.positions.reach import reachability
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.requirements.demand import Demand, demand_of
from planner_core.requirements.goals import Goals, goals_of
from planner_core.requirements.observe_candidates import SeenPatches
from planner_core.requirements.scope import with_scope
from planner_core.scene.load import load_scene

#: Name of the stage in progress events of this module.
STAGE = "opening"
_N_STEPS = 6
#: plan.json rounds positions to a micrometre.
_SAME_PLACE_M = 1e-5


def open_live(
    plan_folder: Path,
    *,
    scene: ScenePaths = None,
    engine: str = "auto",
    device: str | None = None,
    with_ground: bool = True,
    progress: Progress = silent,
) -> LivePlan:
    """Open a plan folder.

    Parameters
    ----------
    scene
        The scene file or files; None: searched for, see `planner_core.plan_folder.plan_settings.find_scene`.
    engine, device
        See `planner_core.engine.open_engine.open_engine`.
    with_ground
        Test all ground for tripods now; without, that is done when first needed.

    Raises
    ------
    PlanFolderError
        It is no plan folder, its scene is not found, or the scene does not give what the folder holds.
    SceneError, DeviceError, RequirementError
        As the stages raise them.
    """
    document = read_plan_json(plan_folder)
    sha256 = hashlib.sha256((plan_folder / "plan.json").read_bytes()).hexdigest()
    settings = settings_of(document)
    progress(ProgressEvent(STAGE, 0, _N_STEPS, "reading the scene"))
    loaded = load_scene(find_scene(plan_folder, document, scene), options=load_options_of(document), progress=progress)
    survey = make_survey(loaded, settings, progress=progress)
    _check_same(plan_folder, document, survey)
    progress(ProgressEvent(STAGE, 1, _N_STEPS, "preparing the scanner"))
    scan_engine = open_engine(survey.scene, survey.patches, engine=engine, device=device)
    progress(ProgressEvent(STAGE, 2, _N_STEPS, "finding walkable floor"))
    walkable = free_space(survey, progress=progress)
    survey = with_scope(survey, settings.requirements, scan_engine, space=walkable, progress=progress)
    site = local_site(survey, settings.site)
    space = free_space(survey, site.carrier, zones=site.zones, known=walkable, progress=progress)
    reach = reachability(survey, space, site.entrances_m)
    progress(ProgressEvent(STAGE, 3, _N_STEPS, "reading what can be seen"))
    demand = _demand(plan_folder, document, survey, settings, scan_engine, progress)
    survey = demand.with_counted_patches(survey)
    live = LivePlan(document, sha256, survey, settings, scan_engine, demand, reach)
    progress(ProgressEvent(STAGE, 4, _N_STEPS, "computing what the stations see"))
    live.figures(live.draft)
    progress(ProgressEvent(STAGE, 5, _N_STEPS, "finding where tripods can stand"))
    for number, floor in enumerate(survey.floors if with_ground else ()):
        progress(ProgressEvent("ground", number, len(survey.floors), floor.name))
        live.ground(live.draft, floor.id)
    progress(ProgressEvent(STAGE, _N_STEPS, _N_STEPS))
    return live


def _check_same(plan_folder: Path, document: dict[str, Any], survey: Survey) -> None:
    """Refuse a scene that is not cut up as it was: patches of the folder's files would be other ones."""
    expected = (document["settings"]["n_patches"], [floor["id"] for floor in document["floors"]])
    found = (survey.patches.n_patches, [floor.id for floor in survey.floors])
    if expected != found:
        raise PlanFolderError(
            f"{plan_folder}: its scene gives {found[0]} patches and floors {', '.join(found[1])}, expected "
            f"{expected[0]} and {', '.join(expected[1])}; it was planned by another version of tlsplan, plan again"
        )


def _demand(
    plan_folder: Path,
    document: dict[str, Any],
    survey: Survey,
    settings: PlanSettings,
    engine: ScanEngine,
    progress: Progress,
) -> Demand:
    goals = goals_of(survey, settings.requirements)
    n_patches = survey.patches.n_patches
    path = plan_folder / "viewer" / "achievable.u8"
    if path.is_file():
        times_met = _read_bytes(path, (len(goals.qualities), n_patches), "one each quality and patch").astype(np.int32)
        counting = path.with_name("counted.u8")
        countable_share = _read_bytes(counting, (n_patches,), "one each patch") if counting.is_file() else None
    else:
        found = _scanned(document, survey, settings, goals, engine, progress)
        times_met, countable_share = found.times_met, found.countable_share
    none = Visibility(np.zeros(1, dtype=np.int64), np.zeros(0, dtype=np.int32), n_patches)
    return Demand(
        n_patches=n_patches,
        goals=goals,
        rows=SeenPatches(none, none),
        constraints=(),
        area_m2=np.tile(replace(survey.patches, countable_share=countable_share).area_m2, len(goals.qualities)),
        times_met=times_met,
        needed=(),
        countable_share=countable_share,
    )


def _read_bytes(path: Path, shape: tuple[int, ...], what: str) -> UInt8Array:
    """Array of bytes of a file that must have as many as `shape`; `what` names them."""
    content = path.read_bytes()
    if len(content) != math.prod(shape):
        expected = " x ".join(str(n) for n in shape)
        raise PlanFolderError(f"{path}: has {len(content)} bytes, expected {expected}, {what}; plan again")
    return np.frombuffer(content, dtype=np.uint8).reshape(shape)


def _scanned(
    document: dict[str, Any],
    survey: Survey,
    settings: PlanSettings,
    goals: Goals,
    engine: ScanEngine,
    progress: Progress,
) -> Demand:
    """Look from all candidates and the plan's stations, as `planner_core.planning.evaluate` does."""
    tripods, site = Tripods(survey, settings, engine), local_site(survey, settings.site)
    candidates = find_positions(tripods, site, progress=progress).candidates
    stations = [np.array(local_place(row["position"], survey.scene.offset_m)) for row in document["stations"]]
    # Those that are candidates themselves must not count twice.
    others = [at for at in stations if not (np.abs(candidates.position_m - at).max(axis=1) < _SAME_PLACE_M).any()]
    at_m = np.concatenate([candidates.position_m, np.array(others).reshape(-1, 3)])
    return demand_of(survey, goals, engine, at_m, progress=progress)

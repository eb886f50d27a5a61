"""Small plans of small scenes, each made once, and what engine scans say of them apart from the planner."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import scenes_synthetic
from planner_core.engine.open_engine import open_engine
from planner_core.model import BoolArray, FloatArray, Plan, PlanSettings, Proven, Requirements, Scene
from planner_core.planning.plan import make_plan
from planner_core.scanner.load_scanner import load_scanner

SMALL = PlanSettings(
    scanner=replace(load_scanner("hdl-64e"), n_azimuths=360),
    # A scanner that sees neither floor nor ceiling near by: rooms hardly hold its scans upright.
    requirements=Requirements(coverage=0.9, min_strength=0.01),
    grid_step_m=1.0,
    instrument_heights_m=(1.5,),
    max_patch_area_m2=0.4,
    method=Proven(work_limit=0.02),
    refine=False,
)


@cache
def built(name: str) -> Scene:
    return scenes_synthetic.build(name).scene


@cache
def plan_of(name: str, settings: PlanSettings) -> Plan:
    return make_plan(built(name), settings)


@pytest.hookimpl(tryfirst=True)  # before xdist asks for groups
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep tests that share plans on one worker, so that each is made once."""
    for item in items:
        if item.path.parent == Path(__file__).parent and "planned" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.xdist_group("plans"))


@pytest.fixture(scope="session")
def small() -> PlanSettings:
    return SMALL


@pytest.fixture(scope="session")
def planned() -> Callable[[str, PlanSettings], Plan]:
    """Plan a scene by name; plans asked for again are not made again."""
    return plan_of


@dataclass(frozen=True)
class Looks:
    """What positions see, by beams of whole scans. seen : (N, P) bool. The others: (N, P), NaN where unseen.

    spacing_m : sqrt(patch area / returns); range_m, incidence_rad : of the mean range, and the mean cosine.
    """

    seen: BoolArray
    spacing_m: FloatArray
    range_m: FloatArray
    incidence_rad: FloatArray


def looks_from(plan: Plan, positions_m: FloatArray) -> Looks:
    survey = plan.survey
    engine = open_engine(survey.scene, survey.patches)
    n_patches, area_m2 = survey.patches.n_patches, survey.patches.area_m2
    rows: list[tuple[FloatArray, ...]] = []
    for position_m in positions_m:
        scan = engine.scan(survey.template, position_m[None])
        hit = scan.patch[0] >= 0
        patch = scan.patch[0][hit]
        n = np.bincount(patch, minlength=n_patches).astype(float)
        with np.errstate(invalid="ignore", divide="ignore"):
            spacing = np.where(n > 0, np.sqrt(area_m2 / n), np.nan)
            far = np.bincount(patch, scan.range_m[0][hit].astype(float), minlength=n_patches) / n
            cosine = np.bincount(patch, scan.cos_incidence[0][hit].astype(float), minlength=n_patches) / n
        rows.append((n > 0, spacing, far, np.arccos(np.clip(cosine, 0.0, 1.0))))
    return Looks(*(np.array(column) for column in zip(*rows, strict=True)))


@pytest.fixture(scope="session")
def looks() -> Callable[[Plan, FloatArray], Looks]:
    """Scan from positions (N, 3), local frame."""
    return looks_from

"""The plans that most tests read, each planned and written once for all workers.

`house` : the synthetic house, patches sampled, its stations refined and linked.
`house_on_map` : the same house with a position on earth, scanned beam by beam; no links required.
`corridor-comb` : rooms along a corridor, one network that holds as crews set up.
`box` : one room with a position on earth, greedily planned with Open3D: the cheapest plan there is.

Each is a folder with the scene file, and the complete plan folder `plan` beside it, without pictures. Nobody writes
there: a test that changes a folder changes a copy (`copied`).
"""

from __future__ import annotations

import pickle
import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from made_once import MadeOnce

from planner_core.model import Greedy, Plan, PlanSettings, Proven, Requirements
from planner_core.scanner.load_scanner import load_scanner

#: Results that the demo, and the commands after it, keep for each other: there nothing is replaced by a test.
KEPT_IN_A_DAY = "1GB"
_SCANNER = replace(load_scanner("hdl-64e"), n_azimuths=720)
_HOUSE = PlanSettings(
    scanner=_SCANNER,
    requirements=Requirements(coverage=0.8),
    grid_step_m=1.0,
    instrument_heights_m=(1.5,),
    max_patch_area_m2=0.4,
    method=Proven(work_limit=0.02),
    scan_mode="patches",
)
#: What is planned, by name.
SETTINGS = {
    "house": _HOUSE,
    "house_on_map": replace(
        _HOUSE,
        requirements=Requirements(coverage=0.8, network="none"),
        refine=False,
        scan_mode="beams",
    ),
    "corridor-comb": replace(
        _HOUSE,
        scanner=load_scanner("rtc360"),
        requirements=Requirements(coverage=0.9, min_probability=0.995),
        refine=False,
    ),
    "box": replace(
        _HOUSE,
        scanner=replace(_SCANNER, n_azimuths=90),
        requirements=Requirements(coverage=0.5),
        grid_step_m=1.5,
        method=Greedy(),
        refine=False,
        scan_mode="beams",
    ),
}


@dataclass(frozen=True)
class SharedPlan:
    """A plan of `SETTINGS`: as a folder, and as the planner returned it."""

    root: Path
    settings: PlanSettings

    @property
    def scene_file(self) -> Path:
        """The IFC file that was planned."""
        [file] = self.root.glob("*.ifc")
        return file

    @property
    def folder(self) -> Path:
        """The plan folder."""
        return self.root / "plan"

    @cached_property
    def plan(self) -> Plan:
        """The plan with its survey."""
        plan = pickle.loads((self.root / "plan.pickle").read_bytes())
        assert isinstance(plan, Plan)
        return plan

    def copied(self, to: Path) -> SharedPlan:
        """Copy scene and plan folder to a new folder, to change them."""
        shutil.copytree(self.root, to, ignore=shutil.ignore_patterns("*.pickle"))
        (to / "plan.pickle").symlink_to(self.root / "plan.pickle")
        return SharedPlan(to, self.settings)


def shared_plans(made_once: MadeOnce) -> Callable[[str], SharedPlan]:
    """Return what gives a plan of `SETTINGS` by its name."""

    def plan_named(name: str) -> SharedPlan:
        return SharedPlan(made_once(f"plan-{name}", lambda root: _make(name, root)), SETTINGS[name])

    return plan_named


def _make(name: str, root: Path) -> None:
    import scenes_synthetic  # these take a while to import, for tests that plan nothing
    from planner_core.plan_folder.folder import write_plan_folder
    from planner_core.planning.plan import make_plan
    from planner_core.scene.load import load_scene

    kind, *on_map = name.split("_", 1)
    built = scenes_synthetic.build(kind)
    if on_map or kind == "box":
        built = scenes_synthetic.on_map(built)
    scene = load_scene(scenes_synthetic.write(built, root / f"{kind}.ifc"))
    engine = "open3d" if kind == "box" else "auto"
    plan = make_plan(scene, SETTINGS[name], engine=engine)
    write_plan_folder(plan, root / "plan", pictures=False)
    (root / "plan.pickle").write_bytes(pickle.dumps(plan))

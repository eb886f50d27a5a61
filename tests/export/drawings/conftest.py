"""A plan of the synthetic house, small and rough, as a folder: what drawings and models are written from."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner_core.coordinates.request import FrameRequest
from planner_core.model import Greedy, PlanSettings
from planner_core.plan_folder.face_results import face_results
from planner_core.plan_folder.plan_json import plan_text
from planner_core.plan_folder.plan_source import PlanSource, open_plan
from planner_core.plan_folder.usd_stage import write_stage
from planner_core.plan_folder.viewer_files import patches_bytes
from planner_core.planning.plan import make_plan
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.load import load_scene
from scenes_synthetic.house import build
from scenes_synthetic.write import write

#: Munich, in UTM zone 32: eastings of six digits, northings of seven.
MUNICH = FrameRequest(
    crs="EPSG:25832", vertical_crs="EPSG:7837", origin_m=(691_000.25, 5_336_000.5, 515.2), rotation_rad=0.3
)


@pytest.fixture(scope="session")
def house_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(build(), tmp_path_factory.mktemp("house") / "house.ifc")


@pytest.fixture(scope="session")
def house_folder(house_file: Path) -> Path:
    """plan.json and what the viewer loads of the building, beside the scene; no scans, no report."""
    folder = house_file.parent / "plan"
    scanner = replace(load_scanner("hdl-64e"), n_azimuths=360)
    settings = PlanSettings(
        scanner=scanner,
        method=Greedy(),
        grid_step_m=2.0,
        instrument_heights_m=(1.3,),
        max_patch_area_m2=0.25,
    )
    plan = make_plan(load_scene(house_file), settings, engine="open3d")
    folder.mkdir()
    write_stage(plan, face_results(plan, np.full(plan.survey.patches.n_patches, np.inf)), folder)
    (folder / "viewer" / "patches.u8").write_bytes(patches_bytes(plan.times_seen, plan.achievable))
    (folder / "plan.json").write_text(plan_text(plan, folder), encoding="utf-8")
    return folder


@pytest.fixture(scope="session")
def house(house_folder: Path) -> PlanSource:
    """In scene coordinates."""
    return open_plan(house_folder, frame=FrameRequest(scene_coordinates=True))


@pytest.fixture(scope="session")
def house_in_munich(house_folder: Path) -> PlanSource:
    return open_plan(house_folder, frame=MUNICH)


@pytest.fixture(scope="session")
def stations_m(house: PlanSource) -> np.ndarray:
    return np.array([station.position_m for station in house.stations])


@pytest.fixture(scope="session")
def evaluated_house(house: PlanSource) -> PlanSource:
    """A list of given stations, all fixed, of which only the first was scanned before."""
    first, *_ = house.stations
    prior = [{"id": first.id, "role": "scanned"}]
    return replace(
        house,
        document={**house.document, "site": {**house.document["site"], "settled": prior}},
        stations=tuple(replace(station, fixed=True) for station in house.stations),
    )

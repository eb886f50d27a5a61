"""The plan of the synthetic house, in scene coordinates and on the map: what drawings and models are written from."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from shared_plans import SharedPlan

from planner_core.coordinates.request import FrameRequest
from planner_core.plan_folder.plan_source import PlanSource, open_plan

#: Munich, in UTM zone 32: eastings of six digits, northings of seven.
MUNICH = FrameRequest(
    crs="EPSG:25832", vertical_crs="EPSG:7837", origin_m=(691_000.25, 5_336_000.5, 515.2), rotation_rad=0.3
)


@pytest.fixture(scope="session")
def house_file(house_plan: SharedPlan) -> Path:
    return house_plan.scene_file


@pytest.fixture(scope="session")
def house_folder(house_plan: SharedPlan) -> Path:
    return house_plan.folder


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

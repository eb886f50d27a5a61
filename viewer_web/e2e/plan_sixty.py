"""Evaluates 60 stations in the synthetic house, of a scanner with millions of beams: `python plan_sixty.py FOLDER`."""

import sys
from pathlib import Path

import numpy as np

import scenes_synthetic
from planner_core.model import PlanSettings
from planner_core.plan_folder.folder import write_plan_folder
from planner_core.plan_folder.stations_csv import GivenStation
from planner_core.planning.evaluate import evaluate_stations
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.load import load_scene

N_STATIONS = 60
HEIGHT_M = 1.6


def main() -> None:
    """Spread stations over all rooms, evaluate, write."""
    folder = Path(sys.argv[1])
    house = scenes_synthetic.build("house")
    file = scenes_synthetic.write(house, folder.parent / "house.ifc")
    rng = np.random.default_rng(1)
    stations = []
    for number in range(N_STATIONS):
        room = house.rooms[number % len(house.rooms)]
        outline_m = np.array(room.outline_m)
        low_m, high_m = outline_m.min(axis=0), outline_m.max(axis=0)
        x_m, y_m = low_m + (high_m - low_m) * rng.uniform(0.25, 0.75, 2)
        at_m = np.array([x_m, y_m, room.floor_m + HEIGHT_M])
        stations.append(GivenStation(f"S{number + 1:03d}", at_m, HEIGHT_M, None))
    settings = PlanSettings(scanner=load_scanner("rtc360"), grid_step_m=2.0, max_patch_area_m2=0.05)
    write_plan_folder(evaluate_stations(load_scene(file), settings, stations), folder)


if __name__ == "__main__":
    main()

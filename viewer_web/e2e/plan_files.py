"""Plans the synthetic house as two files, walls with doors and windows in one: `python plan_files.py FOLDER`.

The files, `walls.ifc` and `rest.ifc`, are written beside FOLDER.
"""

import sys
from dataclasses import replace
from pathlib import Path

import scenes_synthetic
from planner_core.model import Greedy, PlanSettings, Requirements
from planner_core.plan_folder.folder import write_plan_folder
from planner_core.planning.plan import make_plan
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.load import load_scene

WALLS = ("IfcWall", "IfcDoor", "IfcWindow")


def main() -> None:
    """Split, plan, write."""
    folder = Path(sys.argv[1])
    house = scenes_synthetic.build("house")
    files = []
    for name, has_walls in (("walls", True), ("rest", False)):
        parts = tuple(part for part in house.parts if (part.kind in WALLS) == has_walls)
        scene = replace(house, parts=parts, rooms=house.rooms if has_walls else ())
        files.append(scenes_synthetic.write(scene, folder.parent / f"{name}.ifc"))
    settings = PlanSettings(
        scanner=load_scanner("hdl-64e"),
        requirements=Requirements(coverage=0.6),
        grid_step_m=2.0,
        instrument_heights_m=(1.3,),
        method=Greedy(),
        refine=False,
    )
    write_plan_folder(make_plan(load_scene(files), settings), folder, pictures=False)


if __name__ == "__main__":
    main()

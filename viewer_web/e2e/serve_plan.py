"""Plans the synthetic house, serves it as `tlsplan view` does, and prints addresses and the plan folder.

One a line: the address of those who may do everything, the folder, the address of those who may only comment.

`python serve_plan.py FOLDER [SCENE [PORT [keep]]]` writes the plan to FOLDER, the house beside it, and serves it until
interrupted; a plan that is there is kept. SCENE: the scene file, where a plan was copied away from it; empty: none.
keep: links are kept, in the cache folder of the environment.
"""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np

import scenes_synthetic
from planner_core.model import Greedy, PlanSettings, PreAlignment, Requirements
from planner_core.plan_folder.folder import write_plan_folder
from planner_core.planning import plan
from planner_core.planning.choose import choose_greedily
from planner_core.planning.pool import Choice, Pool
from planner_core.progress import Progress, silent
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.load import load_scene
from tests.small_pictures import begin_without
from viewer_web.server.jobs import runs
from viewer_web.server.serve import serve

# Coarse: the tests look at the viewer, not at how good the plan is.
GRID_STEP_M = 1.0
INSTRUMENT_HEIGHT_M = 1.3
# What the tests click on stays where it is as the planner gets better: 12 stations on the ground floor, 16 above.
STATIONS_M = (
    *((x, y, 1.3) for x, y in ((9, 5), (9, 3), (6, 3), (6, 6), (5, 7), (3, 6.5), (1, 6.5), (3, 5), (3, 2), (1.5, 1))),
    *((4, 1, 1.3), (5, 1, 1.3)),
    *((x, y, 4.1) for x, y in ((9, 5.5), (6, 7), (5.25, 6.25), (4.306, 5.904), (2, 7), (1.906, 4.954), (2, 4))),
    *(
        (x, y, 4.1)
        for x, y in ((3.5, 4), (3.5, 3), (1, 2), (4, 1), (4.5, 1.75), (6, 1), (7, 1), (6, 3), (9.106, 3.254))
    ),
)


def choose_listed(pool: Pool, *, progress: Progress = silent) -> Choice:
    """Take the candidate nearest to each place of STATIONS_M, then what greedy selection adds to them."""
    listed = [int(np.square(pool.candidates.position_m - at).sum(axis=1).argmin()) for at in np.array(STATIONS_M)]
    return choose_greedily(replace(pool, given=tuple(dict.fromkeys(listed))), progress=progress)


def main() -> None:
    """Plan, write, serve."""
    folder = Path(sys.argv[1])
    if not (folder / "plan.json").is_file():
        built = scenes_synthetic.write(scenes_synthetic.build("house"), folder.parent / "house.ifc")
        settings = PlanSettings(
            scanner=load_scanner("hdl-64e"),
            grid_step_m=GRID_STEP_M,
            instrument_heights_m=(INSTRUMENT_HEIGHT_M,),
            requirements=Requirements(pre_alignment=PreAlignment.TRACKED),  # or no network is one
            method=Greedy(),
        )
        plan.choose_greedily = choose_listed
        write_plan_folder(plan.make_plan(load_scene(built), settings), folder, pictures=False)
    # Those of runs take most of their time, and the tests look at none.
    runs.subprocess = SimpleNamespace(Popen=begin_without, DEVNULL=subprocess.DEVNULL)  # type: ignore[assignment]

    def announce(address: str) -> None:
        sys.stdout.write(f"{address}\n{folder}\n")
        sys.stdout.flush()

    def announce_comments(address: str) -> None:
        sys.stdout.write(f"{address}\n")
        sys.stdout.flush()

    scene = Path(sys.argv[2]) if len(sys.argv) > 2 and sys.argv[2] else None
    port = int(sys.argv[3]) if len(sys.argv) > 3 else 0
    serve(
        folder,
        on_ready=announce,
        on_comment_address=announce_comments,
        scene=scene,
        port=port or None,
        keep_links="keep" in sys.argv[4:],
    )


if __name__ == "__main__":
    main()

"""Run `make demo` here and on machines unlike this one, and compare the plans.

    python tests/machines/demo_everywhere.py FOLDER

Where the kernels run, the plan is the same to the byte but for what names the machine. Without OpenCL Open3D casts the
beams: what it sees differs in a few patches, and so may the stations (docs/benchmarks/machines.md). Ends with 1 where
the demo fails somewhere, or a plan is not what it should be.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from planner_core.plan_folder.plan_json import DROPPABLE_KEYS

HERE = Path(__file__).resolve().parent
#: Folders of this one, and whether the kernels run there; "" is the machine at hand.
MACHINES = {"": True, "unknown_processor": True, "no_driver": False}
#: Stations and share of the area by which plans of two engines may differ. Seen: 28 and 29, 95.1 and 95.5 %.
MOST_STATIONS, MOST_AREA = 2, 0.01


def main(folder: Path) -> int:
    """Run all; return the exit code."""
    plans = {name: run(name, folder / (name or "here")) for name in MACHINES}
    if None in plans.values():
        return 1
    first = plans[""]
    wrong = [name for name, plan in plans.items() if not is_right(plan, first, same=MACHINES[name])]
    for name, plan in plans.items():
        print(
            f"{name or 'here':<18} {len(plan['stations'])} stations, {plan['coverage']['covered_area_m2']:.1f} m2"
            f"{', the same plan' if plan['stations'] == first['stations'] else ''}, {plan['device_said']}"
        )
    for name in wrong:
        print(f"{name}: another plan than expected", file=sys.stderr)
    print(f"{len(plans) - len(wrong)} passed, {len(wrong)} failed")
    return 1 if wrong else 0


def run(machine: str, folder: Path) -> dict[str, Any] | None:
    """What `make demo` writes on a machine, without what may differ from run to run; None where it fails."""
    path = {"PYTHONPATH": str(HERE / machine)} if machine else {}
    done = subprocess.run(
        ["make", "--no-print-directory", "demo", f"OUT={folder}"],
        cwd=HERE.parents[1],
        env={**os.environ, **path},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    print("\n".join(line for line in done.stderr.splitlines() if "OpenCL" in line), file=sys.stderr)
    if done.returncode:
        print(f"make demo on {machine or 'this machine'}: exit code {done.returncode}\n{done.stderr}", file=sys.stderr)
        return None
    plan: dict[str, Any] = json.loads((folder / "demo" / "plan.json").read_text(encoding="utf-8"))
    device = plan["device"]
    return {**{key: value for key, value in plan.items() if key not in DROPPABLE_KEYS}, "device_said": device}


def is_right(plan: dict[str, Any], first: dict[str, Any], *, same: bool) -> bool:
    """Whether a plan is the first one, or as near to it as that of another engine has to be."""
    if same:
        return {**plan, "device_said": ""} == {**first, "device_said": ""}
    areas = [each["coverage"]["covered_area_m2"] for each in (plan, first)]
    return (
        abs(len(plan["stations"]) - len(first["stations"])) <= MOST_STATIONS
        and abs(areas[0] - areas[1]) <= MOST_AREA * areas[1]
        and any("no OpenCL device" in line for line in plan["warnings"])
    )


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))

"""`import tlsplan`: a short list of names, quick to import, with words and defaults of the command line."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tlsplan
from tlsplan import api

import scenes_synthetic
from planner_core.model import Role


def test_importing_loads_nothing_until_a_name_is_asked_for() -> None:
    program = (
        "import sys, tlsplan\n"
        "heavy = {'numpy', 'click', 'planner_core', 'tlsplan.api'}\n"
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)\n"
        "assert 'plan' in dir(tlsplan)\n"
        "from tlsplan import options\n"
        "assert 'tlsplan.api' not in sys.modules\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=240, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_the_names_are_those_of_the_api_and_all_are_documented() -> None:
    assert tlsplan.__all__ == api.__all__
    for name in tlsplan.__all__:
        assert getattr(tlsplan, name) is getattr(api, name)
        if callable(getattr(api, name)) and name not in ("Method", "Progress"):
            assert getattr(api, name).__doc__, name
    with pytest.raises(AttributeError, match="no attribute 'solve'"):
        tlsplan.solve  # noqa: B018


def test_settings_are_those_of_a_file_with_what_is_said_in_place_of_it(tmp_path: Path) -> None:
    file = tmp_path / "asked.yaml"
    file.write_text("coverage: 80 %\nspacing: 6 mm\nsite: {forbidden: [{position: [5, 1, 1.6]}]}\n")
    told = tlsplan.settings("rtc360:6mm", requirements=file, coverage=0.9, grid_step_m=1.0, method=tlsplan.Greedy())
    assert (told.scanner.name, told.scanner.mode) == ("rtc360", "6mm")
    assert (told.requirements.coverage, told.requirements.limits.spacing_m) == (0.9, 0.006)
    assert [station.role for station in told.site.prior] == [Role.FORBIDDEN]
    assert (told.grid_step_m, told.method) == (1.0, tlsplan.Greedy())
    assert tlsplan.settings(told.scanner).scanner is told.scanner
    assert tlsplan.settings().method == tlsplan.Proven()
    modes = [tlsplan.settings("hdl-64e", **more).scan_mode for more in ({}, {"scan_mode": "beams"})]
    assert [*modes, tlsplan.settings(method=tlsplan.Paper()).scan_mode] == ["patches", "beams", "auto"]


@pytest.mark.parametrize(
    ("told", "message"),
    [
        ({"coverage": "lots"}, "settings: coverage: got 'lots', expected a share"),
        ({"grid": 1.0}, "got the unknown entry 'grid'"),
        ({"scanner": "rtc"}, "scanner: got 'rtc', expected one of"),
        ({"grid_step_m": -1.0}, "grid_step_m: got -1, expected more than 0"),
        ({"objective": "best"}, "objective: got 'best', expected one of fewest, coverage, time"),
        ({"method": "greedy"}, r"method: got 'greedy', expected one of Greedy\(\), Proven\(\), Paper\(\)"),
    ],
)
def test_settings_that_make_no_sense_are_refused_in_one_line(told: dict[str, Any], message: str) -> None:
    with pytest.raises(tlsplan.PlannerError, match=message) as refused:
        tlsplan.settings(**told)
    assert "\n" not in str(refused.value)


def test_a_plan_is_the_commands_and_tells_its_progress(tmp_path: Path) -> None:
    file = scenes_synthetic.write(scenes_synthetic.build("box"), tmp_path / "box.ifc")
    scene, events = tlsplan.load_scene(str(file)), list[tlsplan.ProgressEvent]()
    assert (scene.source.glass, scene.source.doors) == (tlsplan.Glass.STOP, tlsplan.Doors.OPEN)
    coarse: dict[str, Any] = {"coverage": 0.8, "grid_step_m": 1.5, "max_patch_area_m2": 0.25}
    plan = tlsplan.plan(scene, method=tlsplan.Greedy(), progress=events.append, **coarse)
    assert {"survey", "select"} <= {event.stage for event in events}
    at_m = [station.position_m + scene.offset_m for station in plan.stations]
    again = tlsplan.evaluate(scene, at_m, plan.settings)
    np.testing.assert_array_equal(again.times_seen, plan.times_seen)
    with pytest.raises(TypeError, match="got settings and coverage, too"):
        tlsplan.plan(scene, plan.settings, coverage=0.5)
    with pytest.raises(tlsplan.PlannerError, match=r"station 2: got \(1, 2\), expected three finite numbers"):
        tlsplan.evaluate(scene, [(1, 1, 1), (1, 2)], plan.settings)


def test_a_folder_that_is_no_plan_is_refused(tmp_path: Path) -> None:
    with pytest.raises(tlsplan.PlannerError, match="expected a plan"):
        tlsplan.open_plan(tmp_path)
    with pytest.raises(tlsplan.PlannerError, match="expected a plan"):
        tlsplan.export(str(tmp_path), tmp_path / "pack")

"""Deliverables: figures against docs/method/deliverables.md and against their derivation; what wins over them."""

import math
import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
from click.testing import CliRunner
from tlsplan import inputs
from tlsplan.api import settings
from tlsplan.group import cli
from tlsplan.options import RequirementOptions, problem_options

from planner_core.documents import read_as, to_document
from planner_core.errors import RequirementError
from planner_core.model import Paper, PlanSettings, PointLimits, Requirements, Scope
from planner_core.requirements.deliverables import DELIVERABLES, Deliverable, deliverable_named
from planner_core.requirements.read import read_requirements, requirements_from
from planner_core.scanner.load_scanner import list_scanners, load_scanner

PAGE = Path(__file__).resolve().parents[2] / "docs" / "method" / "deliverables.md"
LIMITS = ("spacing_m", "range_m", "incidence_deg", "noise_m")
LADDERS = [
    ("none", "visual", "survey"),
    ("none", "loa10", "loa20", "loa30", "loa40", "loa50"),
    ("none", "gsa1", "gsa2", "gsa3", "gsa4"),
    ("loa30", "survey", "loa40"),  # 15, 10 and 5 mm
]
#: Millimetres at 95 %: upper ends of USIBD's bands, GSA's tolerances, 0.2 mm at 1:50; GSA's smallest details.
TOLERANCE = {"survey": 10, "loa10": 150, "loa20": 50, "loa30": 15, "loa40": 5, "loa50": 1}
TOLERANCE |= {"gsa1": 51, "gsa2": 13, "gsa3": 6, "gsa4": 3}
DETAIL = {"gsa1": 152, "gsa2": 25, "gsa3": 13, "gsa4": 13}


@pytest.mark.parametrize("names", LADDERS)
def test_a_stricter_deliverable_loosens_no_limit(names: tuple[str, ...]) -> None:
    for loose, strict in pairwise(DELIVERABLES[name] for name in names):
        for limit in LIMITS:
            before, after = getattr(loose, limit), getattr(strict, limit)
            assert before is None or (after is not None and after <= before), (loose.name, strict.name, limit)
        assert strict.overlap >= loose.overlap
        assert any(getattr(loose, limit) != getattr(strict, limit) for limit in LIMITS)


@pytest.mark.parametrize("name", TOLERANCE)
def test_limits_keep_to_what_the_tolerance_leaves_the_scan(name: str) -> None:
    """Half the variance: s = T / 2 / sqrt 2. Rounded to the safe side, and by no more than a half."""
    found, share_mm = DELIVERABLES[name], TOLERANCE[name] / 2 / math.sqrt(2)
    spacing_mm = min(share_mm * math.sqrt(12), DETAIL.get(name, math.inf) / 3)
    assert found.spacing_m is not None
    assert 0.5 * spacing_mm < found.spacing_m * 1000 <= spacing_mm
    if share_mm < 2:
        assert found.noise_m is not None
        assert 0.9 * share_mm < found.noise_m * 1000 <= share_mm
        assert found.incidence_deg == 60
    else:
        assert found.noise_m is None
    accuracy_mm, at_m = [1.9, 2.9, 5.3], [10.0, 20.0, 40.0]
    if share_mm > accuracy_mm[-1] + 0.1:
        assert found.range_m is None
    elif share_mm >= accuracy_mm[0]:
        reached_m = np.interp(share_mm, accuracy_mm, at_m)
        assert found.range_m is not None
        assert 0.95 * reached_m < found.range_m <= reached_m
    else:
        assert found.range_m is not None
        assert 5 <= found.range_m <= 10


def test_the_page_has_the_figures_of_the_code() -> None:
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in PAGE.read_text(encoding="utf-8").partition("No standard states")[0].splitlines()
        if re.match(r"\| `", line)
    ]
    assert [row[0].strip("`") for row in rows] == list(DELIVERABLES)
    for row in rows:
        found = DELIVERABLES[row[0].strip("`")]
        told = [None if cell in ("any", "none") else float(cell) for cell in row[2:]]
        scaled = (found.spacing_m, 1000), (found.range_m, 1), (found.incidence_deg, 1), (found.noise_m, 1000)
        assert told == [
            *(None if value is None else pytest.approx(value * by) for value, by in scaled),
            pytest.approx(found.overlap * 100) if found.overlap else None,
        ]


def test_a_deliverable_fills_what_is_not_said() -> None:
    found, _ = requirements_from({"deliverable": "LOA-40"})
    limits = PointLimits(0.006, 10.0, math.pi / 3, 0.0017)
    assert found == Requirements(limits=limits, overlap=0.40, deliverable="loa40")
    assert requirements_from({"deliverable": "none"})[0] == Requirements() == requirements_from({})[0]


def test_what_is_said_wins_and_any_lifts_a_limit() -> None:
    entries = {"deliverable": "loa40", "spacing": 0.009, "noise": "any", "overlap": "20 %", "coverage": "90 %"}
    found, _ = requirements_from({**entries, "classes": {"IfcWall*": {"range": "4 m", "incidence": "any"}}})
    assert found.limits == PointLimits(0.009, 10.0, math.pi / 3, None)
    assert (found.overlap, found.coverage) == (0.20, 0.90)
    # Parts follow the whole where they say nothing.
    assert found.parts[0].limits == PointLimits(0.009, 4.0, None, None)


@pytest.fixture
def asked_for(tmp_path: Path) -> Path:
    path = tmp_path / "asked.yaml"
    path.write_text("deliverable: survey\nrange: 8 m\n", encoding="utf-8")
    return path


def test_options_win_over_the_file_and_the_file_over_the_deliverable(asked_for: Path) -> None:
    of_file, _ = inputs.requirements_and_site(RequirementOptions(file=asked_for), deliverable="none", scope=Scope.ALL)
    assert (of_file.limits.spacing_m, of_file.limits.range_m, of_file.deliverable) == (0.010, 8.0, "survey")
    found, _ = inputs.requirements_and_site(
        RequirementOptions(file=asked_for, deliverable="loa30", spacing="5 mm"), deliverable="none", scope=Scope.ALL
    )
    assert found.limits == PointLimits(0.005, 8.0, math.radians(75))
    assert found.deliverable == "loa30"


def test_a_default_holds_only_where_none_is_named(asked_for: Path) -> None:
    assert read_requirements(asked_for, deliverable="gsa3")[0].deliverable == "survey"
    assert requirements_from({"range": "8 m"}, deliverable="gsa3")[0].limits.range_m == 8.0
    assert requirements_from({"range": "8 m"}, deliverable="gsa3")[0].limits.spacing_m == 0.004
    assert requirements_from({"deliverable": "none"}, deliverable="gsa3")[0] == Requirements()


@pytest.mark.parametrize(
    ("preset", "deliverable", "scanner"), [(None, "survey", "rtc360"), ("paper", "none", "hdl-64e")]
)
def test_what_nobody_names_is_the_survey_of_a_crew_or_the_robot_of_the_paper(preset, deliverable, scanner) -> None:
    told: dict[str, Any] = {}

    @click.command("plan")
    @problem_options
    def command(**values: Any) -> None:
        told["settings"] = inputs.settings(**values)

    assert CliRunner().invoke(command, ["--preset", preset] if preset else []).exit_code == 0
    found = told["settings"]
    assert (found.requirements.deliverable or "none", found.scanner.name) == (deliverable, scanner)
    of_library = settings(method=Paper()) if preset else settings()
    assert (of_library.requirements, of_library.scanner) == (found.requirements, found.scanner)
    assert found.heights.fixed_m == (() if preset else (1.7,))


@pytest.mark.parametrize("name", ["loa60", "", 3, "survey\nplease", ["survey"], "x" * 999])
def test_an_unknown_name_is_refused_with_the_list(name: object) -> None:
    with pytest.raises(RequirementError) as caught:
        requirements_from({"deliverable": name})
    message = str(caught.value)
    assert "\n" not in message
    assert len(message) < 400
    assert "deliverable" in message
    assert ", ".join(DELIVERABLES) in message


def test_the_command_lists_the_names_and_refuses_others(tmp_path: Path) -> None:
    told = " ".join(CliRunner().invoke(cli, ["plan", "--help"]).output.split())
    assert ", ".join(DELIVERABLES) in told
    refused = CliRunner().invoke(cli, ["plan", str(tmp_path / "house.ifc"), "--deliverable", "loa60"])
    assert refused.exit_code == 2
    assert "loa60" in refused.output
    assert "survey" in refused.output


def test_a_limit_of_noise_needs_a_table_and_the_message_helps() -> None:
    loa40, _ = requirements_from({"deliverable": "loa40"})
    assert all(not scanner.range_noise for scanner in list_scanners())
    with pytest.raises(RequirementError) as caught:
        PlanSettings(load_scanner("rtc360"), loa40)
    assert "of deliverable loa40 with scanner rtc360" in str(caught.value)
    assert "--max-noise any" in str(caught.value)
    without, _ = requirements_from({"deliverable": "loa40", "noise": "any"})
    assert PlanSettings(load_scanner("rtc360"), without).requirements.limits.noise_m is None


@pytest.mark.parametrize("deliverable", DELIVERABLES.values(), ids=lambda each: each.name)
def test_plan_json_holds_the_limits_and_the_name(deliverable: Deliverable) -> None:
    asked, _ = requirements_from({"deliverable": deliverable.name})
    written = to_document(asked)
    assert written["deliverable"] == (None if deliverable.name == "none" else deliverable.name)
    assert written["asked"]["spacing_m"] == deliverable.spacing_m
    assert read_as(Requirements, written, "", remedy="") == asked
    del written["deliverable"]  # plans of before
    assert read_as(Requirements, written, "", remedy="").deliverable is None


def test_names_are_found_however_they_are_spelled() -> None:
    assert deliverable_named(" LOA 30").name == deliverable_named("loa-30").name == "loa30"

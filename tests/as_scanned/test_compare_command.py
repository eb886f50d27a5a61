"""`tlsplan compare` as a user runs it: exit codes, words, JSON, and the plan folder of further stations."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result
from tlsplan.commands.compare import _again, _coverage, _stations, command

from planner_core.errors import OutputExistsError, RequirementError, StationListError
from planner_core.plan_folder.plan_source import PlanSource


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(command, [str(each) for each in arguments])


def without(house_plan: Path, folder: Path, *names: str) -> Path:
    lines = (house_plan / "stations.csv").read_text().splitlines()
    path = folder / "actual.csv"
    path.write_text("\n".join(line for line in lines if line.split(",")[0] not in names))
    return path


@pytest.mark.slow
def test_unchanged_list_ends_with_0_and_says_so(house_plan: Path, source: PlanSource) -> None:
    result = run(house_plan, "--stations", house_plan / "stations.csv", "-q", "--json")
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    assert document["met"]
    assert document["counts"]["as planned"] == len(source.stations)
    assert document["coverage"]["actual"] == document["coverage"]["planned"]


@pytest.mark.parametrize(
    ("off_m", "lines"),
    [
        ([], ["as planned    0"]),
        ([0.0, 0.004], ["as planned    2, within 10 cm of their planned positions"]),
        ([0.0, 0.06], ["as planned    2, within 10 cm of their planned positions", "  at most 0.06 m off: S1"]),
    ],
)
def test_the_limit_of_stations_as_planned_is_printed(off_m: list[float], lines: list[str]) -> None:
    row = {"fate": "as planned", "matched_by": "name", "lost_area_m2": 0.0, "floor": "F0"}
    rows = [{**row, "id": f"S{k}", "listed_as": f"S{k}", "moved_m": [off, 0.0, 0.0]} for k, off in enumerate(off_m)]
    counts = {"scanned before": 0, "not compared": 0, "moved": 0, "missing": 0, "additional": 0}
    document = {"counts": counts, "stations": rows, "list_coordinates": "scene", "as_planned_within_m": 0.1}
    assert _stations(document)[1:-3] == lines


@pytest.mark.slow
def test_without_looking_for_further_stations_there_are_none(
    house_plan: Path, source: PlanSource, tmp_path: Path
) -> None:
    actual = without(house_plan, tmp_path, source.stations[0].id, source.stations[3].id)
    result = run(house_plan, "--stations", actual, "--no-scan-again", "--json")
    assert result.exit_code == 7
    assert json.loads(result.stdout)["scan_again"] is None


@pytest.mark.slow
def test_stations_that_nothing_joins_are_told_part_by_part(
    house_plan: Path, source: PlanSource, tmp_path: Path
) -> None:
    apart = [source.stations_of(floor.id)[0].id for floor in source.floors if source.stations_of(floor.id)]
    listed = {source.stations[1].id, *apart}
    actual = without(house_plan, tmp_path, *({each.id for each in source.stations} - listed))
    words = run(house_plan, "--stations", actual, "--no-scan-again").stdout
    _, _, told = words.partition("unconnected ")
    lines = [line.split() for line in told.splitlines()[1:] if line.startswith("  group ")]
    assert len(lines) > 1
    assert [line[:2] for line in lines] == [["group", str(number)] for number in range(1, len(lines) + 1)]
    assert f" {len(lines)} groups as scanned" in words
    assert sorted(name.strip(",") for line in lines for name in line[2:]) == sorted(listed)


@pytest.mark.slow
def test_one_floor_alone_is_compared_by_its_name(house_plan: Path, source: PlanSource, tmp_path: Path) -> None:
    lower, upper = source.floors
    above = [each.id for each in source.stations_of(upper.id)]
    asked = (house_plan, "--stations", without(house_plan, tmp_path, *above), "--no-scan-again")
    result = run(*asked, "--floor", lower.name.upper())
    assert result.exit_code == 0, result.output
    assert f"list          {len(source.stations_of(lower.id))} stations" in result.stdout
    assert f"not compared  {len(above)} on other floors, taken as planned" in result.stdout
    assert "missing       0" in result.stdout
    assert run(*asked).exit_code == 7
    result = run(*asked, "--floor", "Attic")
    assert isinstance(result.exception, RequirementError)
    assert f"got 'Attic', expected one of {lower.id} ({lower.name})" in str(result.exception)


def test_bad_input_is_refused_before_anything_is_loaded(house_plan: Path, tmp_path: Path) -> None:
    (tmp_path / "far.csv").write_text("id,x,y,z\nA,500000,0,1\n")
    result = run(house_plan, "--stations", tmp_path / "far.csv")
    assert isinstance(result.exception, StationListError)
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "mine.txt").write_text("mine")
    result = run(house_plan, "--stations", house_plan / "stations.csv", "-o", tmp_path / "taken")
    assert isinstance(result.exception, OutputExistsError)


@pytest.mark.slow
def test_a_list_of_ground_points_is_refused_unless_it_is_told(
    house_plan: Path, source: PlanSource, tmp_path: Path
) -> None:
    rows = [f"{each.id},{','.join(f'{v:.4f}' for v in each.site_ground_m)}" for each in source.stations]
    (tmp_path / "ground.csv").write_text("\n".join(rows))
    asked = (house_plan, "--stations", tmp_path / "ground.csv", "--columns", "PENZ", "--no-scan-again", "--json")
    result = run(*asked)
    assert isinstance(result.exception, StationListError)
    assert "give --heights ground" in str(result.exception)
    result = run(*asked, "--heights", "ground")
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["counts"]["as planned"] == len(source.stations)


@pytest.mark.slow
def test_swapped_columns_are_the_first_warning(house_plan: Path, source: PlanSource, tmp_path: Path) -> None:
    rows = [f"{each.id},{','.join(f'{v:.4f}' for v in each.position_m)}" for each in source.stations]
    (tmp_path / "swapped.csv").write_text("\n".join(rows))
    result = run(house_plan, "--stations", tmp_path / "swapped.csv", "--columns", "PNEZ", "--no-scan-again", "-q")
    warnings = [line for line in result.stderr.splitlines() if line.startswith("warning:")]
    assert warnings[0].startswith("warning: x and y of the list may be swapped")


def rescan_document(*, network_met: bool, lost: bool) -> dict[str, Any]:
    """Of a plan in two parts, one of which lost coverage; a second station to scan again joins them."""
    stations = [
        {"id": name, "floor": "F0", "position": [1.0, 2.0, 3.0], "instrument_height_m": 1.5, "is_planned": False,
         "for_what_was_lost": name == "S8", "adds": adds, "joins": joins}
        for name, adds, joins in (
            ("S8", [{"floor": "F0", "area_m2": 21.04}, {"floor": "F1", "area_m2": 0.01}], []),
            ("S9", [], [["S1", "S2"], ["S3"]]),
        )
    ]  # fmt: skip
    requirement = {"name": "overall", "met": not lost, "planned_is_met": True, "asked_is_met": not lost}
    return {
        "met": not lost,
        "requirements": [requirement],
        "network": {
            "planned_parts": 2, "actual_parts": 2, "met": True, "planned_is_met": False, "asked_is_met": False,
        },
        "scan_again": {
            "met": True, "fewest_is_proven": True, "coverage": 0.96, "network_parts": 1 if network_met else 2,
            "stations": stations,
            "network": {"met": True, "asked_is_met": network_met},
            "requirements": [{"name": "overall", "met": True, "asked_is_met": True}],
        } if lost else None,
    }  # fmt: skip


def test_coverage_that_only_setting_up_costs_is_met_and_named(source: PlanSource) -> None:
    document = rescan_document(network_met=True, lost=False)
    document["network"] |= {"planned_is_met": True, "asked_is_met": True}
    (row,) = document["requirements"]
    row |= {"asked": 0.95, "planned": 0.952, "actual": 0.9497}
    assert _again(document, source) == ["The requirements are still met: nothing has to be scanned again."]
    row["asked_is_met"] = False
    assert _coverage(document)[0].endswith(
        "95.2 % planned, just below 95 % as scanned   within half a point, as set up"
    )
    (line,) = _again(document, source)
    assert line == "The requirements are still met within half a point: nothing has to be scanned again."
    row["planned_is_met"] = False
    assert _coverage(document)[0].endswith("not met, as in the plan")
    assert _again(document, source)[1] == "NOT met, as in the plan: coverage overall."


def test_every_station_to_scan_again_tells_what_it_is_for(source: PlanSource) -> None:
    lines = _again(rescan_document(network_met=True, lost=True), source)
    assert lines[2].strip() == "adds 21.0 m2 on floor F0 to the scans"
    assert lines[4].strip() == "connects S1 and 1 more with S3"
    assert lines[5].split(maxsplit=1)[1] == "S8 makes up for what was lost; for the rest of the requirements: S9"
    assert lines[6].endswith("1 group: all requirements are met")


def test_what_is_still_not_met_is_told_and_not_that_all_is(source: PlanSource) -> None:
    *_, last = _again(rescan_document(network_met=False, lost=True), source)
    assert last.endswith("as good as the plan again; NOT met, as in the plan: the network (2 groups)")
    lines = _again(rescan_document(network_met=False, lost=False), source)
    assert lines[0] == "All that the plan met is still met: nothing has to be scanned again."
    assert lines[1] == "NOT met, as in the plan: the network (2 groups)."
    document = rescan_document(network_met=False, lost=True)
    document["scan_again"].update(met=False, requirements=[{"name": "overall", "met": False, "asked_is_met": False}])
    assert _again(document, source)[-1].endswith("still NOT met: coverage overall")
    document["scan_again"] = None
    assert _again(document, source) == ["Requirements NOT met: coverage overall."]


def test_exchanged_names_cost_nothing_and_lose_no_links(house_plan: Path, source: PlanSource, tmp_path: Path) -> None:
    ids = [each.id for each in source.stations]
    rows = [
        f"{name},{','.join(f'{v:.4f}' for v in each.position_m)}"
        for name, each in zip([*ids[3:], *ids[:3]], source.stations, strict=True)
    ]
    (tmp_path / "shuffled.csv").write_text("\n".join(["id,x,y,z", *rows]))
    result = run(house_plan, "--stations", tmp_path / "shuffled.csv", "--no-scan-again")
    assert result.exit_code == 0, result.output
    warnings = [line for line in result.stderr.splitlines() if line.startswith("warning: ")]
    assert [line for line in warnings if f"all {len(ids)} planned positions were scanned, only names differ" in line]
    assert not [line for line in warnings if "from its planned position" in line]
    assert f"\n  listed under other names: {ids[0]} as {ids[3]}, " in result.stdout
    assert f"as planned    {len(ids)}, " in result.stdout
    assert "moved         0" in result.stdout
    assert "links lost" not in result.stdout
    assert "costs" not in result.stdout


@pytest.mark.slow
def test_a_shift_of_a_site_list_is_told_in_site_axes(house_plan: Path, source: PlanSource, tmp_path: Path) -> None:
    shift = (5.0, 3.0, 0.0)
    rows = [f"{each.id},{','.join(f'{v:.4f}' for v in each.site_m + shift)}" for each in source.stations]
    (tmp_path / "shifted.csv").write_text("\n".join(rows))
    result = run(house_plan, "--stations", tmp_path / "shifted.csv", "--columns", "PENZ", "--no-scan-again")
    warnings = [line for line in result.stderr.splitlines() if line.startswith("warning: ")]
    assert "all stations are off by the same E +5.00, N +3.00, H +0.00 m: check the list's origin" in warnings[0]
    assert not [line for line in warnings if "from its planned position" in line]


@pytest.mark.parametrize("option", ["--coordinates", "--heights", "--match"])
def test_words_that_no_option_has_are_refused(house_plan: Path, option: str) -> None:
    assert run(house_plan, "--stations", "x.csv", option, "nonsense").exit_code == 2

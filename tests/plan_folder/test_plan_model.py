"""plan.json as one model: plans of the first version are opened, what is not as it is written is refused."""

import json
from pathlib import Path

import pytest
from oldest_plan import oldest_plan

from planner_core.model import Greedy, PointLimits, Site
from planner_core.plan_folder.plan_json import plan_text, read_plan, read_plan_json
from planner_core.plan_folder.plan_settings import load_options_of, settings_of
from planner_core.plan_folder.plan_source import open_plan
from planner_core.plan_folder.stations_csv import read_station_list
from planner_core.review.stations import plan_under_review


@pytest.fixture
def old_folder(tmp_path: Path) -> Path:
    (tmp_path / "plan.json").write_text(json.dumps(oldest_plan()))
    return tmp_path


def test_plan_of_the_first_version_is_read_with_what_it_did_not_say(old_folder: Path) -> None:
    plan = read_plan(old_folder)
    assert plan.requirements.results == ()
    assert plan.scene.georeference is None
    assert plan.stations[0].losses is None
    assert plan.registration.networks == ()
    assert (plan.route, plan.why, plan.source) == (None, None, None)


def test_plan_of_the_first_version_has_all_keys_of_this_one_once_it_is_read(old_folder: Path, plan) -> None:
    old, new = read_plan_json(old_folder), json.loads(plan_text(plan))
    assert list(old) == list(new)
    for key in ("scene", "scanner", "requirements", "settings", "site", "optimality"):
        assert list(old[key]) == list(new[key]), key
    assert list(old["stations"][0]) == list(new["stations"][0])
    assert list(old["floors"][0]) == list(new["floors"][0])


def test_plan_of_the_first_version_can_be_planned_again_as_it_was_made(old_folder: Path) -> None:
    document = read_plan_json(old_folder)
    settings = settings_of(document)
    assert (settings.objective, settings.scan_mode, settings.method) == ("fewest", "beams", Greedy())
    assert (settings.special_places, settings.refine) == (False, False)  # there was neither
    assert settings.site == Site()
    assert settings.requirements.limits == PointLimits()
    assert settings.requirements.network == "none"
    assert (settings.requirements.min_strength, settings.requirements.min_probability) == (0.0, 0.0)
    assert settings.set_up_tolerance_m == 0.0
    assert settings.scanner.azimuth_range_rad is None
    (options,) = load_options_of(document)
    assert (options.glass, options.doors) == ("return", "shut")


def test_plan_of_the_first_version_is_exported_reviewed_and_listed(old_folder: Path) -> None:
    source = open_plan(old_folder)
    assert [station.id for station in source.stations] == ["S001", "S002"]
    assert source.counts(source.links[0])
    assert plan_under_review(old_folder).n_elements == 5
    assert [station.floor for station in read_station_list(old_folder / "plan.json")] == ["F0", "F1"]


def test_keys_of_newer_versions_are_ignored(tmp_path: Path) -> None:
    (tmp_path / "plan.json").write_text(json.dumps(oldest_plan(weather={"rain": True})))
    assert "weather" not in read_plan_json(tmp_path)

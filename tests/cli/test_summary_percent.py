"""Shares in the summary of a plan: none that falls short reads as what was asked for."""

from typing import Any

import pytest
from tlsplan import summary

USUAL = {"overlap_measure": "smaller-share", "overlap_of": "all-seen"}


def document(reached: float) -> dict[str, Any]:
    figures = {"fraction_of_achievable": reached, "achievable_area_m2": 10.0}
    return {
        "registration": {"threshold": 0.3, "min_strength": 0.0, "connected": True, "links": [], "networks": []},
        "scanner": {"title": "T", "range_max_m": 5.0, "n_azimuths": 10, "n_channels": 10},
        "settings": {"scan_mode": "beams"},
        "stations": [],
        "optimality": {"objective": "stations", "lower_bound": None, "stations": 0},
        "coverage": {
            **figures, "fraction_of_total": 0.1, "total_area_m2": 100.0, "floors": [{"floor": "F0", **figures}],
        },
        "floors": [{"id": "F0", "name": "Ground"}],
        "scope": {"kind": "all", "obstacles": [], "left_out": []},
        "scene": {"glass_area_m2": 0.0, "mirror_area_m2": 0.0, "glass": "stop", "doors": "open", "n_doors_open": 0},
        "requirements": {
            **USUAL,
            "coverage": 0.95,
            "floors": [],
            "results": [{"name": "overall", "met": reached >= 0.95, "required": 0.95, **figures}],
        },
        "route": None,
        "field_time": None,
        "sealed": [],
    }  # fmt: skip


@pytest.mark.parametrize(("reached", "shown"), [(0.94996, "just below 95 %"), (0.95, "95.0 %"), (0.9516, "95.2 %")])
def test_coverage_reads_as_what_was_asked_only_where_it_is(
    reached: float, shown: str, capsys: pytest.CaptureFixture[str]
) -> None:
    summary.show(document(reached))
    said = capsys.readouterr().out
    assert said.count(shown) == (3 if reached < 0.95 else 2)  # overall and the floor; and once more as not met
    assert ("NOT MET" in said) == (reached < 0.95)
    assert "95.0 %" not in said.replace(shown, "")


def test_coverage_of_a_floor_reads_as_what_was_asked_of_it_alone(capsys: pytest.CaptureFixture[str]) -> None:
    told = document(0.84996)
    told["requirements"]["results"].insert(
        0, {"name": "F0", "met": False, "required": 0.85, **document(0.84996)["coverage"]}
    )
    summary.show(told)
    assert " 0 stations  just below 85 % of 10 m2\n" in capsys.readouterr().out


def test_a_floor_without_anything_scannable_has_no_percentage(capsys: pytest.CaptureFixture[str]) -> None:
    told = document(0.96)
    told["coverage"]["floors"][0] |= {"fraction_of_achievable": 1.0, "achievable_area_m2": 0.0}
    summary.show(told)
    assert "  F0   Ground                   0 stations  nothing scannable\n" in capsys.readouterr().out


def test_rooms_that_nobody_enters_and_surface_that_no_position_sees_stand_beside_the_coverage_in_red(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    told = document(0.96)
    told["sealed"] = [{"area_m2": 20.2}, {"area_m2": 19.8}]
    told["scope"] |= {"kind": "interior", "in_scope_area_m2": 448.0, "out_of_scope_area_m2": 9.0}
    told["coverage"] |= {"achievable_area_m2": 268.0, "total_area_m2": 448.0}
    summary.show(told)
    lines = capsys.readouterr().out.splitlines()
    at = next(number for number, line in enumerate(lines) if line.startswith("coverage"))
    assert [line.strip() for line in lines[at + 2 : at + 4]] == [
        "Not planned: 40 m2 of floor that can't be reached on foot, in 2 areas",
        "Not scannable: 180 m2 of 448 m2 in scope, from no valid tripod position",
    ]


@pytest.mark.parametrize(
    ("scene", "line"),
    [
        ({"n_doors_open": 1}, "1 door is open (--doors closed leaves them as modelled)"),
        ({"doors": "all", "n_doors_open": 14}, "14 doors are open (--doors closed leaves them as modelled)"),
        (
            {"doors": "outside", "n_doors_open": 14},
            "14 doors are open, exterior ones too, for stations outdoors "
            "(--join inside, the default, keeps exterior doors closed)",
        ),
    ],
)
def test_open_doors_stand_beside_the_option_that_closes_them(
    scene: dict[str, Any], line: str, capsys: pytest.CaptureFixture[str]
) -> None:
    told = document(0.96)
    told["scene"] |= scene
    summary.show(told)
    assert f"doors         {line}\n" in capsys.readouterr().out

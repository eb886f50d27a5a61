"""Planning again from nothing but a folder's plan.json and the scene file gives the same plan.json, byte for byte."""

import json
from dataclasses import replace
from math import pi
from pathlib import Path

import pytest

import scenes_synthetic
from planner_core.model import (
    Greedy,
    GroundPick,
    KeepOut,
    Paper,
    PartRequirement,
    PlanSettings,
    PointLimits,
    PriorStation,
    Requirements,
    Site,
)
from planner_core.model.spatial_search import SearchSettings
from planner_core.plan_folder.plan_json import DROPPABLE_KEYS, plan_text, read_plan_json
from planner_core.plan_folder.plan_settings import find_scene, load_options_of, settings_of
from planner_core.planning.plan import make_plan
from planner_core.scene.load import LoadOptions, load_scene

THIRD = 1 / 3


def asked_of_parts(small: PlanSettings) -> PlanSettings:
    """Limits and areas that no few digits hold."""
    upper = PartRequirement(
        "upper", 0.9 - THIRD / 10, PointLimits(range_m=20 * THIRD), floors=("F1",), heights_m=(THIRD, 9.0)
    )
    zone = ((0.1 + 0.2, THIRD), (4 + THIRD, THIRD), (4 + THIRD, 4.0), (THIRD, 4.0))
    corner = PartRequirement("corner", 0.5, PointLimits(incidence_rad=65 * pi / 180), zone=zone)
    scanner = replace(
        small.scanner,
        elevation_rad=tuple(e * (1 + THIRD / 100) for e in small.scanner.elevation_rad),
        range_noise=((0.3, 0.05, 0.001 * THIRD), (60.0, 0.05, 0.01), (0.3, 1.0, 0.0005), (60.0, 1.0, 0.007 * THIRD)),
    )
    requirements = Requirements(
        coverage=0.8 + THIRD / 100,
        limits=PointLimits(noise_m=0.02 * THIRD),
        reflectivity=0.7,
        parts=(upper, corner),
        network="none",
    )
    return replace(
        small,
        scanner=scanner,
        requirements=requirements,
        max_patch_area_m2=0.4 * THIRD * 2,
        method=Greedy(),
    )


def with_a_site(small: PlanSettings) -> PlanSettings:
    site = Site(
        keep_out=(KeepOut(((THIRD, THIRD), (1.0, THIRD), (1.0, 1.0), (THIRD, 1.0)), "F0", name="stack"),),
        prior=(
            PriorStation("S009", (2 + THIRD / 1000, 2.0, 1.5), "locked", "F0"),
            PriorStation("", (3.0, 3.0 + THIRD, 0.0), "forbidden", radius_m=THIRD),
        ),
        carrier_radius_m=0.7 * THIRD,
        returns=True,
        ground_picks=(GroundPick((1 + THIRD, 1 + THIRD, 0.0), floor="F0"),),
    )
    return replace(
        small,
        site=site,
        objective="time",
        seconds_per_scan=90 * THIRD,
        clearance_m=THIRD,
        seed=7,
        walking_m_per_s=0.9 + THIRD,
    )


def by_the_paper(small: PlanSettings) -> PlanSettings:
    paper = Paper(spatial=SearchSettings(max_iterations=3, step_m=0.2))
    return replace(small, method=paper, instrument_heights_m=(1.0, 1.5 + THIRD / 10), seed=3)


@pytest.mark.parametrize(
    ("scene", "change", "options"),
    [
        pytest.param("house", asked_of_parts, LoadOptions(), marks=pytest.mark.slow),
        ("two-rooms", with_a_site, LoadOptions(metres_per_unit=1 + THIRD / 10)),
        pytest.param("two-rooms", by_the_paper, LoadOptions(up_axis="Z", doors="all"), marks=pytest.mark.slow),
    ],
)
def test_plan_made_again_from_its_plan_json_is_the_same(
    small: PlanSettings, tmp_path: Path, scene: str, change: object, options: LoadOptions
) -> None:
    assert callable(change)
    told, folder = change(small), tmp_path / "plan"
    file = tmp_path / f"{scene}.obj"
    scenes_synthetic.write(scenes_synthetic.build(scene), file)
    folder.mkdir()
    first = plan_text(make_plan(load_scene(file, options=options), told), folder)
    (folder / "plan.json").write_text(first, encoding="utf-8")
    document = read_plan_json(folder)
    assert settings_of(document) == replace(told, scan_mode="beams")
    again = load_scene(find_scene(folder, document), options=load_options_of(document))
    second = json.loads(plan_text(make_plan(again, settings_of(document)), folder))
    for key in DROPPABLE_KEYS:
        del document[key], second[key]
    assert len(document["stations"]) > 0
    assert json.dumps(second, indent=2) == json.dumps(document, indent=2)

"""Real buildings: patch mode sees what the beams see, and Open3D the same samples."""

from collections.abc import Callable

import numpy as np
import pytest
from stages import find_candidates

from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.engine.patch_mode import PatchMode
from planner_core.model import BeamTemplate, PlanSettings, Scene
from planner_core.scanner.load_scanner import load_scanner


@pytest.mark.opencl
@pytest.mark.slow
@pytest.mark.parametrize("name", [pytest.param("duplex", marks=pytest.mark.campaign), "fzk-haus"])
def test_patch_mode_agrees_with_beams_and_with_open3d_in_a_building(
    name: str, real_scene: Callable[[str], Scene]
) -> None:
    scene = real_scene(name)
    settings = PlanSettings(scanner=load_scanner("hdl-64e"), grid_step_m=2.0, instrument_heights_m=(1.7,))
    survey = make_survey(scene, settings)
    ours, oracle = (open_engine(scene, survey.patches, engine=engine) for engine in ("opencl", "open3d"))
    found = find_candidates(survey, settings, ours, floors=tuple(range(len(survey.floors)))).position_m
    stations = found[np.linspace(0, len(found) - 1, 2).astype(int)]
    step = np.deg2rad(0.1)
    template = BeamTemplate(
        azimuth_rad=np.arange(3600) * step,
        elevation_rad=np.deg2rad(np.linspace(90, -60, 1501)),
        range_min_m=0.5,
        range_max_m=50.0,
    )
    area = survey.patches.area_m2
    by_samples = PatchMode(ours, scene, survey.patches).visible_patches(template, stations)
    by_beams = ours.visible_patches(template, stations)
    by_oracle = PatchMode(oracle, scene, survey.patches).visible_patches(template, stations[:1])
    apart = either = 0.0
    for row in range(len(stations)):
        apart += area[np.setxor1d(by_samples.row(row), by_beams.row(row))].sum()
        either += area[np.union1d(by_samples.row(row), by_beams.row(row))].sum()
    # docs/benchmarks/patch-mode.md: what remains are slivers, chance at the beams' spacing, two surfaces in one place.
    assert apart < 0.01 * len(stations) * area.sum(), f"{apart} m2 of {len(stations) * area.sum()}"
    assert apart < 0.03 * either, f"{apart} m2 of {either}"
    # Both engines: but for patches seen edge-on, and those at the very number of returns that is asked for.
    assert area[np.setxor1d(by_samples.row(0), by_oracle.row(0))].sum() < 1e-3 * area[by_oracle.row(0)].sum()

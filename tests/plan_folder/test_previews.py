"""Previews of clouds in the plan folder: few beams, whatever the scanner."""

from pathlib import Path

import numpy as np
import pytest

from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import Plan
from planner_core.plan_folder.usd_stage import cloud_layer, write_layer
from planner_core.plan_folder.viewer_layers import packed_cloud
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scanner.template import make_template, preview_template


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hdl-64e", "pandar64", "blk360-g2:dense-plus", "rtc360:high", "vz-400i", "p50", "x7"])
def test_previews_of_a_station_stay_below_a_megabyte_and_a_half(
    plan: Plan, engine: ScanEngine, tmp_path: Path, name: str
) -> None:
    template = preview_template(make_template(load_scanner(name)))
    scan = engine.scan(template, plan.stations[0].position_m[None])
    write_layer(cloud_layer(scan.range_m[0], template), tmp_path / "cloud.usdc")
    (tmp_path / "cloud.cloud").write_bytes(packed_cloud(scan.range_m[0], scan.cos_incidence[0], template))
    sizes = {path.name: path.stat().st_size for path in tmp_path.iterdir()}
    assert np.isfinite(scan.range_m).mean() > 0.3
    assert sum(sizes.values()) < 1.5e6, sizes

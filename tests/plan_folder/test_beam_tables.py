"""What files say of sectors, offsets and inverted mounting: points rebuilt from them are the scan's."""

from dataclasses import replace

import numpy as np
import pytest
from oracles import read_cloud

from planner_core.engine.scan_engine import ScanEngine
from planner_core.export.clouds.file_header import numbers
from planner_core.model import FloatArray, Plan
from planner_core.plan_folder.plan_json import plan_document
from planner_core.plan_folder.sdf_authoring import new_layer
from planner_core.plan_folder.usd_stations import author_stations
from planner_core.plan_folder.viewer_layers import packed_cloud
from planner_core.scanner.template import azimuth_step_rad, directions, first_azimuths_rad, make_template


@pytest.fixture(scope="module", params=[False, True], ids=["upright", "inverted"])
def odd_plan(plan: Plan, request: pytest.FixtureRequest) -> Plan:
    """A sector of 100 degrees with a channel's offset each."""
    scanner = replace(
        plan.settings.scanner,
        n_azimuths=60,
        azimuth_range_rad=(-0.4, 1.3),
        azimuth_offset_rad=tuple(np.deg2rad(np.arange(40) % 5 - 2.0)),
        inverted=request.param,
    )
    survey = replace(plan.survey, template=make_template(scanner), scanner=scanner)
    return replace(plan, survey=survey, settings=replace(plan.settings, scanner=scanner))


def rebuilt(range_m: FloatArray, elevation: FloatArray, azimuth: FloatArray, step: float) -> FloatArray:
    """Points relative to the sensor by the formula of docs/formats, from what a file says alone."""
    e, a = elevation[:, None], azimuth[:, None] + step * np.arange(range_m.shape[1])
    return range_m[..., None] * np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e) + 0 * a], axis=-1)


def test_points_rebuilt_from_the_figures_of_an_exr_are_the_scans(odd_plan: Plan, engine: ScanEngine) -> None:
    station, template = odd_plan.stations[0], odd_plan.survey.template
    scan = engine.scan(template, station.position_m[None])
    header = numbers(template.elevation_rad, 9), numbers(first_azimuths_rad(template), 9)
    elevation, azimuth = (np.array(text.split(), dtype=np.float64) for text in header)
    found = rebuilt(scan.range_m[0], elevation, azimuth, azimuth_step_rad(template))
    np.testing.assert_allclose(found, directions(template) * scan.range_m[0][..., None], atol=1e-6)


def test_points_rebuilt_from_the_stage_and_a_cloud_are_the_scans(odd_plan: Plan, engine: ScanEngine) -> None:
    station, template = odd_plan.stations[0], odd_plan.survey.template
    layer = new_layer()
    author_stations(layer, odd_plan, flat=True)
    prim = layer.GetPrimAtPath("/Plan/Stations/S001")
    said = {
        key: np.array(prim.attributes[f"tlsplan:{key}"].default, dtype=np.float64)
        for key in ("elevations", "azimuths", "azimuthStep")
    }
    scan = engine.scan(template, station.position_m[None])
    range_m, _ = read_cloud(packed_cloud(scan.range_m[0], scan.cos_incidence[0], template), template)
    truth = directions(template) * scan.range_m[0][..., None]
    found = rebuilt(range_m, said["elevations"], said["azimuths"], float(said["azimuthStep"]))
    # Half a step of the range, and float32 angles.
    np.testing.assert_allclose(found, truth, atol=0.5 * template.range_max_m / 65535 + 1e-5)


def test_rows_of_any_scan_go_from_the_highest_down_and_columns_counter_clockwise(odd_plan: Plan) -> None:
    beams = directions(odd_plan.survey.template)
    assert (np.diff(beams[:, 0, 2]) < 0).all()
    turn = np.cross(beams[:, :-1], beams[:, 1:])[..., 2]
    assert (turn > 0).all()


def test_plan_json_tells_the_scanner_in_full(odd_plan: Plan) -> None:
    scanner = plan_document(odd_plan)["scanner"]
    assert scanner["azimuth_range_rad"] == [-0.4, 1.3]
    assert scanner["azimuth_offset_rad"] == pytest.approx(odd_plan.settings.scanner.azimuth_offset_rad, abs=1e-9)
    assert scanner["inverted"] == odd_plan.settings.scanner.inverted

"""Lists from a total station in feet: by the header, the coordinate system, the option; metres divided by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner_core.as_scanned.station_lists import read_actual
from planner_core.errors import StationListError
from planner_core.export.csv_profiles import write_csv
from planner_core.export.options import Options
from planner_core.model import FOOT, METRE, US_SURVEY_FOOT, LengthUnit
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.plan_folder.stations_csv import stations_of_text
from planner_core.progress import silent

FOOT_US_M = 1200 / 3937


def in_unit(source: PlanSource, unit: LengthUnit) -> PlanSource:
    return replace(source, frame=replace(source.frame, unit=unit, crs_unit=unit))


def listed(path: Path, source: PlanSource, header: str, foot_m: float, *, scene: bool = False) -> Path:
    places = [(each.id, each.position_m if scene else each.site_m) for each in source.stations]
    lines = [f"{name},{','.join(f'{value / foot_m:.6f}' for value in at_m.tolist())}" for name, at_m in places]
    path.write_text("\n".join([header, *lines]) + "\n")
    return path


@pytest.mark.parametrize(
    ("header", "foot_m", "unit"),
    [
        ("name,easting,northing,elevation", FOOT_US_M, US_SURVEY_FOOT),
        ("name,easting,northing,elevation", 0.3048, FOOT),
        ("name,E_ftUS,N_ftUS,z_ftUS", FOOT_US_M, METRE),
        ("name,E [ft],N [ft],Z [ft]", 0.3048, US_SURVEY_FOOT),
        ("name,easting_m,northing_m,elevation_m", 1.0, US_SURVEY_FOOT),
    ],
)
def test_a_list_in_feet_is_at_the_plan(
    source: PlanSource, tmp_path: Path, header: str, foot_m: float, unit: LengthUnit
) -> None:
    header = (
        header.replace("E_", "easting_")
        .replace("N_", "northing_")
        .replace("E [", "Easting [")
        .replace("N [", "Northing [")
    )
    actual = read_actual([listed(tmp_path / "list.csv", source, header, foot_m)], in_unit(source, unit))
    assert actual.coordinates == "site"
    for found, planned in zip(actual.stations, source.stations, strict=True):
        np.testing.assert_allclose(found.position_m, planned.position_m, rtol=0, atol=2e-6)


def test_scene_coordinates_of_a_plan_in_feet_stay_metres(source: PlanSource, tmp_path: Path) -> None:
    path = listed(tmp_path / "list.csv", source, "name,x,y,z", 1.0, scene=True)
    actual = read_actual([path], in_unit(source, US_SURVEY_FOOT))
    assert actual.coordinates == "scene"
    np.testing.assert_allclose(actual.stations[0].position_m, source.stations[0].position_m, rtol=0, atol=2e-6)


def test_what_was_exported_in_feet_is_read_back(source: PlanSource, tmp_path: Path) -> None:
    plan = in_unit(source, US_SURVEY_FOOT)
    write_csv(plan, tmp_path / "feet.csv", Options(columns="generic", decimals=6), silent)
    for reader in (plan, source):  # the header says its unit, whatever is expected
        actual = read_actual([tmp_path / "feet.csv"], reader)
        for found, planned in zip(actual.stations, source.stations, strict=True):
            np.testing.assert_allclose(found.position_m, planned.position_m, rtol=0, atol=2e-6)
            assert found.instrument_height_m == pytest.approx(planned.instrument_height_m, abs=1e-6)


def test_a_list_in_metres_that_is_read_as_feet_is_told(source: PlanSource, tmp_path: Path) -> None:
    path = listed(tmp_path / "list.csv", source, "name,easting,northing,elevation", 1.0)
    with pytest.raises(StationListError, match=r"read as US survey feet, as metres they are at it; .*--units m"):
        read_actual([path], in_unit(source, US_SURVEY_FOOT))


def test_columns_have_units_of_their_own() -> None:
    text = "id,x_ft,y,z_m,ih (ftUS)\nA,10,10,3,5\n"
    (station,) = stations_of_text(Path("list.csv"), text, unit=FOOT)
    assert station.position_m.tolist() == pytest.approx([3.048, 3.048, 3.0])
    assert station.instrument_height_m == pytest.approx(5 * FOOT_US_M, rel=1e-15)

"""Drawings and models in feet, read back by ezdxf and IfcOpenShell, against metres divided by 1200/3937 by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import ezdxf
import ifcopenshell
import ifcopenshell.util.unit
import numpy as np
import pytest

from planner_core.coordinates.frame import matrix_of
from planner_core.export.dxf import BLOCK, write_dxf
from planner_core.export.ifc_stations import write_ifc
from planner_core.export.options import Options
from planner_core.export.write import export_plan
from planner_core.model import FOOT, METRE, US_SURVEY_FOOT, SiteFrame
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.progress import silent
from planner_core.scene.ifc_georeference import read_georeference

FOOT_US_M = 1200 / 3937
ORIGIN_FT = np.array([987_654.25, 211_234.5, 33.0])


@pytest.fixture(scope="module")
def house_in_new_york(house: PlanSource) -> PlanSource:
    frame = SiteFrame(
        matrix=matrix_of((ORIGIN_FT * FOOT_US_M).tolist(), 0.3, 1.0), crs="EPSG:2263", name="EPSG:2263 Long Island",
        source="given epsg", unit=US_SURVEY_FOOT, crs_unit=US_SURVEY_FOOT,
    )  # fmt: skip
    return in_frame(house, frame)


def in_frame(plan: PlanSource, frame: SiteFrame) -> PlanSource:
    return replace(plan, frame=frame, stations=tuple(replace(each, frame=frame) for each in plan.stations))


def by_hand_ft(position_m: np.ndarray) -> np.ndarray:
    cos, sin = math.cos(0.3), math.sin(0.3)
    x, y, z = position_m.tolist()
    return ORIGIN_FT + np.array([cos * x - sin * y, sin * x + cos * y, z]) / FOOT_US_M


@pytest.fixture(scope="module")
def drawing(house_in_new_york: PlanSource, tmp_path_factory: pytest.TempPathFactory) -> ezdxf.document.Drawing:
    path = tmp_path_factory.mktemp("dxf") / "feet.dxf"
    assert write_dxf(house_in_new_york, path, Options(), silent) == ()
    return ezdxf.readfile(path)


@pytest.mark.slow
def test_a_drawing_says_that_it_is_in_survey_feet_and_where_on_earth(drawing: ezdxf.document.Drawing) -> None:
    assert drawing.audit().errors == []
    assert (drawing.header["$INSUNITS"], drawing.header["$MEASUREMENT"]) == (21, 0)  # 21: US survey feet
    geodata = drawing.modelspace().get_geodata()
    assert geodata is not None
    assert geodata.dxf.horizontal_unit_scale == pytest.approx(FOOT_US_M, rel=1e-15)
    assert geodata.dxf.horizontal_units == 21
    # AutoCAD's dictionary of coordinate systems calls the US survey foot FOOT.
    assert '<Axis uom="FOOT">' in geodata.coordinate_system_definition
    assert "EPSG,2263" in geodata.coordinate_system_definition


@pytest.mark.slow
def test_stations_are_drawn_where_they_are_in_feet(
    drawing: ezdxf.document.Drawing, house_in_new_york: PlanSource
) -> None:
    marks = drawing.modelspace().query(f'INSERT[name=="{BLOCK}"]')
    for mark, station in zip(marks, house_in_new_york.stations, strict=True):
        np.testing.assert_allclose(mark.dxf.insert, by_hand_ft(station.ground_m), rtol=0, atol=5.1e-5)
        told = {each.dxf.tag: each.dxf.text for each in mark.attribs}
        sensor = by_hand_ft(station.position_m)
        assert [float(told[tag]) for tag in ("E", "N", "H_SENSOR")] == pytest.approx(sensor.tolist(), abs=5.1e-5)
        assert float(told["H_INSTR"]) == pytest.approx(station.instrument_height_m / FOOT_US_M, abs=5.1e-5)


def test_marks_are_as_large_as_in_metres(drawing: ezdxf.document.Drawing) -> None:
    (circle,) = drawing.blocks[BLOCK].query("CIRCLE")
    assert circle.dxf.radius == pytest.approx(0.2 / FOOT_US_M, rel=1e-9)
    assert drawing.header["$LTSCALE"] == pytest.approx(1 / FOOT_US_M, rel=1e-9)


def test_a_sheet_has_a_scale_of_a_ruler_in_feet(drawing: ezdxf.document.Drawing) -> None:
    layout = next(each for each in drawing.layouts if each.name != "Model")
    (viewport,) = (each for each in layout.query("VIEWPORT") if each.dxf.id != 1)
    # Paper in millimetres, view in feet: a foot of paper is 304.8 mm (of the international foot, to 2 ppm).
    scale = viewport.dxf.view_height * 304.8 / viewport.dxf.height
    assert round(scale, 2) in (24, 48, 64, 96, 128, 192, 240)
    title = " ".join(each.dxf.text for each in layout.query("TEXT"))
    assert f"1:{round(scale)} (" in title
    inches = {24: "1/2", 48: "1/4", 64: "3/16", 96: "1/8", 128: "3/32", 192: "1/16"}[round(scale)]
    assert f'({inches}" = 1\'-0")' in title


def test_a_drawing_in_another_unit_than_its_system_is_not_placed_by_its_code(
    house_in_new_york: PlanSource, tmp_path: Path
) -> None:
    plan = replace(house_in_new_york, frame=replace(house_in_new_york.frame, unit=FOOT))
    (remark,) = write_dxf(plan, tmp_path / "ft.dxf", Options(), silent)
    assert remark.startswith("DXF places drawings on Earth in the unit of their CRS only")
    document = ezdxf.readfile(tmp_path / "ft.dxf")
    assert document.modelspace().get_geodata() is None
    assert document.header["$INSUNITS"] == 2
    told = dict(document.header.custom_vars.properties)
    assert told["Coordinates"] == "EPSG:2263 Long Island, in feet; vertical datum not given"


@pytest.mark.parametrize("unit", [US_SURVEY_FOOT, METRE])
def test_ifc_has_the_map_conversion_in_the_feet_of_the_system(
    house_in_new_york: PlanSource, tmp_path: Path, unit: object
) -> None:
    plan = replace(house_in_new_york, frame=replace(house_in_new_york.frame, unit=unit))
    assert write_ifc(plan, tmp_path / "stations.ifc", Options(), silent) == ()
    model = ifcopenshell.open(str(tmp_path / "stations.ifc"))
    (conversion,) = model.by_type("IfcMapConversion")
    told = [conversion.Eastings, conversion.Northings, conversion.OrthogonalHeight]
    np.testing.assert_allclose(told, ORIGIN_FT, rtol=0, atol=1e-6)
    assert conversion.Scale == pytest.approx(3937 / 1200, rel=1e-12)  # metres of the file to feet of the map
    (system,) = model.by_type("IfcProjectedCRS")
    assert ifcopenshell.util.unit.get_unit_scale(system.MapUnit) == pytest.approx(FOOT_US_M, rel=1e-15)
    assert system.Description == "EPSG:2263 Long Island, in US survey feet; vertical datum not given"
    read_back = read_georeference("stations.ifc", model, 1.0)
    assert read_back is not None and read_back.to_map is not None
    np.testing.assert_allclose(np.array(read_back.to_map), plan.frame.matrix, rtol=0, atol=1e-6)
    assert (read_back.map_unit, read_back.warnings) == ("us survey foot", ())


def test_formats_of_metres_say_so_in_a_plan_in_feet(house_in_new_york: PlanSource, tmp_path: Path) -> None:
    written = export_plan("usd-stations", house_in_new_york, tmp_path / "stations.usda")
    assert "in metres, not in US survey feet: the format has no other unit" in written.remarks
    assert written.coordinates == "EPSG:2263 Long Island, in metres; vertical datum not given"
    assert "EPSG:2263 Long Island, in metres" in (tmp_path / "stations.usda").read_text()

import hashlib
import math
import subprocess
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

import ezdxf
import numpy as np
import pyogrio
import pytest
import shapely

from planner_core.errors import RequirementError
from planner_core.export.dxf import BLOCK, write_dxf
from planner_core.export.dxf_document import APP, scale_for
from planner_core.export.options import Options
from planner_core.export.sheets.building import read_building
from planner_core.export.sheets.paper import drawing_scales
from planner_core.export.sheets.unseen import unseen_surface
from planner_core.model import METRE
from planner_core.plan_folder.plan_source import PlanSource, open_plan
from planner_core.progress import silent


@pytest.fixture(scope="module")
def drawing_file(house: PlanSource, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("dxf") / "house.dxf"
    assert write_dxf(house, path, Options(), silent) == ()
    return path


@pytest.fixture(scope="module")
def drawing(drawing_file: Path):
    return ezdxf.readfile(drawing_file)


@pytest.fixture(scope="module")
def munich_file(house_in_munich: PlanSource, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("dxf") / "munich.dxf"
    assert write_dxf(house_in_munich, path, Options(), silent) == ()
    return path


def test_drawing_passes_the_audit_of_ezdxf(drawing, munich_file):
    for document in (drawing, ezdxf.readfile(munich_file)):
        audit = document.audit()
        assert (audit.errors, audit.fixes) == ([], [])
        assert document.dxfversion == "AC1024"
        assert document.header["$INSUNITS"] == 6


def test_every_station_is_a_block_with_its_figures(drawing, house):
    marks = drawing.modelspace().query(f'INSERT[name=="{BLOCK}"]')
    assert len(marks) == len(house.stations) > 5
    for mark, station in zip(marks, house.stations, strict=True):
        told = {attrib.dxf.tag: attrib.dxf.text for attrib in mark.attribs}
        assert told["ID"] == station.id
        assert told["NUMBER"] == str(station.number)
        assert told["FLOOR"] == station.floor_name
        numbers = [float(told[tag]) for tag in ("E", "N", "H_GROUND", "H_INSTR", "H_SENSOR")]
        sensor_m, ground_m = station.position_m, station.ground_m
        assert np.allclose(numbers, [*sensor_m[:2], ground_m[2], station.instrument_height_m, sensor_m[2]], atol=5.1e-5)
        assert np.allclose(mark.dxf.insert, ground_m, atol=5.1e-5)
        assert mark.dxf.layer == f"{station.floor_id}-STATION"
        shown = {attrib.dxf.tag for attrib in mark.attribs if not attrib.is_invisible}
        assert shown == {"NUMBER", "ID"}


@pytest.mark.slow
def test_only_stations_with_scans_are_told_as_scanned_before(evaluated_house, tmp_path):
    bare = replace(evaluated_house, folder=tmp_path)  # walls take longest
    write_dxf(bare, tmp_path / "given.dxf", Options(), silent)
    marks = ezdxf.readfile(tmp_path / "given.dxf").modelspace().query(f'INSERT[name=="{BLOCK}"]')
    told = {mark.get_attrib_text("ID"): mark.get_attrib_text("STATE") for mark in marks}
    first, *others = evaluated_house.stations
    assert told == {first.id: "scanned before", **{station.id: "planned" for station in others}}


def test_gdal_reads_stations_walls_and_links_where_they_are(drawing_file, house):
    meta, _, geometry, columns = pyogrio.raw.read(drawing_file)
    columns = dict(zip(meta["fields"], columns, strict=True))
    shapes = shapely.from_wkb(geometry)
    layer = columns["Layer"]
    walls = shapely.union_all(shapes[layer == "F0-WALL"])
    assert np.allclose(walls.bounds, [0, 0, 10, 8], atol=1e-4)  # of the house, as it is built
    links = shapes[[name.split("-")[1] == "LINK" for name in layer]]
    at = {station.id: station.position_m for station in house.stations}
    expected = Counter(_ends(np.array([at[link.a], at[link.b]])) for link in house.links)
    assert len(links) == len(house.links)
    assert {station.id for station in house.stations} <= {str(text) for text in columns["Text"]}
    assert Counter(_ends(shapely.get_coordinates(line, include_z=True)) for line in links) == expected


def _ends(points_m: np.ndarray) -> tuple:
    return tuple(sorted(tuple(point) for point in np.round(points_m, 3).tolist()))


def test_walls_are_filled_where_they_are_cut_and_open_at_doors(drawing):
    # Outer walls of 0.3 m around 10 m x 8 m, less openings; inner walls besides.
    whole_m2 = 2 * 0.3 * (10 + 8 - 2 * 0.3)
    assert 0.6 * whole_m2 < _filled_m2(drawing) < 1.2 * whole_m2
    outlines = [
        shapely.Polygon([vertex[:2] for vertex in path.vertices])
        for hatch in drawing.modelspace().query('HATCH[layer=="F0-WALL-FILL"]')
        for path in hatch.paths
    ]
    assert any(outline.covers(shapely.Point(0.15, 0.15)) for outline in outlines)  # a corner of the outer walls
    assert not shapely.union_all(outlines).covers(shapely.Point(3.4, 0.15))  # the front door


def test_each_line_of_the_building_says_what_it_is_of(drawing):
    told = [
        dict(string.value.split("=", 1) for string in line.get_xdata("TLSPLAN"))
        for line in drawing.modelspace().query('LWPOLYLINE[layer=="F0-DOOR"]')
    ]
    assert told
    assert {each["kind"] for each in told} == {"IfcDoor"}
    assert all(each["name"] and len(each["id"]) == 22 for each in told)  # an IFC GlobalId


def test_floors_lie_at_their_heights(drawing, house):
    space = drawing.modelspace()
    for floor in house.floors:
        heights = {line.dxf.elevation for line in space.query(f'LWPOLYLINE[layer=="{floor.id}-WALL"]')}
        assert heights == {floor.elevation_m}


def test_walk_runs_through_its_corners_on_the_ground(drawing, house):
    drawn = [
        np.array([vertex.dxf.location for vertex in line.vertices]) for line in drawing.modelspace().query("POLYLINE")
    ]
    legs = [np.array(leg["points"]) for leg in house.document["route"]["legs"] if leg["points"]]
    assert len(drawn) == len(legs)
    assert all(np.allclose(one, other, atol=1e-4) for one, other in zip(drawn, legs, strict=True))


def test_coordinates_of_seven_digits_keep_a_tenth_of_a_millimetre(munich_file, house_in_munich, house):
    document = ezdxf.readfile(munich_file)
    turn = 0.3
    for mark, station in zip(document.modelspace().query("INSERT"), house.stations, strict=True):
        x, y, _ = station.position_m
        east = 691_000.25 + x * math.cos(turn) - y * math.sin(turn)
        north = 5_336_000.5 + x * math.sin(turn) + y * math.cos(turn)
        assert np.abs(np.array(mark.dxf.insert)[:2] - [east, north]).max() < 5.1e-5 + 1e-9
        assert mark.dxf.insert.z == pytest.approx(515.2 + station.ground_m[2], abs=5.1e-5)


@pytest.mark.slow
def test_drawing_names_its_coordinate_system_and_says_where_it_is(drawing, munich_file):
    told = dict(ezdxf.readfile(munich_file).header.custom_vars.properties)
    assert told["CRS"] == "EPSG:25832"
    assert told["Vertical CRS"] == "EPSG:7837"
    geodata = ezdxf.readfile(munich_file).modelspace().get_geodata()
    assert geodata.get_crs() == (25832, True)
    matrix, code = geodata.get_crs_transformation()
    assert code == 25832
    assert np.allclose(matrix.transform((691_003.0, 5_336_002.0, 0.0)), (691_003.0, 5_336_002.0, 0.0))
    assert dict(drawing.header.custom_vars.properties)["Coordinates"] == "scene coordinates, no CRS"
    assert drawing.modelspace().get_geodata() is None


def test_each_floor_has_a_sheet_to_scale_that_hides_the_other(drawing, house):
    for floor in house.floors:
        (layout,) = [layout for layout in drawing.layouts if layout.name.startswith(f"{floor.id} ")]
        (view,) = [each for each in layout.query("VIEWPORT") if each.dxf.id > 1]
        others = [each.id for each in house.floors if each.id != floor.id]
        assert {name.split("-")[0] for name in view.frozen_layers} == set(others)
        assert f"{others[0]}-STATION" in view.frozen_layers
        scale = 1000 * view.dxf.view_height / view.dxf.height
        assert scale == pytest.approx(50)
        shown_m = np.array([view.dxf.width, view.dxf.height]) * scale / 1000
        middle_m = np.array(view.dxf.view_center_point)[:2]
        (low_m, high_m) = floor.bounds
        assert (middle_m - shown_m / 2 <= low_m).all()
        assert (middle_m + shown_m / 2 >= high_m).all()


@pytest.mark.parametrize(("size_m", "expected"), [((3, 2), 20), ((10.1, 4), 50), ((40, 39), 200), ((9e5, 1), 5000)])
def test_scale_is_the_largest_that_fits_the_paper(size_m, expected):
    assert scale_for(np.array(size_m, dtype=float), np.array([400.0, 200.0])) == expected
    assert expected in drawing_scales(METRE)


def test_one_floor_alone_has_only_its_layers(house, tmp_path):
    write_dxf(house, tmp_path / "f1.dxf", Options(floors=("upper FLOOR",)), silent)
    document = ezdxf.readfile(tmp_path / "f1.dxf")
    used = {entity.dxf.layer.split("-")[0] for entity in document.modelspace()}
    assert "F1" in used
    assert "F0" not in used
    n_stations = len(house.stations_of("F1"))
    assert len(document.modelspace().query("INSERT")) == n_stations
    with pytest.raises(RequirementError, match=r"got 'F7', expected one of F0 \(Ground floor\)"):
        write_dxf(house, tmp_path / "f7.dxf", Options(floors=("F7",)), silent)
    assert not (tmp_path / "f7.dxf").exists()


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (Options(paper="A0"), "paper: got 'A0', expected one of A4, A3; e.g. A3"),
        (Options(cut_m=0.0), "cut: got 0 m, expected a height above the floor; e.g. 1.2"),
        (Options(cut_m=math.nan), "cut: got nan m, expected a height above the floor; e.g. 1.2"),
    ],
)
def test_options_that_make_no_sense_are_refused_before_anything_is_written(options, told, house, tmp_path):
    with pytest.raises(RequirementError) as refused:
        write_dxf(house, tmp_path / "no.dxf", options, silent)
    assert str(refused.value) == told
    assert not (tmp_path / "no.dxf").exists()


@pytest.mark.slow
def test_cut_above_the_heads_of_doors_finds_whole_walls(house, drawing, tmp_path):
    write_dxf(house, tmp_path / "high.dxf", Options(cut_m=2.3), silent)
    high = ezdxf.readfile(tmp_path / "high.dxf")
    doors_m2 = 0.3 * 0.9  # one opening at least is wall up there
    assert _filled_m2(high) > _filled_m2(drawing) + doors_m2


def _filled_m2(document) -> float:
    """Area of what the walls of the ground floor fill, each by the even-odd rule."""
    total = 0.0
    for hatch in document.modelspace().query('HATCH[layer=="F0-WALL-FILL"]'):
        area = shapely.MultiPolygon()
        for path in hatch.paths:
            area = area.symmetric_difference(shapely.Polygon([vertex[:2] for vertex in path.vertices]))
        total += area.area
    return total


def test_without_the_stage_stations_are_drawn_and_it_is_said(house_folder, tmp_path):
    (tmp_path / "plan.json").write_bytes((house_folder / "plan.json").read_bytes())
    remarks = write_dxf(open_plan(tmp_path), tmp_path / "bare.dxf", Options(), silent)
    assert len(remarks) == 1
    assert "walls and unseen surface are not drawn" in remarks[0]
    document = ezdxf.readfile(tmp_path / "bare.dxf")
    assert not document.audit().errors
    assert len(document.modelspace().query("INSERT")) > 5


def test_unseen_ground_is_hatched_where_nothing_seen_lies_over_it(drawing, house, house_folder):
    unseen = unseen_surface(
        read_building(house_folder), 0, height_m=np.array([0.0, 2.5]), window_m=np.array([[-1.0, -1.0], [11.0, 9.0]])
    )
    missed, seen = (shapely.union_all([shapely.Polygon(t) for t in each]) for each in (unseen.missed, unseen.seen))
    expected = missed.difference(seen)
    (hatch,) = drawing.modelspace().query('HATCH[layer=="F0-UNSEEN"]')
    area = shapely.MultiPolygon()
    for path in hatch.paths:
        area = area.symmetric_difference(shapely.Polygon([vertex[:2] for vertex in path.vertices]).buffer(0))
    assert all(path.is_closed for path in hatch.paths)
    assert expected.area > 1.0
    assert area.symmetric_difference(expected).area < 1e-2
    strips = drawing.modelspace().query('LWPOLYLINE[layer=="F0-UNSEEN"]')
    assert len(strips) == len(unseen.walls)


@pytest.mark.slow
def test_same_plan_gives_the_same_bytes_in_another_process(house_folder, drawing_file, tmp_path):
    # Sets of strings are ordered by a seed of the process: one run alone would not show it.
    program = (
        "import sys; from pathlib import Path\n"
        "from planner_core.coordinates.request import FrameRequest\n"
        "from planner_core.export.dxf import write_dxf\n"
        "from planner_core.export.options import Options\n"
        "from planner_core.plan_folder.plan_source import open_plan\n"
        "plan = open_plan(Path(sys.argv[1]), frame=FrameRequest(scene_coordinates=True))\n"
        "write_dxf(plan, Path(sys.argv[2]), Options(), lambda event: None)\n"
    )
    again = tmp_path / "again.dxf"
    subprocess.run(
        [sys.executable, "-c", program, str(house_folder), str(again)], check=True, env={"PYTHONHASHSEED": "3"}
    )
    assert hashlib.sha256(again.read_bytes()).digest() == hashlib.sha256(drawing_file.read_bytes()).digest()
    lines = drawing_file.read_text(encoding="utf-8").splitlines()
    classes = [lines[at + 2] for at, line in enumerate(lines) if line == "CLASS"]
    assert len(classes) > 5
    assert classes == sorted(classes)  # what ezdxf takes out of a set


def test_probability_that_falls_short_never_reads_as_what_was_asked(house, tmp_path):
    links = tuple(replace(link, probability=0.98996) for link in house.links[:3])
    bare = replace(house, links=links, folder=tmp_path)
    write_dxf(bare, tmp_path / "short.dxf", Options(), silent)
    lines = ezdxf.readfile(tmp_path / "short.dxf").modelspace().query('LINE[layer ? ".*LINK-WEAK"]')
    told = [{text.value for text in line.get_xdata(APP)} for line in lines]
    assert len(told) == 3
    assert all("probability=0.98996" in texts for texts in told)

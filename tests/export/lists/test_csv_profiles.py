"""Lines for controllers: what stands in which column, worked out by hand, and what no line can hold."""

import csv
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from field_plan import STATIONS, field_plan, on_site, site_frame
from hypothesis import given
from hypothesis import strategies as st

from planner_core.errors import ExportError, RequirementError
from planner_core.export.csv_profiles import LETTERS, PROFILES, write_csv
from planner_core.export.options import Options
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.plan_folder.stations_csv import read_station_list
from planner_core.progress import silent

Write = Callable[..., tuple[Path, tuple[str, ...]]]
E1, N1, H1 = (f"{value:.4f}" for value in on_site(9.0, 5.0, 0.0))


def lines(path: Path) -> list[str]:
    text = path.read_bytes().decode()
    assert text.endswith("\r\n")
    return text.removesuffix("\r\n").split("\r\n")


@pytest.mark.parametrize(
    ("columns", "first", "line"),
    [
        ("PENZD", 0, f"S001,{E1},{N1},{H1},S001 Erdgeschoß h 1.50"),
        ("pnezd", 0, f"S001,{N1},{E1},{H1},S001 Erdgeschoß h 1.50"),
        ("XYZ", 0, f"{E1},{N1},{H1}"),
        ("NEZ", 0, f"{N1},{E1},{H1}"),
        ("PENHZ", 0, f"S001,{E1},{N1},1.5000,{H1}"),
        ("trimble-access", 0, f"S001,{N1},{E1},{H1},F0"),
        ("trimble-access-en", 0, f"S001,{E1},{N1},{H1},F0"),
        ("leica", 0, f"S001,{E1},{N1},{H1},F0"),
        ("civil3d", 0, f"1,{E1},{N1},{H1},S001 Erdgeschoss h 1.50"),
        ("auf", 1, f"1,{N1},{E1},{H1},S001 Erdgeschoss h 1.50"),
        ("carlson", 0, f"S001,{N1},{E1},{H1},S001 Erdgeschoss h 1.50"),
        ("emlid-flow", 1, f"S001,F0,{E1},{N1},{H1},S001 Erdgeschoß h 1.50"),
        ("topcon-magnet", 0, f"S001,{N1},{E1},{H1},F0"),
    ],
)
def test_a_column_set_has_its_columns_in_order(
    write: Write, site_plan: PlanSource, columns: str, first: int, line: str
) -> None:
    path, _ = write(write_csv, site_plan, columns=columns)
    assert lines(path)[first] == line
    assert len(lines(path)) == first + len(STATIONS)


def test_every_profile_writes_and_its_header_has_a_name_a_column(write: Write, site_plan: PlanSource) -> None:
    for name, profile in PROFILES.items():
        path, _ = write(write_csv, site_plan, columns=name)
        rows = [row for row in csv.reader(lines(path)) if not row[0].startswith("#")]
        assert {len(row) for row in rows} == {len(profile.columns)}, name
        assert (rows[0] == profile.header.split(",")) == bool(profile.header), name


@pytest.mark.parametrize("name", ["emlid-flow", "generic"])
def test_headers_are_those_of_their_programs(write: Write, site_plan: PlanSource, name: str) -> None:
    path, _ = write(write_csv, site_plan, columns=name)
    expected = {
        "emlid-flow": "Name,Code,Easting,Northing,Elevation,Description",
        "generic": "name,easting_m,northing_m,ground_z_m,instrument_height_m,sensor_z_m,floor,order,description,crs",
    }
    assert lines(path)[0] == expected[name]


def test_sensor_heights_are_the_ground_plus_the_instrument(write: Write, site_plan: PlanSource) -> None:
    path, remarks = write(write_csv, site_plan, columns="PENZGHS", instrument="sensor")
    assert "heights are those of sensors, not of ground points" in remarks
    for row, (floor, x, y, z, height, _) in zip(csv.reader(lines(path)), STATIONS.values(), strict=True):
        assert floor
        _, _, ground = on_site(x, y, z)
        told = np.array(row[3:], dtype=float)
        np.testing.assert_allclose(told, [ground + height, ground, height, ground + height], atol=0.5001e-4)


def test_tlsplan_reads_the_generic_list_back(write: Write, site_plan: PlanSource) -> None:
    path, _ = write(write_csv, site_plan, "out.csv", columns="generic")
    back = read_station_list(path)
    assert [station.id for station in back] == list(STATIONS)
    for station, (_, x, y, z, height, _) in zip(back, STATIONS.values(), strict=True):
        east, north, ground = on_site(x, y, z)
        np.testing.assert_allclose(station.position_m, [east, north, ground + height], atol=1.01e-4)
        assert station.instrument_height_m == pytest.approx(height, abs=0.51e-4)


def test_coordinates_are_named_where_a_line_can(write: Write, scene_plan: PlanSource) -> None:
    assert "scene coordinates no CRS" in lines(write(write_csv, scene_plan, columns="generic")[0])[1]
    path, remarks = write(write_csv, scene_plan, columns="auf")
    assert lines(path)[0] == "# scene coordinates, no CRS"
    assert remarks == ()
    _, remarks = write(write_csv, scene_plan, columns="PENZD")
    assert remarks == ("the file can't state its coordinate system: scene coordinates, no CRS",)


def test_what_is_taken_off_is_told(write: Write, site_plan: PlanSource) -> None:
    path, remarks = write(write_csv, site_plan, columns="auf", subtract=(691000.0, 5334000.0, 500.0))
    assert lines(path)[0].endswith("less E, N, H 691000.0000, 5334000.0000, 500.0000 m")
    number, north, east, height, _ = lines(path)[1].split(",")
    east_m, north_m, height_m = on_site(9.0, 5.0, 0.0)
    assert (number, float(east)) == ("1", pytest.approx(east_m - 691000.0, abs=1e-4))
    assert (float(north), float(height)) == (
        pytest.approx(north_m - 5334000.0, abs=1e-4),
        pytest.approx(height_m - 500.0),
    )
    assert any("subtracted" in remark for remark in remarks)


@pytest.mark.parametrize(("separator", "sign"), [("semicolon", ";"), ("tab", "\t"), ("space", " "), ("comma", ",")])
def test_texts_give_way_to_the_separator(write: Write, separator: str, sign: str) -> None:
    rows = {'S;1 "a",b': ("F1", 1.0, 2.0, 0.0, 1.5, False), "S2": ("F1", 3.0, 2.0, 0.0, 1.5, False)}
    path, _ = write(write_csv, field_plan(stations=rows), columns="PENZD", separator=separator)
    for line in lines(path):
        assert '"' not in line
        assert len(line.split(sign)) == 5
    assert lines(path)[1].split(sign)[0] == "S2"


@pytest.mark.parametrize("decimals", [0, 3, 6])
def test_decimals_are_as_asked(write: Write, site_plan: PlanSource, decimals: int) -> None:
    path, _ = write(write_csv, site_plan, columns="XYZ", decimals=decimals)
    for cell in lines(path)[2].split(","):
        assert len(cell.partition(".")[2]) == decimals


def test_long_names_are_shortened_and_told(write: Write) -> None:
    rows = {f"hall-of-residence-{n:03d}": ("F0", float(n), 0.0, 0.0, 1.5, False) for n in range(7)}
    path, remarks = write(write_csv, field_plan(stations=rows), columns="leica")
    names = [line.split(",")[0] for line in lines(path)]
    assert len(set(names)) == len(names)
    assert all(len(name) <= 16 for name in names)
    assert "hall-of-residence-000 is" in remarks[0]
    assert "and 3 more" in remarks[0]


def test_a_floor_is_chosen_by_id_or_name(write: Write, site_plan: PlanSource) -> None:
    for name in ("F1", "upper FLOOR"):
        path, _ = write(write_csv, site_plan, floors=(name,))
        assert [line.split(",")[0] for line in lines(path)] == ["S003", "S004"]
    with pytest.raises(RequirementError, match="got 'F7', expected one of F0"):
        write(write_csv, site_plan, floors=("F7",))


def test_scanned_stations_say_so(write: Write, site_plan: PlanSource) -> None:
    told = [line.split(",")[-1] for line in lines(write(write_csv, site_plan)[0])]
    assert [text.endswith("scanned") for text in told] == [False, True, False, False]


def test_an_unknown_instrument_height_has_no_ground_point(write: Write) -> None:
    plan = field_plan(stations={"A": ("F0", 1.0, 2.0, 3.0, math.nan, False)})
    with pytest.raises(ExportError, match=r"instrument height of A is not known.*--instrument sensor"):
        write(write_csv, plan)
    path, _ = write(write_csv, plan, columns="PENZHD", instrument="sensor")
    assert lines(path) == ["A,1.0000,2.0000,3.0000,,A Erdgeschoß sensor"]
    with pytest.raises(ExportError, match="instrument height of A"):
        write(write_csv, plan, columns="PENZH", instrument="sensor", separator="space")


@pytest.mark.parametrize(
    ("columns", "said"), [("PEZ", "E and N"), ("PENQ", "letters of"), ("PENEZ", "easting twice"), ("", "letters of")]
)
def test_columns_that_make_no_sense_are_refused(write: Write, scene_plan: PlanSource, columns: str, said: str) -> None:
    with pytest.raises(RequirementError, match=said):
        write(write_csv, scene_plan, columns=columns)


@given(
    x=st.floats(-1e5, 1e5),
    y=st.floats(-1e5, 1e5),
    z=st.floats(-100, 3000),
    order=st.permutations(sorted("PENZHGSDCFO")),
)
def test_any_order_of_columns_holds_the_same_figures(
    tmp_path_factory: pytest.TempPathFactory, x: float, y: float, z: float, order: list[str]
) -> None:
    path = tmp_path_factory.mktemp("csv") / "out.csv"
    plan = field_plan(site_frame(), {"S9": ("F0", x, y, z, 1.5, False)})
    write_csv(plan, path, Options(columns="".join(order)), silent)
    cells = dict(zip(order, lines(path)[0].split(","), strict=True))
    east, north, height = on_site(x, y, z)
    expected = {"E": east, "N": north, "Z": height, "G": height, "H": 1.5, "S": height + 1.5}
    for letter, value in expected.items():
        assert float(cells[letter]) == pytest.approx(value, abs=0.51e-4), letter
    assert (cells["P"], cells["O"], cells["C"], cells["F"]) == ("S9", "1", "F0", "Erdgeschoß")


def test_a_profile_that_nothing_documents_says_so(write: Write, site_plan: PlanSource) -> None:
    for name, profile in PROFILES.items():
        _, remarks = write(write_csv, site_plan, columns=name)
        assert any("no documentation was available" in remark for remark in remarks) == (not profile.checked), name


def test_letters_of_all_profiles_are_known() -> None:
    assert set("".join(profile.columns for profile in PROFILES.values())) <= set(LETTERS)

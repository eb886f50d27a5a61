"""Station lists: what is written reads back; what crews write is understood, or refused with the place."""

import csv
import dataclasses
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from oldest_plan import oldest_plan, station

from planner_core.errors import StationListError
from planner_core.model import Plan, PriorStation, Role
from planner_core.plan_folder.stations_csv import COLUMNS, read_station_list, stations_csv

metres = st.floats(-1e6, 1e6, allow_nan=False).map(lambda value: round(value, 4))


def test_stations_csv_gives_scene_coordinates_and_the_ground_below(plan: Plan) -> None:
    rows = list(csv.DictReader(io.StringIO(stations_csv(plan))))
    assert list(rows[0]) == list(COLUMNS)
    assert [row["id"] for row in rows] == ["S001", "S002", "S003"]
    last = rows[2]
    assert [last[key] for key in ("x_m", "y_m", "z_m", "ground_z_m", "instrument_height_m")] == [
        "500003.0000", "4000001.5000", "104.4000", "102.8000", "1.6000",
    ]  # fmt: skip


def test_stations_csv_tells_scanned_stations_from_those_to_scan(plan: Plan) -> None:
    first, second, third = plan.stations
    prior = tuple(PriorStation(each.id, (0.0, 0.0, 0.0), role)
                  for each, role in ((first, Role.SCANNED), (second, Role.LOCKED)))  # fmt: skip
    site = dataclasses.replace(plan.settings.site, prior=prior)
    stations = (dataclasses.replace(first, fixed=True), second, dataclasses.replace(third, fixed=True))
    known = dataclasses.replace(plan, settings=dataclasses.replace(plan.settings, site=site), stations=stations)
    status = [row["status"] for row in csv.DictReader(io.StringIO(stations_csv(known)))]
    assert status == ["scanned", "to scan", "given"]


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(rows=st.lists(st.tuples(metres, metres, metres), min_size=1, max_size=6))
def test_station_list_written_then_read_is_the_same(
    plan: Plan, tmp_path: Path, rows: list[tuple[float, float, float]]
) -> None:
    base = plan.stations[0]
    stations = tuple(
        dataclasses.replace(base, id=f"P {i}", position_m=np.array(row) - plan.survey.scene.offset_m)
        for i, row in enumerate(rows)
    )
    file = tmp_path / "list.csv"
    file.write_text(stations_csv(dataclasses.replace(plan, stations=stations)))
    back = read_station_list(file)
    assert [station.id for station in back] == [station.id for station in stations]
    np.testing.assert_allclose([station.position_m for station in back], rows, atol=1e-4)


def test_station_list_of_a_plan_is_the_same_from_csv_json_and_folder(plan_folder: Path) -> None:
    lists = [read_station_list(plan_folder / name) for name in ("stations.csv", "plan.json", ".")]
    for stations in lists:
        assert [(s.id, s.floor, s.instrument_height_m) for s in stations] == [
            ("S001", "F0", 1.5), ("S002", "F0", 1.5), ("S003", "F1", 1.6),
        ]  # fmt: skip
        np.testing.assert_allclose(stations[2].position_m, [500003.0, 4000001.5, 104.4], atol=1e-6)


@pytest.mark.parametrize(
    "text",
    [
        "id,x_m,y_m,z_m\nA,1.5,2,3\n",
        "\ufeffID;X [m];Y [m];Z [m]\nA;1,5;2;3\n",
        "X\tY\tZ\tName\tcode\n1.5\t2\t3\tA\twhatever\n",
        "\n z_m , id , y_metres , x(m) \n 3 , A , 2 , 1.5 \n\n",
        "id,x,y,ground_z_m,instrument_height_m\nA,1.5,2,1.25,1.75\n",
    ],
    ids=["plain", "semicolon, comma decimals, byte order mark", "tabs, other order", "blanks", "ground and height"],
)
def test_station_list_is_read_in_the_ways_people_write_it(tmp_path: Path, text: str) -> None:
    file = tmp_path / "mine.csv"
    file.write_text(text, encoding="utf-8")
    (station,) = read_station_list(file)
    assert station.id == "A"
    assert station.position_m.tolist() == [1.5, 2.0, 3.0]


def test_list_of_nothing_but_places_is_numbered_and_has_no_heights(tmp_path: Path) -> None:
    file = tmp_path / "mine.csv"
    file.write_text("x,y,z\n1,2,3\n4,5,6\n")
    assert [(s.id, s.instrument_height_m, s.floor) for s in read_station_list(file)] == [
        ("S001", None, None),
        ("S002", None, None),
    ]


@pytest.mark.parametrize(
    "name",
    [
        "id", "ID", "Name", "Station", "Station ID", "station_name", "Stn", "Point", "Point No", "Point No.", "PointNr",
        "Point Number", "Point ID", "Pt", "Pt#", "Pt. No", "No.", "Nr", "#", "Number", "Label", "Setup", "Scan Name",
        "Punkt", "Punkt-Nr.", "PktNr",
    ],
)  # fmt: skip
def test_id_is_found_under_the_names_people_give_it(tmp_path: Path, name: str) -> None:
    file = tmp_path / "mine.csv"
    file.write_text(f"code,x,y,z,{name}\nwhatever,1,2,3,P 17\nwhatever,4,5,6,P 3\n")
    assert [station.id for station in read_station_list(file)] == ["P 17", "P 3"]


@pytest.mark.parametrize(
    ("text", "z_m", "height_m"),
    [
        ("id,x,y,height\nA,1,2,3\n", 3.0, None),
        ("id,x,y,height,instrument_height\nA,1,2,3,1.5\n", 3.0, 1.5),
        ("id,height,x,y,z\nA,1.5,1,2,3\n", 3.0, None),
        ("id,height,x,y,ground_z,ih\nA,9,1,2,3,1.5\n", 4.5, 1.5),
        ("id,x,y,Elev.\nA,1,2,3\n", 3.0, None),
    ],
    ids=["alone", "and the instrument's", "before z", "beside ground and instrument", "elev"],
)
def test_height_is_the_sensors_z_where_nothing_else_is(
    tmp_path: Path, text: str, z_m: float, height_m: float | None
) -> None:
    file = tmp_path / "mine.csv"
    file.write_text(text)
    (station,) = read_station_list(file)
    assert (station.position_m.tolist(), station.instrument_height_m) == ([1.0, 2.0, z_m], height_m)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x,y,z,Beschreibung\n1,2,3,A\n", ("line 1", "Beschreibung", "ids", "numbered")),
        ("\n\nx,y,z,tag,code\n1,2,3,A,B\n", ("line 3", "tag, code")),
        ("id,x,y,z\nA,1,2,3\n ,1,2,3\n", ("line 3", "column id", "empty")),
        ("id,x,y,ground_z,height\nA,1,2,3,1.5\n", ("line 1", "column height", "instrument_height_m")),
        ("id,x_m,y_m,z_m\nA,1,2,3\nB,1,two,3\n", ("line 3", "y_m", "'two'")),
        ("id,x_m,y_m,z_m\nA,1,2,\n", ("line 2", "z_m", "''")),
        ("id,x_m,y_m,z_m\nA,1,2\n", ("line 2", "has 3 fields, the header 4", "empty one needs its separator")),
        (
            "id,x,y,z\nS001,8,85,2,78,1,40\n",
            ("line 2: has 7 fields, the header 4", "decimal commas need semicolons or tabs"),
        ),
        ("id;x;y;z\nA;1,0;2;3\nB;1,0;2;3;too;many\n", ("line 3: has 6 fields, the header 4", "needs quotes")),
        ("id,x_m,y_m,z_m\nA,1,nan,3\n", ("line 2", "y_m", "'nan'")),
        ("id,x_m,y_m,z_m\nA,1,inf,3\n", ("line 2", "y_m")),
        ("id,easting,z_m\nA,1,3\n", ("line 1", "easting")),
        ("id,x,y,z\nA,1,2,3\nA,4,5,6\n", ("'A'", "twice")),
        ("id,x,y,z\n", ("no stations",)),
        ("", ("no stations",)),
    ],
)
def test_bad_station_list_is_refused_with_the_place(tmp_path: Path, text: str, expected: tuple[str, ...]) -> None:
    file = tmp_path / "mine.csv"
    file.write_text(text)
    with pytest.raises(StationListError) as caught:
        read_station_list(file)
    message = str(caught.value)
    assert "\n" not in message
    assert [part for part in (str(file), *expected) if part not in message] == []


@pytest.mark.parametrize(
    "text",
    ["id,x,y,z\nA,1,2,3,,\n", "id,x,y,z,,\nA,1,2,3\n", 'id,x,y,z,remark\nA,1,2,3,"door, left"\n'],
    ids=["empty fields at the end", "empty names at the end", "a quoted comma"],
)
def test_fields_that_say_nothing_or_are_quoted_do_not_count(tmp_path: Path, text: str) -> None:
    file = tmp_path / "mine.csv"
    file.write_text(text)
    (station,) = read_station_list(file)
    assert (station.id, station.position_m.tolist()) == ("A", [1.0, 2.0, 3.0])


def test_binary_file_and_missing_file_are_no_station_lists(tmp_path: Path) -> None:
    binary = tmp_path / "b.csv"
    binary.write_bytes(b"\xff\xfe\x00x")
    for file in (binary, tmp_path / "none.csv", tmp_path / "none.json"):
        with pytest.raises(StationListError):
            read_station_list(file)


@pytest.mark.parametrize(
    ("stations", "expected"),
    [
        ({"A": 1}, "stations: got {'A': 1}, expected a list"),
        ([7], r"stations\[0\]: got 7, expected keys with values"),
        ([{"id": "A", "position": [1, 2, 3]}], r"stations\[0\]: got no floor"),
        ([station("A", "F0", 1, [1, 2])], r"stations\[0\].position: got \[1, 2\], expected a longer list"),
        ([station("A", "F0", 1, [1, 2, "up"])], r"stations\[0\].position\[2\]: got 'up', expected a finite number"),
        ([station("A", "", 1, [1, 2, 3], instrument_height_m="high")], r"instrument_height_m: got 'high'"),
    ],
)
def test_plan_json_without_proper_stations_is_refused_in_words(tmp_path: Path, stations: Any, expected: str) -> None:
    file = tmp_path / "plan.json"
    file.write_text(json.dumps(oldest_plan(stations=stations)))
    with pytest.raises(StationListError, match=expected) as caught:
        read_station_list(file)
    assert "Error(" not in str(caught.value)

"""Reading control points: what a surveyor's CSV may look like, and what is wrong with those that can't be read."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from planner_core.coordinates.control_points import read_control_points
from planner_core.errors import CoordinatesError


def file_of(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "points.csv"
    path.write_text(text, encoding="utf-8")
    return path


PLAIN = "name,x,y,z,E,N,H,weight\nP1,1,2,3,100.5,200.25,30,2\nP2,4,5,,400,500,,\n"


def test_columns_and_empty_heights_are_read(tmp_path: Path) -> None:
    points = read_control_points(file_of(tmp_path, PLAIN))
    assert points.names == ("P1", "P2")
    assert points.scene_m[0].tolist() == [1, 2, 3]
    assert points.site_m[0].tolist() == [100.5, 200.25, 30]
    assert math.isnan(points.scene_m[1, 2])
    assert math.isnan(points.site_m[1, 2])
    assert points.weights.tolist() == [2, 1]


@pytest.mark.parametrize(
    "text",
    [
        "\ufeffPoint;Scene_X [m];scene y;scene-z;Easting;Northing;Height;w\n"
        "P1;1;2;3;100,5;200,25;30;2\nP2;4;5;;400;500;;\n",
        "id\te_m\tn_m\th_m\tx_m\ty_m\tz_m\tweight\nP1\t100.5\t200.25\t30\t1\t2\t3\t2\nP2\t400\t500\t\t4\t5\t\t\n",
        PLAIN.replace("30,2\n", "30,2,,\n"),
        "# surveyed in May\n\n" + PLAIN.replace("\n", "\r\n"),
    ],
    ids=["semicolons", "tabs", "empty cells", "comments"],
)
def test_other_spellings_are_the_same_points(tmp_path: Path, text: str) -> None:
    plain = read_control_points(file_of(tmp_path, PLAIN))
    other = read_control_points(file_of(tmp_path, text))
    assert other.names == plain.names
    for ours, theirs in ((plain.scene_m, other.scene_m), (plain.site_m, other.site_m), (plain.weights, other.weights)):
        assert np.array_equal(ours, theirs, equal_nan=True)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "holds no points"),
        ("name,x,y,z,E,N,H\n", "holds no points"),
        ("name,x,y,E\nP1,1,2,3\n", "without N"),
        ("name,x,y,E,N\nP1,1,2,3,4\nP1,1,2,3,4\n", "line 3: name is 'P1'"),
        ("name,x,y,E,N\n,1,2,3,4\n", "line 2: name is ''"),
        ("name,x,y,E,N\nP1,1,2,3\n", "line 2: N is ''"),
        ("name,x,y,E,N\nP1,1,nan,3,4\n", "line 2: y is 'nan'"),
        ("name,x,y,E,N\n\nP1,1,2,3,4e999\n", "line 3: N is '4e999'"),
        ("name,x,y,E,N,weight\nP1,1,2,3,4,0\n", "weight is 0"),
        ("name,x,y,E,N\nP1,1,5,2,0,100,5,200,25\n", "line 2: has 9 cells, expected 5"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(CoordinatesError, match=told) as caught:
        read_control_points(file_of(tmp_path, text))
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(CoordinatesError, match="no such file"):
        read_control_points(tmp_path / "none.csv")


@pytest.mark.parametrize(
    ("raw", "line", "byte"),
    [
        ("name,x,y,E,N\nP1,1,2,3,4\nTürpfosten,1,2,3,4\n".encode("cp1252"), 3, "0xfc"),
        (b"\xef\xbb\xbfname,x,y,E,N\r\n\xe9,1,2,3,4\r\n", 2, "0xe9"),
        ("name,x,y,E,N\nP1,1,2,3,4\n".encode("utf-16"), 1, "0xff"),
    ],
    ids=["cp1252", "cp1252 behind a mark", "utf-16"],
)
def test_another_encoding_is_told_with_its_line_and_the_way_out(
    tmp_path: Path, raw: bytes, line: int, byte: str
) -> None:
    path = tmp_path / "points.csv"
    path.write_bytes(raw)
    with pytest.raises(CoordinatesError) as caught:
        read_control_points(path)
    said = str(caught.value)
    assert said.startswith(f"{path}, line {line}: byte {byte} is not UTF-8")
    assert "save the file as UTF-8" in said
    assert "\n" not in said


def test_a_folder_is_no_file_of_control_points(tmp_path: Path) -> None:
    with pytest.raises(CoordinatesError, match=r"can't be read \(Is a directory\)"):
        read_control_points(tmp_path)


@pytest.mark.parametrize(
    "row", ['P2,"4,5,6,400,500,60', '"P2,4,5,6,400,500,60', 'P2,4,5,6,400,500,"60\n61"', "P2" * 100_000]
)
def test_an_open_quote_is_told_with_its_line(tmp_path: Path, row: str) -> None:
    text = PLAIN.splitlines()
    with pytest.raises(CoordinatesError, match=r"points\.csv, line 3: .*expected CSV; mind the quotes"):
        read_control_points(file_of(tmp_path, f"{text[0]}\n{text[1]}\n{row}\n"))


def test_a_quoted_name_may_have_a_comma(tmp_path: Path) -> None:
    assert read_control_points(file_of(tmp_path, PLAIN.replace("P1", '"P1, gate"'))).names[0] == "P1, gate"

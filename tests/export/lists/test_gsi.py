"""GSI, read back by a parser that knows nothing but the description of the format in Leica's TPS1100 manual."""

import math
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from field_plan import STATIONS, field_plan, on_site, site_frame
from geocompy.gsi import gsiformat
from hypothesis import given
from hypothesis import strategies as st

from planner_core.errors import ExportError, RequirementError
from planner_core.export.gsi import write_gsi8, write_gsi16
from planner_core.export.options import Options
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.progress import silent

Write = Callable[..., tuple[Path, tuple[str, ...]]]
#: Position 6 of a word -> metres of its last digit.
UNIT_M = {"0": 1e-3, "6": 1e-4, "8": 1e-5}
LENGTHS = {"81": "east", "82": "north", "83": "height", "88": "instrument"}
WRITERS = {8: write_gsi8, 16: write_gsi16}


def parse(text: str, width: int) -> tuple[list[dict[str, object]], list[list[str]]]:
    """Points and code blocks of a file; lengths in metres."""
    assert text.endswith("\r\n")
    points, codes = [], []
    for number, line in enumerate(text.removesuffix("\r\n").split("\r\n"), start=1):
        block = line
        if width == 16:
            assert block[0] == "*"
            block = block[1:]
        size = width + 8
        assert len(block) % size == 0, line
        words = [block[start : start + size] for start in range(0, len(block), size)]
        assert len(words) <= (8 if width == 8 else 12)
        point: dict[str, object] = {"block": int(words[0][2:6])}
        assert point["block"] == number
        for word in words:
            match = re.fullmatch(rf"(\d\d)([\d.]{{4}})([+-])(.{{{width}}}) ", word)
            assert match is not None, word
            index, information, sign, data = match.groups()
            if index in LENGTHS:
                assert data.isdigit(), word
                assert information[:2] == ".."
                point[LENGTHS[index]] = (-1 if sign == "-" else 1) * int(data) * UNIT_M[information[3]]
            else:
                assert re.fullmatch(r"[A-Za-z0-9_.\-]+", data), word
                point[index] = data.lstrip("0")
        if words[0].startswith("41"):
            codes.append([str(value) for key, value in point.items() if key != "block"])
        else:
            points.append(point)
    return points, codes


def read(path: Path, width: int) -> tuple[list[dict[str, object]], list[list[str]]]:
    return parse(path.read_bytes().decode("ascii"), width)


def test_the_parser_reads_a_block_as_the_manual_describes_it() -> None:
    text = "110001+00000H66 81..16+01239794 82..10-00576080 88..18+00150000 \r\n"
    ((point,), codes) = parse(text, 8)
    assert codes == []
    assert point["11"] == "H66"
    assert point["east"] == pytest.approx(123.9794)
    assert point["north"] == pytest.approx(-576.08)
    assert point["instrument"] == pytest.approx(1.5)


def test_a_gsi_8_block_is_this_line(write: Write, scene_plan: PlanSource) -> None:
    path, _ = write(write_gsi8, scene_plan)
    assert path.read_bytes().split(b"\r\n")[1] == (
        b"110002+0000S001 81..10+00009000 82..10+00005000 83..10+00000000 88..10+00001500 71....+000000F0 "
    )


def test_a_gsi_16_block_is_this_line(write: Write, scene_plan: PlanSource) -> None:
    path, _ = write(write_gsi16, scene_plan, instrument="sensor")
    assert path.read_bytes().split(b"\r\n")[4] == (
        b"*110005+000000000000S004 81..16-0000000000025000 82..16+0000000000070000 83..16+0000000000043000 "
        b"88..16+0000000000015000 71....+00000000000000F1 "
    )


@pytest.mark.parametrize(
    ("width", "unit", "digit_m"), [(8, "mm", 1e-3), (16, "mm", 1e-3), (16, "0.1mm", 1e-4), (8, "0.1mm", 1e-4)]
)
def test_points_come_back_to_half_a_digit(write: Write, width: int, unit: str, digit_m: float) -> None:
    less = (690000.0, 5334000.0, 0.0) if width == 8 else (0.0, 0.0, 0.0)
    path, remarks = write(WRITERS[width], field_plan(site_frame()), gsi_unit=unit, subtract=less)
    points, _ = read(path, width)
    assert [point["11"] for point in points] == list(STATIONS)
    for point, (floor, x, y, z, height, _) in zip(points, STATIONS.values(), strict=True):
        east, north, ground = on_site(x, y, z)
        assert point["east"] == pytest.approx(east - less[0], abs=0.501 * digit_m)
        assert point["north"] == pytest.approx(north - less[1], abs=0.501 * digit_m)
        assert point["height"] == pytest.approx(ground, abs=0.501 * digit_m)
        assert point["instrument"] == pytest.approx(height, abs=0.501 * digit_m)
        assert point["71"] == floor
    assert any("subtracted" in remark for remark in remarks) == (width == 8)


@given(
    x=st.floats(-9e4, 9e4), y=st.floats(-9e4, 9e4), z=st.floats(-500, 4000), height=st.floats(0.1, 3),
    width=st.sampled_from([8, 16]),
)  # fmt: skip
def test_any_point_that_fits_comes_back(
    tmp_path_factory: pytest.TempPathFactory, x: float, y: float, z: float, height: float, width: int
) -> None:
    path = tmp_path_factory.mktemp("gsi") / "out.gsi"
    WRITERS[width](field_plan(stations={"P": ("F0", x, y, z, height, False)}), path, Options(), silent)
    (point,), _ = read(path, width)
    half = 0.501e-3 if width == 8 else 0.501e-4
    for key, value in (("east", x), ("north", y), ("height", z), ("instrument", height)):
        assert point[key] == pytest.approx(value, abs=half)


def test_coordinates_too_long_for_gsi_8_are_refused_with_a_way_out(write: Write, site_plan: PlanSource) -> None:
    with pytest.raises(ExportError, match=r"GSI-8: the easting of S001 .* 9 digits .* at most 8; .*GSI-16.*--subtract"):
        write(write_gsi8, site_plan)
    with pytest.raises(ExportError, match="--gsi-unit mm holds ten times as much"):
        write(write_gsi8, site_plan, gsi_unit="0.1mm")


@pytest.mark.parametrize("value", [99999.9994, -99999.9994])
def test_the_last_coordinate_that_gsi_8_holds_is_written(write: Write, value: float) -> None:
    path, _ = write(write_gsi8, field_plan(stations={"P": ("F0", value, 0.0, 0.0, 1.5, False)}))
    assert read(path, 8)[0][0]["east"] == pytest.approx(math.copysign(99999.999, value))
    with pytest.raises(ExportError, match="9 digits"):
        write(write_gsi8, field_plan(stations={"P": ("F0", value * 1.00000001, 0.0, 0.0, 1.5, False)}))


@pytest.mark.parametrize(
    ("crs", "vertical", "words"),
    [
        ("EPSG:25832", "EPSG:7837", ["CRS", "GROUND", "EPSG", "25832", "HEIGHTS", "EPSG", "7837"]),
        ("", "", ["CRS", "GROUND", "LOCAL", "NO_CRS"]),
        ('PROJCRS["here",BASEGEOGCRS["x"]]', "", ["CRS", "GROUND", "WKT"]),
    ],
)
def test_the_first_block_names_the_coordinates(write: Write, crs: str, vertical: str, words: list[str]) -> None:
    path, _ = write(write_gsi16, field_plan(site_frame(crs, vertical)))
    assert read(path, 16)[1] == [words]


def test_the_first_block_tells_what_is_taken_off(write: Write, site_plan: PlanSource) -> None:
    path, _ = write(write_gsi8, site_plan, subtract=(690000.0, 5334000.0, 7.5), instrument="sensor")
    assert read(path, 8)[1] == [["CRS", "SENSOR", "EPSG", "25832", "LESS", "690000", "5334000", "7.5"]]


@pytest.mark.parametrize(
    ("width", "less"),
    [
        (8, (458000.1234, 0.0, 0.0)),
        (8, (0.0, 5438000.25, 0.0)),
        (16, (0.0, 0.1 + 0.2, 0.0)),
        (16, (1e-5, 0.0, 0.0)),
        (16, (0.0, 0.0, 1e17)),
    ],
)
def test_a_subtraction_that_the_first_block_can_not_hold_is_refused(
    write: Write, site_plan: PlanSource, width: int, less: tuple[float, float, float]
) -> None:
    with pytest.raises(ExportError, match=rf"^--subtract: got .*at most {width} char.*GSI-{width}.*whole metres$"):
        write(WRITERS[width], site_plan, subtract=less)


@pytest.mark.parametrize(
    ("width", "less"),
    [(8, (690000.0, 5334000.0, -7.25)), (8, (691000.5, 5334000.0, 0.0)), (16, (690000.1234, 5334000.1234, 0.0))],
)
def test_a_subtraction_leads_back_to_the_digit(
    write: Write, site_plan: PlanSource, width: int, less: tuple[float, float, float]
) -> None:
    path, _ = write(WRITERS[width], site_plan, subtract=less)
    points, ((*_, east, north, height),) = read(path, width)
    assert tuple(float(word or "0") for word in (east, north, height)) == less  # the parser strips zeros
    site_m = on_site(9.0, 5.0, 0.0)
    half = 0.501e-3 if width == 8 else 0.501e-4
    for key, word, value in zip(("east", "north", "height"), (east, north, height), site_m, strict=True):
        assert float(str(points[0][key])) + float(word or "0") == pytest.approx(value, abs=half)


def test_names_of_more_than_eight_characters_are_shortened_in_gsi_8_only(write: Write) -> None:
    plan = field_plan(stations={"Küche-0017": ("F0", 1.0, 2.0, 0.0, 1.5, False)})
    path, remarks = write(write_gsi8, plan)
    assert read(path, 8)[0][0]["11"] == "che-0017"
    assert remarks == ("GSI-8 takes names of 8 plain characters: Küche-0017 is che-0017",)
    path, remarks = write(write_gsi16, plan)
    assert read(path, 16)[0][0]["11"] == "Kuche-0017"


def test_names_that_open_with_zeros_are_told(write: Write) -> None:
    _, remarks = write(write_gsi8, field_plan(stations={"007": ("F0", 1.0, 2.0, 0.0, 1.5, False)}))
    assert any("zeros" in remark and "007" in remark for remark in remarks)


def test_an_unknown_instrument_height_leaves_its_word_out(write: Write) -> None:
    plan = field_plan(stations={"A": ("F0", 1.0, 2.0, 3.0, math.nan, False)})
    path, _ = write(write_gsi8, plan, instrument="sensor")
    assert "instrument" not in read(path, 8)[0][0]
    with pytest.raises(ExportError, match="instrument height of A"):
        write(write_gsi8, plan)


def test_an_unknown_unit_is_refused(write: Write, scene_plan: PlanSource) -> None:
    with pytest.raises(RequirementError, match="--gsi-unit: got 'ft'"):
        write(write_gsi16, scene_plan, gsi_unit="ft")


@pytest.mark.parametrize("width", [8, 16])
def test_geocompy_reads_the_same_points(write: Write, width: int) -> None:
    path, _ = write(WRITERS[width], field_plan(), instrument="sensor")
    text = path.read_bytes().decode("ascii").removesuffix("\r\n")
    head, *blocks = [gsiformat.GsiBlock.parse(line) for line in text.split("\r\n")]
    assert (head.blocktype, head.value) == ("code", "CRS")
    digit_m = 1e-3 if width == 8 else 1e-4
    for block, (name, (_, x, y, z, height, _)) in zip(blocks, STATIONS.items(), strict=True):
        assert block.value == name
        told = {word.wi: word.value for word in block}
        for index, value in ((81, x), (82, y), (83, z + height), (88, height)):
            assert told[index] == pytest.approx(value, abs=0.501 * digit_m)

"""DXF files, written by ezdxf or damaged by hand, as the common form of a drawing."""

import ezdxf
import numpy as np
import pytest

from planner_core.drawings.dxf import read_dxf
from planner_core.drawings.lift import lift_drawings
from planner_core.errors import SceneError, SceneNotFoundError


def saved(document, tmp_path, name="plan.dxf"):
    document.saveas(tmp_path / name)
    return str(tmp_path / name)


def test_blocks_in_blocks_are_taken_apart_with_their_layers_and_scales(tmp_path):
    document = ezdxf.new("R2010", units=6)
    inner = document.blocks.new("LEAF")
    inner.add_line((0, 0), (1, 0))
    outer = document.blocks.new("DOOR")
    outer.add_blockref("LEAF", (1, 0), dxfattribs={"rotation": 90})
    outer.add_line((0, 0), (0, 1), dxfattribs={"layer": "FRAME"})
    document.modelspace().add_blockref("DOOR", (10, 5), dxfattribs={"layer": "A-DOOR", "xscale": 2, "yscale": 2})
    drawing = read_dxf(saved(document, tmp_path))
    strokes = {drawing.layers[drawing.layer_of_stroke[n]]: drawing.stroke(n)[:, :2] for n in range(drawing.n_strokes)}
    assert strokes["A-DOOR"] == pytest.approx(np.array([(12, 5), (12, 7)]))
    assert strokes["FRAME"] == pytest.approx(np.array([(10, 5), (10, 7)]))
    assert [symbol.name for symbol in drawing.symbols] == ["DOOR", "DOOR/LEAF"]
    assert drawing.unit_m == 1.0


def test_curves_stay_near_their_circles_and_hatches_are_areas(tmp_path):
    document = ezdxf.new("R2010", units=4)
    space = document.modelspace()
    space.add_arc((100, 0), 900, 0, 90)
    space.add_spline([(0, 0), (10, 5), (20, 0)])
    hatch = space.add_hatch()
    hatch.paths.add_polyline_path([(0, 0), (5, 0), (5, 5)], is_closed=True)
    drawing = read_dxf(saved(document, tmp_path))
    arc, spline, area = (drawing.stroke(n)[:, :2] for n in range(3))
    assert np.hypot(*(arc - [100, 0]).T) == pytest.approx(900, abs=0.5)
    assert len(arc) > 8
    assert spline[0] == pytest.approx([0, 0])
    assert area[0] == pytest.approx(area[-1])
    assert drawing.fill_of_stroke.tolist() == [-1, -1, 0]


def test_layers_that_are_off_or_frozen_and_hidden_attributes_are_left_out(tmp_path):
    document = ezdxf.new("R2010", units=6)
    for name in ("ON", "OFF", "FROZEN"):
        layer = document.layers.add(name)
        document.modelspace().add_line((0, 0), (1, 0), dxfattribs={"layer": name})
        if name == "OFF":
            layer.off()
        if name == "FROZEN":
            layer.freeze()
    assert read_dxf(saved(document, tmp_path)).layers == ("ON",)


def test_sheet_is_read_where_model_space_is_empty(tmp_path):
    document = ezdxf.new("R2010")
    sheet = document.layout("Layout1")
    sheet.add_line((0, 0), (7, 0))
    sheet.add_line((0, 1), (7, 1))
    assert read_dxf(saved(document, tmp_path)).n_strokes == 2


def test_missing_external_references_are_named(tmp_path):
    document = ezdxf.new("R2010", units=6)
    document.add_xref_def("site.dwg", "SITE")
    document.modelspace().add_blockref("SITE", (0, 0))
    document.modelspace().add_line((0, 0), (1, 0))
    (line,) = read_dxf(saved(document, tmp_path)).warnings
    assert "site.dwg" in line
    assert "xbind" in line


def test_block_that_holds_itself_ends(tmp_path):
    document = ezdxf.new("R2010", units=6)
    for name, other in (("A", "B"), ("B", "A")):
        block = document.blocks.new(name)
        block.add_line((0, 0), (1, 0))
        block.add_blockref(other, (1, 0))
    document.modelspace().add_blockref("A", (0, 0))
    assert "damaged" in read_dxf(saved(document, tmp_path)).warnings[0]


@pytest.mark.parametrize(
    ("contents", "words"),
    [
        (b"AC1032\0\0\0", r"it is a DWG file.*save it as DXF"),
        (b"hello", r"ezdxf can't read it.*export it again"),
        (b"", r"the file is empty"),
        (b"  0\nSECTION\n  2\nENTITIES\n  0\nENDSEC\n  0\nEOF\n", r"no lines, expected a floor plan"),
    ],
)
def test_what_is_no_drawing_is_refused_in_one_line(tmp_path, contents, words):
    path = tmp_path / "plan.dxf"
    path.write_bytes(contents)
    with pytest.raises(SceneError, match=words):
        read_dxf(str(path))


def test_files_that_are_not_there_or_of_another_program_are_refused_before_reading(tmp_path):
    with pytest.raises(SceneNotFoundError, match="no such file"):
        lift_drawings([tmp_path / "plan.dxf"])
    (tmp_path / "plan.dwg").write_bytes(b"AC1032")
    with pytest.raises(SceneError, match="save it as DXF"):
        lift_drawings([tmp_path / "plan.dwg"])

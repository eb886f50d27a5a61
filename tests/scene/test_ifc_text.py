"""IFC files as programs really write them: lost ends, old code pages, archives, empty names as derived, old schemas.

Names in old code pages are read as they were written. Oracle: Python's codecs wrote them.
"""

from __future__ import annotations

import io
import re
import zipfile
import zlib

import numpy as np
import pytest

from planner_core.errors import SceneError
from planner_core.scene import ifc_text
from planner_core.scene.ifc_text import encoding_of, encoding_title, lost_ends, syntax_fault, with_ascii_names
from planner_core.scene.load import load_scene
from tests.reality_files import reality

# ----------------------------------------------------------------------------------------------- lost ends
LOST_AND_NOT_NEEDED = [
    "#999999=IFCWINDOWSTYLE('0123456789012345678901',$,$,$,$,(#888888,#888887),(#888886),$,.SINGLE_PANEL.,.F.,.F.);",
    "#999999=IFCOWNERHISTORY(#888888,#888887,$,.ADDED.,$,$,$,0);",
    "#999999=IFCCLASSIFICATIONREFERENCE($,'1','a',#888888);",
]
SHAPES_NEED = [
    "IFCPOLYLOOP",
    "IFCFACE",
    "IFCCLOSEDSHELL",
    "IFCSHAPEREPRESENTATION",
    "IFCPRODUCTDEFINITIONSHAPE",
    "IFCLOCALPLACEMENT",
    "IFCAXIS2PLACEMENT3D",
    "IFCDIRECTION",
    "IFCCARTESIANPOINT",
    "IFCSIUNIT",
    "IFCUNITASSIGNMENT",
    "IFCGEOMETRICREPRESENTATIONCONTEXT",
]
NAMES = {
    "cp932": ["屋根", "1階", "2階 床", "基準階", "（壁）-100", "ドア", "エレベーター", "表"],
    "gbk": ["一层", "二层 楼板", "屋顶", "墙-200", "（走廊）"],
    "big5": ["一樓", "二樓 樓板", "屋頂", "牆", "樓梯間"],
    "cp949": ["1층", "지붕", "벽 - 콘크리트", "계단실"],
    "cp1251": ["Уровень 1", "Кровля", "Стена: 400мм"],
    "cp1252": ["Erdgeschoß", "Küche", "Außenwand", "Étage", "Fenêtre", "Tür 1,01 × 2,13"],
}


def message_of(path):
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(path.name)
    return message


def with_lines(text: str, *lines: str) -> str:
    """The file with more instances at its end."""
    return text.replace("ENDSEC;\nEND-ISO", "".join(f"{line}\n" for line in lines) + "ENDSEC;\nEND-ISO")


@pytest.fixture
def house_text(tmp_path, write_house) -> str:
    return write_house(tmp_path, "four.ifc").read_text()


@pytest.mark.parametrize("line", LOST_AND_NOT_NEEDED)
def test_lost_end_that_no_shape_needs_is_counted_and_told(tmp_path, house_text, line):
    path = tmp_path / "lost.ifc"
    path.write_text(with_lines(house_text, line))
    scene = load_scene(path)
    assert scene.n_triangles == 48
    n_lost = len(re.findall("#8888", line))
    kind = re.search(r"IFC\w+", line).group()
    (told,) = (w for w in scene.report.warnings if "not in the file" in w)
    assert f"#999999 ({kind}) names #888888" in told
    assert (f"{n_lost} references lead" if n_lost > 1 else "a reference leads") in told


@pytest.mark.parametrize("kind", SHAPES_NEED)
def test_lost_end_that_a_shape_needs_is_refused(tmp_path, house_text, kind):
    """IfcOpenShell 0.9 ends the process on most of them, and makes metres of a lost unit."""
    lines = re.findall(rf"#\d+={kind}\([^\n]*\n", house_text)
    path = tmp_path / "lost.ifc"
    path.write_text(house_text.replace(lines[-1], ""))
    assert "which is not in the file; it is damaged" in message_of(path)


@pytest.mark.parametrize("relation", ["IFCRELAGGREGATES", "IFCRELCONTAINEDINSPATIALSTRUCTURE"])
def test_part_of_a_lost_whole_is_loaded(tmp_path, house_text, write_house, relation):
    proxies = re.findall(r"#(\d+)=IFCBUILDINGELEMENTPROXY", house_text)
    parts = ",".join(f"#{number}" for number in proxies)
    ends = f"#888888,({parts})" if relation == "IFCRELAGGREGATES" else f"({parts}),#888888"
    text = re.sub(r"#\d+=IFCRELCONTAINED[^\n]*\n", "", house_text)
    path = tmp_path / "lost.ifc"
    path.write_text(with_lines(text, f"#999999={relation}('0123456789012345678901',$,$,$,{ends});"))
    scene = load_scene(path)
    assert scene.n_triangles == 48
    assert {element.storey for element in scene.elements} == {-1}


def test_lost_end_is_needed_by_what_leads_to_it():
    """#1 a product with placement #2, type #5; #2 names #3, which names the lost #4."""
    text = b"#1=IFCWALL('a',#7,$,$,$,#2,$,$);#2=IFCLOCALPLACEMENT($,#3);#3=IFCX((#4));#5=IFCWALLTYPE(#6);"
    needed, others = lost_ends(text, {1})
    assert [(end.instance, end.missing) for end in needed] == [(3, 4)]
    assert [(end.instance, end.missing) for end in others] == [(1, 7), (5, 6)]
    assert lost_ends(text, set())[0] == []


@pytest.mark.slow
def test_real_frame_with_a_lost_window_style_is_loaded(corpus_file):
    scene = load_scene(corpus_file("ifc-structural-frame-revit2021.ifc"))
    assert len(scene.elements) == 115
    assert any("4 references lead" in warning and "IFCWINDOWSTYLE" in warning for warning in scene.report.warnings)


# ------------------------------------------------------------------------------------------ derived names
def test_product_with_an_empty_name_written_as_derived_has_its_surface(tmp_path, house_text):
    path = tmp_path / "derived.ifc"
    text, n_changed = re.subn(r"(IFCBUILDINGELEMENTPROXY\('[^']*',)\$,'\w+',\$,\$", r"\g<1>$,*,*,*", house_text)
    assert n_changed == 4
    path.write_text(text)
    scene = load_scene(path)
    assert scene.n_triangles == 48
    assert scene.report.warnings == ()


@pytest.mark.slow
def test_real_house_by_renga_has_all_its_surfaces(corpus_file):
    """It writes * for every empty attribute; 83 of its 134 products were lost, with all slabs."""
    scene = load_scene(corpus_file("ifc-house-renga.ifc"))
    assert len(scene.elements) == 134
    assert not any("no surface" in warning for warning in scene.report.warnings)


# -------------------------------------------------------------------------------------------------- names
@pytest.mark.parametrize(
    ("encoding", "names"),
    [
        ("cp932", ["1階 床", "表ソ", "屋根", "ドア"]),  # the second has bytes of the backslash
        ("gbk", ["一层", "楼板", "屋顶", "墙"]),
        ("latin-1", ["Küche", "Außenwand", "Erdgeschoß", "Tür"]),
        ("utf-8", ["Küche", "屋根", "Кровля", "𠮷"]),
    ],
)
def test_names_in_an_old_code_page_are_read(tmp_path, house_text, encoding, names):
    path = tmp_path / "names.ifc"
    text = house_text
    for old, new in zip(("Slab", "Wall", "Pier", "Roof"), names, strict=True):
        text = text.replace(f"'{old}'", f"'{new}'")
    path.write_bytes(text.replace("'Ground'", f"'{names[0]}'").encode(encoding))
    scene = load_scene(path)
    assert [element.name for element in scene.elements] == names
    assert scene.storeys[0].name == names[0]
    told = [warning for warning in scene.report.warnings if "taken for" in warning]
    assert len(told) == (encoding != "utf-8")


@pytest.mark.parametrize(
    ("written", "read"),
    [
        (r"C:\dir\new", r"C:\dir\new"),
        (r"Wall \ B", r"Wall \ B"),
        ("end\\", "end\\"),
        (r"K\X\FCche \d", r"Küche \d"),
        (r"\X2\5899\X0\ \q", r"墙 \q"),
    ],
)
def test_backslash_that_begins_no_escape_is_a_character(tmp_path, house_text, written, read):
    path = tmp_path / "names.ifc"
    path.write_text(house_text.replace("'Wall'", f"'{written}'"))
    assert read in [element.name for element in load_scene(path).elements]


def escaped_bytes(text, encoding):
    """A string as programs write it that escape the bytes of their code page one by one."""
    low = {ord("\\"): r"\\"}
    return "".join(
        low.get(b, chr(b)) if b < 0x80 else rf"\S\{chr(b - 0x80)}" if b >= 0xA0 else rf"\X\{b:02X}"
        for b in text.encode(encoding)
    ).encode()


def test_names_whose_bytes_are_escaped_one_by_one_are_read():
    names = [
        "1階",
        "2階",
        "屋根",
        "事務所の表",
        "コンクリート-構造2",
        "透明ガラス",
        "a\\階",
    ]  # 表, 構: a backslash; 透: an apostrophe
    line = b"#1=IFCBUILDINGSTOREY('%s');\n"
    text = b"".join(line % escaped_bytes(name, "cp932") for name in names)
    found, phrase = with_ascii_names(text)
    expected = "".join("#1=IFCBUILDINGSTOREY('{}');\n".format(name.replace("\\", r"\\")) for name in names)
    decoded = re.sub(
        r"\\X2\\([0-9A-F]+)\\X0\\", lambda m: bytes.fromhex(m[1]).decode("utf-16-be"), found.decode("ascii")
    )
    assert decoded == expected
    assert "Shift-JIS" in phrase


def test_letters_of_iso_8859_are_left_to_the_reader():
    text = rb"#1=IFCWALL('T\X\FCr \S\d');"
    assert with_ascii_names(text) == (text, "")


def test_ascii_text_stays_as_it_is(house_text):
    text = house_text.encode()
    assert with_ascii_names(text) == (text, "")
    comment = "/* Küche */".encode("latin-1") + text
    assert with_ascii_names(comment) == (comment, "")


# --------------------------------------------------------------------------------------- archives and XML
def zipped(path, members: dict[str, bytes]):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, contents in members.items():
            archive.writestr(name, contents)
    return path


def test_archive_gives_the_scene_of_its_file(tmp_path, house_text):
    plain = tmp_path / "house.ifc"
    plain.write_text(house_text)
    packed = zipped(
        tmp_path / "house.ifczip",
        {"a/House.IFC": house_text.encode(), "readme.txt": b"-", "__MACOSX/a/._House.ifc": b"-"},
    )
    one, other = load_scene(plain), load_scene(packed)
    assert np.array_equal(one.vertices_m, other.vertices_m)
    assert np.array_equal(one.triangles, other.triangles)
    assert one.elements == other.elements
    assert (one.source.format, other.source.format) == ("ifc", "ifc")


@pytest.mark.slow
def test_real_archive_gives_the_scene_of_its_twin(corpus_file):
    name = "ifc-schependomlaan-staal-archicad18"
    one, other = (load_scene(corpus_file(f"{name}.{extension}")) for extension in ("ifc", "ifczip"))
    assert np.array_equal(one.vertices_m, other.vertices_m)
    assert np.array_equal(one.triangles, other.triangles)
    assert (one.elements, one.storeys) == (other.elements, other.storeys)


@pytest.mark.parametrize(
    ("members", "expected"),
    [
        ({}, "has 0 IFC files"),
        ({"a.txt": b"-"}, "has 0 IFC files"),
        ({"a.ifc": b"-", "b.ifc": b"-"}, "has 2 IFC files (a.ifc, b.ifc), expected one"),
        ({"a.ifc": b"hello"}, "not an IFC file: it begins with the text 'hello'"),
        ({"a.ifcxml": b"<?xml version='1.0'?><ifc:ifcXML/>"}, "it is ifcXML, which is not read"),
    ],
)
def test_archive_without_one_ifc_file_says_so(tmp_path, members, expected):
    path = zipped(tmp_path / "a.ifczip", {"x": b"", **members})
    assert expected in message_of(path)


def test_archive_of_too_much_is_not_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr(ifc_text, "MAX_UNPACKED_BYTES", 1000)
    path = zipped(tmp_path / "bomb.ifczip", {"a.ifc": b" " * 1001})
    assert "which is not unpacked" in message_of(path)


def test_archive_that_lies_about_its_size_is_refused(tmp_path):
    """The directory says 10 bytes where there are a million."""
    contents = io.BytesIO()
    with zipfile.ZipFile(contents, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.ifc", b" " * 1_000_000)
    size = (1_000_000).to_bytes(4, "little")
    path = tmp_path / "liar.ifczip"
    path.write_bytes(contents.getvalue().replace(size, (10).to_bytes(4, "little")))
    assert "can't be unpacked" in message_of(path)


def test_damaged_archive_is_refused(tmp_path, house_text):
    whole = zipped(tmp_path / "a.ifczip", {"a.ifc": house_text.encode()}).read_bytes()
    path = tmp_path / "b.ifczip"
    for at in range(4, len(whole), len(whole) // 5):
        path.write_bytes(whole[:at])
        assert "can't be unpacked" in message_of(path)
    broken = bytearray(whole)
    broken[60:90] = bytes(30)
    path.write_bytes(broken)
    assert "can't be unpacked" in message_of(path)
    assert zlib.crc32(whole) != zlib.crc32(bytes(broken))


@pytest.mark.parametrize("name", ["model.ifcxml", "model.ifc"])
def test_xml_says_what_to_do(tmp_path, name):
    path = tmp_path / name
    path.write_text('<?xml version="1.0"?>\n<ifcXML xmlns="http://www.buildingsmart-tech.org/ifcXML/IFC4/final"/>')
    message = message_of(path)
    assert "it is ifcXML, which is not read" in message
    assert "export the model as .ifc" in message


# ------------------------------------------------------------------------------------------------ schemas
@pytest.mark.parametrize("schema", ["IFC2X", "IFC2X_FINAL", "IFC2X2_FINAL", "IFC2X2", "IFC20_LONGFORM"])
def test_schema_that_is_too_old_says_what_to_do(tmp_path, house_text, schema):
    path = tmp_path / "old.ifc"
    path.write_text(re.sub(r"FILE_SCHEMA\(\('\w+'\)\)", f"FILE_SCHEMA(('{schema}'))", house_text))
    message = message_of(path)
    assert f"it is {schema}, a schema of before 2006" in message
    assert "export it as IFC2X3" in message


def test_number_with_two_points_is_named_with_its_line():
    with pytest.raises(SceneError) as caught:
        load_scene(reality("number_with_two_points.ifc"))
    assert str(caught.value) == (
        "number_with_two_points.ifc, line 34, #27: '5.0.' is no STEP syntax; correct it, or export the file again."
    )


@pytest.mark.parametrize(
    ("was", "becomes", "instance", "token"),
    [
        (".METRE.", ".METRE", "#1", ".METRE"),
        ("(0.,0.,1.)", "(0.,0.,1,5)x", "#3", "x"),
        ("(0.,0.,1.)", "(0.,,1.)", "#3", ","),
        ("(0.,0.,1.)", "(0.;0.;1.)", "#3", ";"),
        ("(0.,0.,1.)", "(0.,0.,1.))", "#3", ")"),
        ("(0.,0.,1.)", "(0.,0.,1.5E+)", "#3", "1.5E+"),
        ("(0.,0.,1.)", "(0,0.,NaN)", "#3", ")"),
        ("'a; (b'", "'a", "#2", "'"),
        ("#3=", "3=", "#2", "3"),
        ("#3=", "#3", "#3", "#3IFCDIRECTION"),
    ],
)
def test_syntax_fault_names_line_instance_and_token(was, becomes, instance, token):
    lines = [
        "ISO-10303-21;", "HEADER;", "ENDSEC;", "DATA;", "#1=IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.);",
        "#2=IFCLABEL('a; (b');", "#3=IFCDIRECTION((0.,0.,1.));", "#4=IFCX(IFCREAL(1.E-3),(),\"0F\",#3,/* ( */-5);",
        "ENDSEC;", "END-ISO-10303-21;",
    ]  # fmt: skip
    text = "\n".join(lines)
    assert syntax_fault(text.encode()) == ""
    assert was in text
    number = int(instance.removeprefix("#")) + 4
    line = number + (was == "#3=" and becomes == "3=")
    fault = syntax_fault(text.replace(was, becomes).encode())
    assert fault == f"line {line}, {instance}: {token!r} is no STEP syntax"


@pytest.mark.parametrize(("encoding", "names"), NAMES.items())
def test_names_of_a_file_are_read_back(encoding, names):
    raw = [name.encode(encoding) for name in names]
    found = encoding_of(raw)
    assert [text.decode(found) for text in raw] == names
    assert encoding_title(found)


@pytest.mark.parametrize(
    ("encoding", "name"), [("cp932", "屋根"), ("gbk", "一层"), ("big5", "屋頂"), ("cp1252", "Küche")]
)
def test_one_name_suffices(encoding, name):
    raw = name.encode(encoding)
    assert raw.decode(encoding_of([raw])) == name


@pytest.mark.parametrize("names", NAMES.values())
def test_utf_8_goes_first(names):
    assert encoding_of([name.encode() for name in names]) == "utf-8"


def test_any_bytes_can_be_read():
    raw = bytes(range(256))
    assert raw.decode(encoding_of([raw]))

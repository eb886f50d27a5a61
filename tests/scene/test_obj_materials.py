"""What OBJ says of glass and mirrors: names of materials, and figures of its library."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.model import Optics
from planner_core.scene.load import LoadOptions, load_scene

RETURNS, PASSES, STOPS = Optics.RETURNS, Optics.PASSES, Optics.STOPS


def write_obj(folder: Path, uses: list[str], library: str | bytes | None = None, *, line: str = "mtllib a.mtl") -> Path:
    """A triangle a use, each a metre above the last."""
    lines = [line]
    for i, use in enumerate(uses):
        lines += [use, *(f"v {x} {y} {i}" for x, y in ((0, 0), (1, 0), (0, 1))), "f -3 -2 -1"]
    path = folder / "a.obj"
    path.write_text("\n".join(lines) + "\n")
    if library is not None:
        (folder / "a.mtl").write_bytes(library.encode() if isinstance(library, str) else library)
    return path


def optics_of(path: Path) -> list[int]:
    scene = load_scene(path)
    return [0] * scene.n_triangles if scene.optics_of_triangle is None else scene.optics_of_triangle.tolist()


def test_obj_names_of_materials_say_it_without_a_library(tmp_path: Path) -> None:
    uses = ["", "usemtl Glas klar", "g Frame", "usemtl Holz", "o Other", "usemtl Spiegel", "usemtl"]
    path = write_obj(tmp_path, uses)
    assert optics_of(path) == [0, PASSES, PASSES, 0, 0, STOPS, 0]
    (warning,) = load_scene(path).report.warnings
    assert "no material was read from its material library" in warning


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        ("d 0.3", PASSES), ("d 0.8", RETURNS), ("d 1", RETURNS), ("Tr 0.7", PASSES), ("Tr 0.2", RETURNS),
        ("Tr 1.0", RETURNS), ("d 0.2\nTr 0", PASSES), ("Tr 0\nd 0.2", PASSES), ("d 1\nTr 0.9", RETURNS),
        ("Pm 1\nPr 0", STOPS), ("Pm 1\nPr 0.4", RETURNS), ("illum 3\nKd 1 1 1", RETURNS),
        ("\td\t0.3 # clear", PASSES), ("d -halo 0.1", RETURNS), ("d much", RETURNS), ("d", RETURNS), ("d nan", RETURNS),
    ],
)  # fmt: skip
def test_obj_figures_of_the_library_say_it_where_the_name_does_not(lines: str, told: Optics, tmp_path: Path) -> None:
    library = f"# made for a test\nnewmtl other\nd 0.1\nnewmtl M 1\n{lines}\nnewmtl M 1\nd 0.1\n"
    assert optics_of(write_obj(tmp_path, ["usemtl M 1"], library)) == [told]


def test_obj_name_comes_before_the_figures(tmp_path: Path) -> None:
    library = "newmtl Frosted glass\nd 0.1\nnewmtl Glass\nd 1\n"
    assert optics_of(write_obj(tmp_path, ["usemtl Frosted glass", "usemtl Glass"], library)) == [RETURNS, PASSES]


def test_obj_library_may_begin_with_a_byte_order_mark(tmp_path: Path) -> None:
    library = b"\xef\xbb\xbfnewmtl M1\r\nd 0.1\r\n"
    assert optics_of(write_obj(tmp_path, ["usemtl M1"], library)) == [PASSES]


def test_obj_polygons_and_dropped_faces_keep_their_materials(tmp_path: Path) -> None:
    corners = "".join(f"v {x} {y} {z}\n" for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
    text = corners + "usemtl Glass\nf 1 2 3 4\nf 1 2\nf 1 2 99\nusemtl Wood\nf 5 6 7 8\nusemtl Mirror\nf 1 2 6 5\n"
    (tmp_path / "a.obj").write_text(text)
    scene = load_scene(tmp_path / "a.obj", options=LoadOptions(skip_bad_faces=True))
    assert scene.optics_of_triangle is not None
    assert scene.optics_of_triangle.tolist() == [PASSES, PASSES, 0, 0, STOPS, STOPS]


@pytest.mark.parametrize(
    "line", ["mtllib a.mtl", "mtllib ./a.mtl", "mtllib .\\a.mtl", "mtllib other.mtl a.mtl", "mtllib sub/../a.mtl"]
)
def test_obj_library_is_found_beside_it(line: str, tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    assert optics_of(write_obj(tmp_path, ["usemtl M1"], "newmtl M1\nd 0.1\n", line=line)) == [PASSES]


def test_obj_library_may_have_blanks_in_its_name(tmp_path: Path) -> None:
    (tmp_path / "my house.mtl").write_text("newmtl M1\nd 0.1\n")
    assert optics_of(write_obj(tmp_path, ["usemtl M1"], line="mtllib my house.mtl")) == [PASSES]


@pytest.mark.parametrize("kind", ["parent", "absolute", "link"])
def test_obj_library_outside_its_folder_is_not_read(kind: str, tmp_path: Path) -> None:
    folder = tmp_path / "model"
    folder.mkdir()
    outside = tmp_path / "secret.mtl"
    outside.write_text("newmtl M1\nd 0.1\n")
    (folder / "link.mtl").symlink_to(outside)
    name = {"parent": "../secret.mtl", "absolute": str(outside), "link": "link.mtl"}[kind]
    path = write_obj(folder, ["usemtl M1"], line=f"mtllib {name}")
    assert optics_of(path) == [RETURNS]
    (warning,) = load_scene(path).report.warnings
    assert warning == f"a.obj: its material library {name} is outside its folder and was not read."


def test_obj_library_too_large_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from planner_core.scene import obj

    monkeypatch.setattr(obj, "_LARGEST_BYTES", 2**20)
    path = write_obj(tmp_path, ["usemtl M1"], b"newmtl M1\nd 0.1\n" + b"#" * 2**20)
    assert optics_of(path) == [RETURNS]
    (warning,) = load_scene(path).report.warnings
    assert warning.startswith("a.obj: its material library a.mtl was not read: libraries of more than 1 MiB")


@pytest.mark.parametrize("name", ["", "missing.mtl", ".", "a\x00b.mtl", "x" * 5000, "\n"])
def test_obj_library_that_is_no_file_is_no_error(name: str, tmp_path: Path) -> None:
    assert optics_of(write_obj(tmp_path, ["usemtl Glass"], line="v 0 0 9\n" * 1000 + f"mtllib {name}")) == [PASSES]


def test_obj_that_names_many_libraries_has_the_first_hundred_read(tmp_path: Path) -> None:
    lines = "\n".join(f"mtllib {i}.mtl" for i in range(250))
    path = write_obj(tmp_path, ["usemtl Glass"], line=lines)
    assert load_scene(path).report.warnings[0] == "a.obj names 250 material libraries: 100 were read."


@given(library=st.binary(max_size=300))
def test_obj_library_of_any_bytes_leaves_the_scene_whole(
    library: bytes, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.getbasetemp() / "any-library"
    folder.mkdir(exist_ok=True)
    path = write_obj(folder, ["usemtl M1", "usemtl Mirror"], b"newmtl M1\n" + library)
    assert optics_of(path)[1] == STOPS

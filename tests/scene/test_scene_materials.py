"""What names and figures of materials say of glass and mirrors; what each format says: test_<format>_materials.py."""

import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import scenes_synthetic
from planner_core.model import Optics, Scene
from planner_core.scene.load import LoadOptions, load_scene
from planner_core.scene.materials import optics_of_material, optics_of_metal, optics_of_name, optics_of_transparency

RETURNS, PASSES, STOPS = Optics.RETURNS, Optics.PASSES, Optics.STOPS


# ------------------------------------------------------------------------------------------------------- names
NAMES = {
    PASSES: [
        "Glass", "glass", "GLASS", "Glass - Clear, Grey", "Glas", "Glas - klar", "Isolierglas", "Verglasung",
        "Dreifach-Verglasung", "Isolierverglasung", "ClearGlass", "M_Glass_01", "glassPane", "window_glass.001",
        "Glazing", "double glazing", "Plexiglass", "verre", "Double vitrage", "vitre de la fen\u00eatre", "Vetro",
        "vetrocamera",
        "Vidrio", "cristal", "vidro temperado", "beglazing", "Veiligheidsglas", "Panssarilasi lasi",
        "Szk\u0142o hartowane", "sklo",
        "Glass No 5", "MAT_Glass", "glas, isolering 4-16-4",
    ],
    STOPS: [
        "Mirror", "mirror_01", "Spiegel", "Wandspiegel", "Kristallspiegel", "miroir", "Specchio", "espejo",
        "Espelho", "spegel",
        "Mirror glass", "mirrored glass", "Glas verspiegelt", "Glass, silvered", "MIRROR",
    ],
    RETURNS: [
        "Glass wool", "glasswool", "Glaswolle", "Glaswol", "Fibreglass", "fiberglass", "Fiberglas", "glass fibre mat",
        "Glasfasertapete", "laine de verre", "lana di vetro", "lana de vidrio", "l\u00e3 de vidro", "fibra de vidrio",
        "Glass block", "Glass Brick", "Glasbausteine", "pav\u00e9 de verre", "Frosted glass", "FrostedGlass",
        "satin glass",
        "Milk glass", "Milchglas", "Opalglas", "verre d\u00e9poli", "vetro satinato", "opaque glass",
        "Spandrel Glass",
        "painted mirror", "Glass frame", "mirror frame", "Schaumglas", "foam glass", "glass mosaic tile",
        "glass fibre concrete",
    ],
    None: [
        "", "Wood", "Douglas", "Douglas fir", "DOUGLAS-FIR", "Glasgow stone", "Wasserspiegel", "PEN_MATERIAL12",
        "chair mirrored",
        "Satin chrome", "Milk", "Brushed steel", "Concrete", "glassy", "Stainless", "plaster", "Spiegelei",
        "Mirrorless", "\u00e9\u00e8\u00ea", "123",
    ],
}  # fmt: skip


def test_name_of_a_material_tells_what_its_surface_does() -> None:
    expected = {name: optics for optics, names in NAMES.items() for name in names}
    assert {name: optics_of_name(name) for name in expected} == expected


@given(st.text(max_size=60))
def test_no_name_is_too_odd_to_be_asked(name: str) -> None:
    assert optics_of_name(name) in (None, *Optics)


@given(st.text(alphabet=st.characters(categories=("Nd", "Po", "Zs")), max_size=8))
def test_digits_and_signs_around_a_word_change_nothing(noise: str) -> None:
    for word in ("glass", "Spiegel", "wood", "Milchglas"):
        assert optics_of_name(f"{noise}{word}{noise}") is optics_of_name(word)


@given(st.sampled_from([name for names in NAMES.values() for name in names]))
def test_case_of_letters_changes_nothing(name: str) -> None:
    if not re.search("[a-z][A-Z]", name):  # a hump is a gap between words
        assert optics_of_name(name.upper()) is optics_of_name(name.lower()) is optics_of_name(name)


def test_a_name_as_long_as_a_file_is_looked_at_in_no_time() -> None:
    assert optics_of_name("glass " * 10**6) is PASSES


# ----------------------------------------------------------------------------------------------------- figures
@pytest.mark.parametrize(
    ("transparency", "told"),
    [(None, None), (math.nan, None), (0.0, RETURNS), (0.49, RETURNS), (0.5, PASSES), (1.0, PASSES), (math.inf, PASSES)],
)
def test_half_the_light_let_through_passes(transparency: float | None, told: Optics | None) -> None:
    assert optics_of_transparency(transparency) is told


@pytest.mark.parametrize(
    ("metallic", "roughness", "told"),
    [
        (1.0, 0.0, STOPS), (0.95, 0.05, STOPS), (0.94, 0.0, RETURNS), (1.0, 0.06, RETURNS), (0.0, 0.0, RETURNS),
        (None, 0.0, None), (1.0, None, None), (math.nan, 0.0, None), (1.0, math.nan, None),
    ],
)  # fmt: skip
def test_smooth_metal_is_a_mirror(metallic: float | None, roughness: float | None, told: Optics | None) -> None:
    assert optics_of_metal(metallic, roughness) is told


def test_names_come_before_figures_and_the_first_name_that_speaks_before_others() -> None:
    assert optics_of_material(["Milchglas"], transparency=0.9) is RETURNS
    assert optics_of_material(["Glass"], transparency=0.0) is PASSES
    assert optics_of_material(["Surface 7", "Mirror", "Glass"], transparency=0.9) is STOPS
    assert optics_of_material(["Surface 7"], transparency=0.9) is PASSES
    assert optics_of_material(["Surface 7"], transparency=0.9, metallic=1.0, roughness=0.0) is PASSES
    assert optics_of_material(["Surface 7"], transparency=0.1, metallic=1.0, roughness=0.0) is STOPS
    assert optics_of_material(["Surface 7"], transparency=0.1) is RETURNS
    assert optics_of_material(["Surface 7"]) is None
    assert optics_of_material([]) is None


# ---------------------------------------------------------------------------------------------- synthetic scenes
@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".ifc", ".glb", ".usda", ".usdc", ".obj"])
def test_every_format_with_materials_brings_back_the_same_glass_and_mirror(suffix: str, tmp_path: Path) -> None:
    synthetic = scenes_synthetic.build("glass-and-mirror")
    scene = load_scene(scenes_synthetic.write(synthetic, tmp_path / f"scene{suffix}"))
    assert scene.optics_of_triangle is not None and synthetic.scene.optics_of_triangle is not None
    told = {re.split(r"[/]", element.name)[-1].replace("_", " "): set() for element in scene.elements}
    for element, optics in zip(scene.element_of_triangle, scene.optics_of_triangle, strict=True):
        told[re.split(r"[/]", scene.elements[element].name)[-1].replace("_", " ")].add(int(optics))
    wanted = {part.name: {0} for part in synthetic.parts} | {"Glass wall": {PASSES}, "Mirror": {STOPS}}
    assert told == wanted
    assert {name for name, optics in told.items() if optics != {0}} == set(synthetic.truth.returns_nothing)
    assert area_m2(scene).tolist() == pytest.approx(area_m2(synthetic.scene).tolist(), rel=1e-5)


def area_m2(scene: Scene) -> np.ndarray:
    """Area of what returns, passes, stops."""
    a, b, c = (scene.vertices_m[scene.triangles[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return np.bincount(scene.optics_of_triangle, area, minlength=3)


def test_scene_in_memory_has_the_optics_of_its_parts() -> None:
    synthetic = scenes_synthetic.build("glass-and-mirror")
    area = area_m2(synthetic.scene)
    # A box of 0.02 x 3.6 x 2.7 m and one of 2 x 0.01 x 1.6 m.
    assert area[PASSES] == pytest.approx(2 * (0.02 * 3.6 + 3.6 * 2.7 + 0.02 * 2.7))
    assert area[STOPS] == pytest.approx(2 * (2 * 0.01 + 2 * 1.6 + 0.01 * 1.6))


def test_scene_without_materials_has_no_optics() -> None:
    assert scenes_synthetic.build("thin-walls").scene.optics_of_triangle is None


@pytest.mark.parametrize("suffix", [".ply", ".stl"])
def test_formats_without_materials_say_nothing(suffix: str, tmp_path: Path) -> None:
    path = scenes_synthetic.write(scenes_synthetic.build("glass-and-mirror"), tmp_path / f"scene{suffix}")
    assert load_scene(path).optics_of_triangle is None


@pytest.mark.parametrize(("glass", "counts"), [("pass", (12, 12)), ("stop", (0, 24)), ("return", (0, 12))])
def test_option_glass_says_what_panes_do_and_leaves_mirrors(
    glass: str, counts: tuple[int, int], tmp_path: Path
) -> None:
    path = scenes_synthetic.write(scenes_synthetic.build("glass-and-mirror"), tmp_path / "scene.obj")
    scene = load_scene(path, options=LoadOptions(glass=glass))
    optics = scene.optics_of_triangle
    assert optics is not None
    assert ((optics == PASSES).sum(), (optics == STOPS).sum()) == counts


# --------------------------------------------------------------------------------------------------- real models
def areas_by_kind(scene: Scene) -> dict[str, list[float]]:
    """By IFC class with glass: square metres that return and that pass."""
    assert scene.optics_of_triangle is not None
    a, b, c = (scene.vertices_m[scene.triangles[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    kinds = np.array([element.kind for element in scene.elements])[scene.element_of_triangle]
    found = {
        str(kind): np.bincount(scene.optics_of_triangle[kinds == kind], area[kinds == kind], minlength=2).tolist()
        for kind in np.unique(kinds)
    }
    return {kind: areas for kind, areas in found.items() if areas[1]}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "wanted"),
    [
        ("duplex", {"IfcDoor": [80.33, 5.47], "IfcWindow": [154.19, 114.4], "IfcFurnishingElement": [452.45, 7.56]}),
        pytest.param("fzk-haus", {"IfcDoor": [27.92, 7.08], "IfcWindow": [36.95, 34.06]}, marks=pytest.mark.slow),
    ],
)
def test_real_windows_have_panes_that_pass_and_frames_that_return(
    name: str, wanted: dict[str, list[float]], real_scene: Callable[[str], Scene]
) -> None:
    """Areas of both faces of each pane; duplex's furniture with glass is its tables."""
    scene = real_scene(name)
    found = areas_by_kind(scene)
    assert found == {kind: pytest.approx(areas, abs=0.02) for kind, areas in wanted.items()}
    optics = scene.optics_of_triangle
    assert optics is not None
    windows = [e for e, element in enumerate(scene.elements) if element.kind == "IfcWindow"]
    told = [set(optics[scene.element_of_triangle == e].tolist()) for e in windows]
    assert sum(PASSES in one for one in told) > len(windows) / 2
    assert all(RETURNS in one for one in told)

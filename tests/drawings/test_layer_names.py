"""Names of layers and blocks in six languages."""

from pathlib import Path

import pytest

from planner_core.drawings.layer_names import Kind, kind_of_name, layer_patterns, patterns_by_kind
from planner_core.errors import SceneError
from planner_core.requirements.yaml_or_json import read_document

PAGE = Path(__file__).resolve().parents[2] / "docs" / "formats" / "layers.md"


@pytest.mark.parametrize(
    ("kind", "names"),
    [
        (Kind.WALL, "A-WALL-FULL Wände_tragend AUSSENWAND mur_porteur CLOISONS Muros 02-TABIQUES Стены 墙体 S-COLS"),
        (Kind.DOOR, "A-DOOR Innentüren TUER Haustür Portes PUERTAS Двери 门 DOOR_900"),
        (Kind.WINDOW, "A-GLAZ Fenster FENÊTRE Ventanas Окна 窗 A-WALL-CURT"),
        (Kind.STAIR, "A-FLOR-STRS Treppe escalier ESCALERA Лестница 楼梯"),
        (Kind.IGNORED, "A-FURN Möbel mobilier Mueble Мебель 家具 A-WALL-DEMO DIMENSIONS Achsen outdoor"),
        (Kind.TEXT, "A-AREA-IDEN A-DOOR-IDEN A-ANNO-TEXT Beschriftung"),
        (Kind.UNKNOWN, "0 STRUCTURE Layer1 textur"),
    ],
)
def test_kind_follows_the_words_of_the_field(kind: Kind, names: str) -> None:
    assert {name: kind_of_name(name) for name in names.split()} == dict.fromkeys(names.split(), kind)


def test_patterns_of_the_user_come_first() -> None:
    patterns = layer_patterns(["ignored=a-wall-old*", "wall=LAYER1"])
    assert kind_of_name("A-WALL-OLD-2", patterns) == Kind.IGNORED
    assert kind_of_name("Layer1", patterns) == Kind.WALL
    assert kind_of_name("A-WALL", patterns) == Kind.WALL


@pytest.mark.parametrize("text", ["A-WALL", "walls=A-WALL", "wall=", "unknown=A-WALL"])
def test_pattern_without_kind_is_refused(text: str) -> None:
    with pytest.raises(SceneError, match=r"expected KIND=PATTERN with a kind of wall, door"):
        layer_patterns([text])


def test_office_file_gives_kinds_in_its_order() -> None:
    patterns = patterns_by_kind({"Ignored": ["L-0?-old"], "wall": [" L-0* ", "_1"], "door": "TR*"}, "office.yaml: ")
    assert list(patterns.items()) == [
        ("L-0?-old", Kind.IGNORED), ("L-0*", Kind.WALL), ("_1", Kind.WALL), ("TR*", Kind.DOOR),
    ]  # fmt: skip
    assert kind_of_name("L-01-OLD", patterns) == Kind.IGNORED


def test_example_of_the_page_is_an_office_file(tmp_path: Path) -> None:
    file = tmp_path / "office.yaml"
    file.write_text(PAGE.read_text(encoding="utf-8").partition("```yaml\n")[2].partition("```")[0], encoding="utf-8")
    patterns = patterns_by_kind(read_document(file, of="layers"), "")
    assert set(patterns.values()) == set(Kind) - {Kind.UNKNOWN}
    assert [kind_of_name(name, patterns) for name in ("l-01-ext", "A_COQUE", "L-9X")] == ["wall", "wall", "ignored"]


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ({"walls": ["A"]}, "office.yaml: got the kind 'walls', expected one of wall, door"),
        ({"wall": []}, r"office.yaml: wall: got \[\], expected names or patterns"),
        ({"wall": ["A", 7]}, "put numbers in quotes"),
        ({"wall": {"A": "B"}}, "expected names or patterns"),
        ({"wall": ["A"], "door": "A"}, "office.yaml: door: got 'A' as wall, too"),
    ],
)
def test_office_file_that_makes_no_sense_is_refused(entries: dict[str, object], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        patterns_by_kind(entries, "office.yaml: ")

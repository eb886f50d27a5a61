"""Names of layers and blocks in six languages."""

import pytest

from planner_core.drawings.layer_names import Kind, kind_of_name, layer_patterns
from planner_core.errors import SceneError


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

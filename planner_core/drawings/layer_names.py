"""What layers and blocks of a drawing hold, by their names in six languages: English, German, French, Spanish, Russian,
Chinese; and by patterns of the user, which come first.

Offices name layers freely, but nearly all names hold the field's word: `A-WALL-FULL`, `Wände_tragend`, `02 TABIQUES`.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from enum import StrEnum
from fnmatch import fnmatchcase

from planner_core.errors import SceneError, shortened


class Kind(StrEnum):
    """What strokes are of."""

    WALL = "wall"
    DOOR = "door"
    WINDOW = "window"
    STAIR = "stair"
    ROOM = "room"
    TEXT = "text"
    """Names of rooms may be among its texts; its lines are none of the building."""
    IGNORED = "ignored"
    """Dimensions, axes, furniture, what lies above the cut or is torn down."""
    UNKNOWN = "unknown"


#: Words by kind, in the order of the search. `=` before a word: a whole part of the name; `<`: its beginning; `>`: its
#: end; nothing: anywhere. Parts are separated by what is no letter; marks over letters are taken off.
_WORDS: tuple[tuple[Kind, str], ...] = (
    (
        Kind.IGNORED,
        "=dim =dims =demo =hdr =head =lintel =sturz =rcp =grid =grids =axis =axes <achs =defpoints "
        "<dimension <bemass <vermass <cota <cotes <abbruch <demol <furn <mobel <moebel <mobili <mueble "
        "<meuble =symb =stem <footer <footing <foundation <fundament <overhead <station indoor outdoor <wandverk "
        "<jalous <sanitar <plumb мебел размер =оси снос 家具 尺寸 标注 轴",
    ),
    (Kind.TEXT, "=iden =anno =text =texte =texts <beschrift <label <tag =tags надпис 文字"),
    (
        Kind.WINDOW,
        "window <glaz =glas =glass <verglas <curt fenster fenetre <vitr =fen <venta =win окн окон остекл 窗 幕墙 玻璃",
    ),
    (
        Kind.DOOR,
        "door tuer =tur <turen <turb >turen >haustur >innentur >aussentur =tor =tore =porte =portes >porte puerta двер "
        "门",
    ),
    (Kind.STAIR, "stair =strs <trepp escal лестн 楼梯"),
    (
        Kind.WALL,
        "wall <wand >wand <wande >wande >waende <waende <mauer >mauer <mur <cloison <muro <tabiq pared <beton =struct "
        "<column =cols =col <colon <stutz <stuetz <poteau <pilar <pillar стен перегород колонн 墙 柱",
    ),
    (Kind.ROOM, "=room =rooms =space =spaces =area =raum <raume <raeume =piece =pieces <habitac <помещ 房间"),
)
_SPLIT = re.compile(r"[^a-z\u0400-\u04ff\u4e00-\u9fff]+")


def kind_of_name(name: str, patterns: Mapping[str, Kind] | None = None) -> Kind:
    """Return the kind of a layer or block by its name.

    Parameters
    ----------
    patterns
        Kind by pattern of the user, such as `A-MUR*`, capitals or not; the first that fits decides.
    """
    for pattern, kind in (patterns or {}).items():
        if fnmatchcase(name.casefold(), pattern.casefold()):
            return kind
    parts = [part for part in _SPLIT.split(_plain(name)) if part]
    for kind, words in _WORDS:
        if any(_fits(word, part) for word in words.split() for part in parts):
            return kind
    return Kind.UNKNOWN


def layer_patterns(assignments: Sequence[str]) -> dict[str, Kind]:
    """Return kind by pattern from texts such as `wall=A-MUR*`.

    Raises
    ------
    SceneError
        No such kind, or no pattern.
    """
    known = [kind.value for kind in Kind if kind != Kind.UNKNOWN]
    patterns = {}
    for text in assignments:
        kind, equals, pattern = text.partition("=")
        if not equals or not pattern.strip() or kind.strip().casefold() not in known:
            raise SceneError(
                f"layer: got {text!r}, expected KIND=PATTERN with a kind of {', '.join(known)}; such as wall=A-MUR*"
            )
        patterns[pattern.strip()] = Kind(kind.strip().casefold())
    return patterns


def patterns_by_kind(entries: Mapping[str, object], where: str) -> dict[str, Kind]:
    """Return kind by pattern from an office's lists of patterns by kind; `where` begins messages.

    Raises
    ------
    SceneError
        No such kind, no patterns, or a pattern of two kinds.
    """
    known = [kind.value for kind in Kind if kind != Kind.UNKNOWN]
    patterns: dict[str, Kind] = {}
    for name, value in entries.items():
        kind = name.strip().casefold()
        if kind not in known:
            raise SceneError(f"{where}got the kind {name!r}, expected one of {', '.join(known)}; correct it")
        own: list[object] = value if isinstance(value, list) else [value]
        texts = [pattern.strip() for pattern in own if isinstance(pattern, str) and pattern.strip()]
        if not texts or len(texts) < len(own):
            raise SceneError(
                f"{where}{name}: got {shortened(repr(value))}, expected names or patterns of layers, such as "
                "[A-MUR*, L-01]; correct it, and put numbers in quotes"
            )
        for pattern in texts:
            if patterns.setdefault(pattern, Kind(kind)) != kind:
                raise SceneError(
                    f"{where}{name}: got {pattern!r} as {patterns[pattern].value}, too, expected one kind; leave one "
                    "out"
                )
    return patterns


def _plain(name: str) -> str:
    """Small letters without marks: Außenwände -> `aussenwande`."""
    spread = unicodedata.normalize("NFKD", name.casefold())
    return "".join(sign for sign in spread if not unicodedata.combining(sign))


def _fits(word: str, part: str) -> bool:
    mark, rest = word[0], word[1:]
    if mark == "=":
        return part == rest
    if mark == "<":
        return part.startswith(rest)
    if mark == ">":
        return part.endswith(rest)
    return word in part

"""What people stand on in real models: floors by name and elevation, read by hand from storeys, slabs and sections."""

from dataclasses import dataclass, replace

from planner_core.model import UpAxis


@dataclass(frozen=True)
class Expected:
    """floors : (name, elevation in metres, scene coordinates), lowest first; none: refused as a single trade.

    files : of a building of several; else the file of the entry's name. bounds_m : (west, south, east, north) of each
    floor's ground, where it was read from the file, too.
    """

    floors: tuple[tuple[str, float], ...]
    why: str
    up: UpAxis | None = None
    files: tuple[str, ...] = ()
    bounds_m: tuple[tuple[float, float, float, float], ...] = ()


def _trade(what: str) -> Expected:
    return Expected((), f"{what} alone: nothing to stand on")


def _trades(*names: str) -> tuple[str, ...]:
    """Files of the apartment block Schependomlaan, a trade each."""
    return tuple(f"ifc-schependomlaan-{name}.ifc" for name in names)


#: One apartment block: three storeys and an attic, and a wing of two storeys to the north, below a flat roof at the
#: height of the second storey, which looks at it through windows. Floors are floor plates, down to the lowest one.
#: Bounds: outer faces of the walls of each storey, bay windows (F0), their roofs, which are balconies (F1).
_BLOCK = Expected(
    (
        ("00 begane grond", -0.09), ("01 eerste verdieping", 2.91), ("02 tweede verdieping", 5.91),
        ("03 derde verdieping", 8.91),
    ),
    "the wing's flat roof is no ground of the second storey; 04 dak is the roof",
    bounds_m=((0.0, 0.4, 21.3, 21.3), (0.0, 0.4, 22.7, 21.3), (5.3, 0.4, 21.3, 15.6), (5.3, 0.4, 21.3, 15.5)),
)  # fmt: skip

#: By file of the corpus, or title of a building of several. Names of floors without storeys count up.
EXPECTED = {
    "ifc-classroom-uk-revit2013.ifc": Expected((("Level 0", 0.0),), "one room; Level 1 is its roof"),
    "ifc-cpm-revit2022-ita.ifc": Expected(
        (("0 - Piano Terra", 0.0),), "one storey under a pitched roof; 1 - Piano Primo is the height of its eaves"
    ),
    "ifc-house-renga.ifc": Expected(
        (("Уровень 1", 0.0), ("Уровень 2", 3.45)),
        "slabs lie 0.6 m above the storeys' elevations; Кровля is the roof",
    ),
    "ifc-munich-roof-bricscad.ifc": Expected(
        (("Level 0", 0.0),), "no slabs; Level 1 has the gables of an open roof, and nothing to stand on"
    ),
    "ifc-openhouse-ifc4.ifc": Expected((("storey 0", 0.0),), "no slab; the footing ends at the storey's elevation"),
    "ifc-samplehouse-revit2015-ifc4.ifc": Expected((("Ground Floor", 0.0),), "one storey; Roof is the roof's"),
    "ifc-schependomlaan-breedplaatvloeren-archicad18.ifc": Expected(
        (("01 eerste verdieping", 2.91), ("02 tweede verdieping", 5.91), ("03 derde verdieping", 8.91)),
        "floor plates without walls: planned with a warning; 04 dak is the roof",
    ),
    "ifc-schependomlaan-houten-kozijnen-archicad18.ifc": _trade("window frames"),
    "ifc-schependomlaan-kalkzandsteen-archicad18.ifc": Expected(
        (
            ("00 begane grond", 0.0), ("01 eerste verdieping", 3.0), ("02 tweede verdieping", 6.0),
            ("03 derde verdieping", 9.0),
        ),
        "walls without slabs: the storeys' elevations; 04 dak is the roof",
    ),
    "ifc-schependomlaan-kanaalplaatvloer-archicad18.ifc": Expected(
        (("Level 1", -0.09),), "the lowest floor's plates alone: planned with a warning"
    ),
    "ifc-schependomlaan-kapconstructie-archicad18.ifc": _trade("roof timbers"),
    "ifc-schependomlaan-linden-frames-tekla20.ifc": _trade("window frames"),
    "ifc-schependomlaan-prefab-vebo-archicad18.ifc": _trade("balconies and stairs"),
    "ifc-schependomlaan-staal-archicad18.ifc": _trade("steel"),
    "ifc-schependomlaan-staal-archicad18.ifczip": _trade("steel"),
    "schependomlaan, four files": replace(
        _BLOCK,
        files=_trades(
            "kalkzandsteen-archicad18", "breedplaatvloeren-archicad18", "kanaalplaatvloer-archicad18",
            "kapconstructie-archicad18",
        ),
    ),
    "schependomlaan, eight files": replace(
        _BLOCK,
        files=_trades(
            "kalkzandsteen-archicad18", "breedplaatvloeren-archicad18", "kanaalplaatvloer-archicad18",
            "kapconstructie-archicad18", "prefab-vebo-archicad18", "staal-archicad18", "houten-kozijnen-archicad18",
            "linden-frames-tekla20",
        ),
    ),
    "ifc-structural-frame-revit2021.ifc": Expected((("Level 1", 0.0),), "one storey; Level 2 is the roof's"),
    "ifc-tekla-steel-frame-pno.ifc": _trade("a steel frame"),
    "ifc-tested-sample-revit2021-esp.ifc": Expected((("Nivel 1", 0.0),), "one room; Nivel 2 is its roof"),
    "obj-angelhouse-telaviv-rhino.obj": Expected(
        (
            ("Level 1", -1.6), ("Level 2", 1.42), ("Level 3", 4.64), ("Level 4", 6.52), ("Level 5", 9.74),
            ("Level 6", 13.3),
        ),
        "two wings half a storey apart, without storeys in the file: levels 3 and 5 hold both; level 6 is the roof "
        "terrace about its stair house",
    ),
    "gltf-habitat-simple-room.glb": Expected((("Level 1", 0.145),), "lies on its side unless told --up z", up=UpAxis.Z),
}  # fmt: skip

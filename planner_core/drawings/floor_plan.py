"""Recognition: `Drawing` -> `FloorPlan`s, one for each storey that the drawing holds.

1. strokes get a kind by the names of their layers and blocks (`layer_names`);
2. the unit is checked by doors and walls (`units`), and all is brought to metres;
3. where walls lie at several heights, each height is a storey;
4. walls, then openings, then rooms (`walls`, `openings`, `room_outlines`).

Plan coordinates, metres.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from planner_core.drawings.arcs import swing_arcs
from planner_core.drawings.drawing import NO_FILL, Drawing
from planner_core.drawings.drawn_lines import NO_LINES, DrawnLines, drawn_lines
from planner_core.drawings.layer_names import Kind, kind_of_name
from planner_core.drawings.likely_walls import LikelyWalls, likely_layer, likely_walls, lines_side_by_side
from planner_core.drawings.openings import Opening, OpeningKind, SymbolLines, is_in_opening, openings_of
from planner_core.drawings.room_outlines import (
    SEAL_M,
    TRACED_SEAL_M,
    PlacedText,
    RoomOutline,
    enclosed_by,
    rooms_of,
    sealed,
    slab_of,
)
from planner_core.drawings.stairs import Treads, treads_of, unclear_stairs
from planner_core.drawings.units import DrawnSizes, drawn_sizes, unit_of
from planner_core.drawings.walls import (
    THICKEST_M,
    WallPiece,
    fills_area,
    lines_without_walls,
    outlined_area,
    polygons_of,
    segments_of,
    straight_pieces,
)
from planner_core.errors import SceneError, one_line
from planner_core.model import BoolArray, FloatArray, Int64Array

_OPENING_KINDS = {Kind.DOOR: OpeningKind.DOOR, Kind.WINDOW: OpeningKind.WINDOW}
_CODES = {kind: code for code, kind in enumerate(Kind)}
_SWING_M = (0.5, 2.1)
"""Radii of arcs that are doors wherever they are drawn."""
_TOUCH_M = 0.02
"""Strokes of one door or window are nearer to each other."""
_FILLED_SHARE = 0.5
"""Where filled areas are this share of the outlined ones, walls are what is filled: outlines enclose shafts, too."""
_STOREY_M, _LEVEL_SHARE = (2.0, 12.0), 0.1
"""Heights of storeys, and the share of the longest level's walls from which on a level is one."""
_NAMED_LAYERS = 8
_PANE_M, _PANE_THICK_M = (0.35, 6.0), 0.08
"""Lengths of windows that are drawn as one line, and how thick such a line is."""
_APART_M, _GROUP_SHARE = 2.0, 0.25
"""Groups of walls this far apart, each of a quarter of the largest's area, may be storeys."""
_LEAST_WALLS_M2 = 0.2
_THICKER, _THICKEST_OLD_M = 1.4, 1.6
"""Of the usual thickness of a drawing's walls: the thickest; and the limit of that, in old buildings."""
_SINGLE_M, _SINGLE_SHARE = 0.1, 0.5
"""Thickness of walls that are drawn as one line, and the share of lines from which on a drawing's walls are."""
_LOST_SHARE, _LOST_SHARE_OF_WRONG_UNIT = 0.1, 0.25
"""Of lines that bound no wall: a few are of piers and niches; these are worth a warning, and doubt of the unit."""


@dataclass(frozen=True)
class FloorPlan:
    """One storey as its drawing shows it. outline : shapely area of its floor, see `room_outlines.slab_of`."""

    name: str
    walls: tuple[WallPiece, ...]
    openings: tuple[Opening, ...]
    rooms: tuple[RoomOutline, ...]
    outline: Any
    treads: tuple[Treads, ...] = ()
    height_m: float | None = None
    """Of the drawing's own level; None: it is flat."""
    warnings: tuple[str, ...] = ()
    texts: tuple[PlacedText, ...] = ()
    """By which rooms have their names."""
    is_traced: bool = False
    """Recognised without named layers: walls and openings miss each other by more."""
    lines: DrawnLines = NO_LINES
    """All that is drawn."""
    from_picture: FloatArray | None = None
    """As of its drawing."""


@dataclass(frozen=True)
class _NamedWalls:
    """What is known of the walls of a drawing whose layers have names.

    are_doors_drawn : facades and sections have no swings. other_units : those that sizes fit, if nobody chose one.
    """

    thickest_m: float = THICKEST_M
    are_doors_drawn: bool = False
    other_units: tuple[str, ...] = ()


def floor_plans(
    drawing: Drawing, *, unit_m: float | None = None, patterns: Mapping[str, Kind] | None = None
) -> list[FloorPlan]:
    """Recognise the storeys of a drawing, the lowest first.

    Parameters
    ----------
    unit_m
        Metres in a unit of the drawing, by the user; None: by the file, checked.
    patterns
        Kinds of layers and blocks by pattern of the user.

    Raises
    ------
    SceneError
        No walls, or a unit that doors and walls contradict.
    """
    kinds = _kinds_of_strokes(drawing, patterns or {})
    is_named = bool((kinds == _CODES[Kind.WALL]).any())
    warnings: tuple[str, ...] = ()
    sizes = _sizes(drawing, kinds, Kind.WALL if is_named else Kind.UNKNOWN)
    other_units: tuple[str, ...] = ()
    if unit_m is None:
        unit_m, warnings = unit_of(drawing.name, sizes, stated_m=drawing.unit_m, source=drawing.unit_source)
        other_units = sizes.other_units(unit_m)
    thickest_m = min(max(THICKEST_M, _THICKER * sizes.wall * unit_m), _THICKEST_OLD_M)
    named = _NamedWalls(thickest_m, bool(np.isfinite(sizes.door)), other_units)
    if not is_named:
        layer = _likely_layer(drawing, kinds, unit_m)
        warnings = (*warnings, _walls_by_shape(drawing, layer))
        plans = [
            _floor_plan(drawing, kinds, np.arange(drawing.n_strokes), unit_m, patterns=patterns or {}, layer=layer)
        ]
        if not plans[0].rooms and drawing.from_picture is None:  # lines of pictures may be mended by hand
            raise SceneError(
                f"{drawing.name}: no layer has a name for walls, and what looks like them on layer "
                f"{one_line(drawing.layers[layer])} encloses no room, expected a floor plan and no furniture; name "
                "the layer of the walls, such as --layer wall=NAME."
            )
    else:
        plans = [
            _floor_plan(
                drawing, kinds, rows, unit_m, patterns=patterns or {}, height_m=height_m, name=name, walls=named
            )
            for name, height_m, rows in _storeys(drawing, _levels(drawing, kinds, unit_m), unit_m)
        ]
    plans[0] = replace(plans[0], warnings=(*drawing.warnings, *warnings, *plans[0].warnings))
    return plans


def _segments(strokes: Sequence[FloatArray]) -> FloatArray:
    """(M, 2, 2) straight parts of strokes in the drawing's own unit."""
    pieces = [np.stack([stroke[:-1, :2], stroke[1:, :2]], axis=1) for stroke in strokes]
    segments = np.concatenate(pieces) if pieces else np.empty((0, 2, 2))
    is_long = (segments[:, 0] != segments[:, 1]).any(axis=1)
    return np.asarray(segments[is_long], dtype=np.float64)


# ------------------------------------------------------------------------------------------- kinds
def _kinds_of_strokes(drawing: Drawing, patterns: Mapping[str, Kind]) -> Int64Array:
    """(S,) code of each stroke's kind: by its block's name, else its layer's, else that of the block's layer."""
    of_layer = [kind_of_name(name, patterns) for name in drawing.layers]
    of_block = [_kind_of_block(symbol.name, patterns) for symbol in drawing.symbols]
    of_block_layer = [kind_of_name(symbol.layer, patterns) for symbol in drawing.symbols]
    codes = np.empty(drawing.n_strokes, dtype=np.int64)
    for row, (layer, symbol) in enumerate(
        zip(drawing.layer_of_stroke.tolist(), drawing.symbol_of_stroke.tolist(), strict=True)
    ):
        kind = of_layer[layer]
        if symbol >= 0 and kind != Kind.IGNORED:
            block, around = of_block[symbol], of_block_layer[symbol]
            if block != Kind.UNKNOWN:
                kind = block
            elif kind == Kind.UNKNOWN or around in _OPENING_KINDS:
                kind = around if around != Kind.UNKNOWN else kind
        codes[row] = _CODES[kind]
    return codes


def _kind_of_block(names: str, patterns: Mapping[str, Kind]) -> Kind:
    found = (kind_of_name(name, patterns) for name in names.split("/"))
    return next((kind for kind in found if kind not in (Kind.UNKNOWN, Kind.WALL)), Kind.UNKNOWN)


def _likely_layer(drawing: Drawing, kinds: Int64Array, unit_m: float) -> int:
    """The layer that holds walls by its shape, where no layer has a name for them."""
    found = [_likely(drawing, kinds, layer, unit_m) for layer in range(len(drawing.layers))]
    extent_m = float(np.ptp(drawing.points[:, :2], axis=0).max()) * unit_m
    layer = likely_layer(found, extent_m)
    if layer is None:
        count = np.bincount(drawing.layer_of_stroke, minlength=len(drawing.layers))
        order = np.argsort(-count, kind="stable")[:_NAMED_LAYERS].tolist()
        named = ", ".join(one_line(drawing.layers[row]) for row in order)
        more = f" and {len(drawing.layers) - _NAMED_LAYERS} more" if len(drawing.layers) > _NAMED_LAYERS else ""
        raise SceneError(
            f"{drawing.name}: none of its {len(drawing.layers)} layers ({named}{more}) has a name for walls or holds "
            "lines like walls, 0.06 to 0.5 m apart, expected a floor plan; check its scale, or name the layer of the "
            "walls, such as --layer wall=NAME."
        )
    return layer


def _likely(drawing: Drawing, kinds: Int64Array, layer: int, unit_m: float) -> LikelyWalls:
    rows = np.flatnonzero((drawing.layer_of_stroke == layer) & (kinds == _CODES[Kind.UNKNOWN]))
    strokes = [(row, drawing.stroke(row)[:, :2] * unit_m) for row in rows.tolist()]
    is_line = drawing.fill_of_stroke[rows] == NO_FILL
    lines = [stroke for (_, stroke), line in zip(strokes, is_line.tolist(), strict=True) if line]
    fills = [stroke for stroke, line in zip(strokes, is_line.tolist(), strict=True) if not line]
    return likely_walls([line for line in lines if not swing_arcs([line])], _filled_area(drawing, fills))


def _walls_by_shape(drawing: Drawing, layer: int) -> str:
    name = one_line(drawing.layers[layer])
    others = " and no other layer" if len(drawing.layers) > 1 else ""
    return (
        f"{drawing.name}: no layer has a name for walls, so they are what looks like walls on layer {name}{others}; "
        "check the map, or name their layers, such as --layer wall=NAME."
    )


def _strokes(drawing: Drawing, rows: Int64Array) -> list[FloatArray]:
    return [drawing.stroke(row) for row in rows.tolist()]


def _corners(drawing: Drawing, chosen: BoolArray) -> FloatArray:
    """(N, 2) corners of chosen strokes."""
    return drawing.points[np.repeat(chosen, np.diff(drawing.starts)), :2]


def _sizes(drawing: Drawing, kinds: Int64Array, of_walls: Kind) -> DrawnSizes:
    """Sizes of walls and doors, in the drawing's unit; swings on layers of no name count where neither is there."""

    def lines(kind: Kind) -> list[FloatArray]:
        return _strokes(drawing, np.flatnonzero((kinds == _CODES[kind]) & (drawing.fill_of_stroke == NO_FILL)))

    segments = _segments(lines(of_walls)) if of_walls == Kind.WALL else np.empty((0, 2, 2))
    corners = _corners(drawing, kinds == _CODES[of_walls])
    sizes = drawn_sizes(segments, swing_arcs(lines(Kind.DOOR)), corners)
    return sizes if sizes.is_telling else drawn_sizes(segments, swing_arcs(lines(Kind.UNKNOWN)), corners)


# ------------------------------------------------------------------------------------------ storeys
def _levels(drawing: Drawing, kinds: Int64Array, unit_m: float) -> FloatArray:
    """Heights at which walls lie, lowest first; one, NaN, where the drawing is flat or its heights are no storeys'."""
    flat = np.array([np.nan])
    rows = np.flatnonzero(kinds == _CODES[Kind.WALL])
    height = np.round(drawing.points[drawing.starts[rows], 2] * unit_m, 1)
    n_corners = np.diff(drawing.starts)[rows]
    levels, at = np.unique(height, return_inverse=True)
    weight = np.bincount(at.reshape(-1), weights=n_corners)
    levels = levels[weight >= _LEVEL_SHARE * weight.max()]
    steps = np.diff(levels)
    if len(levels) < 2 or not ((steps >= _STOREY_M[0]) & (steps <= _STOREY_M[1])).all():
        return flat
    return np.asarray(levels, dtype=np.float64)


def _storeys(drawing: Drawing, levels: FloatArray, unit_m: float) -> list[tuple[str, float | None, Int64Array]]:
    """Name, height and strokes of each level."""
    if np.isnan(levels[0]):
        return [("", None, np.arange(drawing.n_strokes))]
    height = drawing.points[drawing.starts[:-1], 2] * unit_m
    level = np.abs(height[:, None] - levels).argmin(axis=1)
    return [(f"Level {n + 1}", float(levels[n]), np.flatnonzero(level == n)) for n in range(len(levels))]


def _floor_plan(
    drawing: Drawing,
    kinds: Int64Array,
    rows: Int64Array,
    unit_m: float,
    *,
    patterns: Mapping[str, Kind],
    height_m: float | None = None,
    name: str = "",
    layer: int | None = None,
    walls: _NamedWalls = _NamedWalls(),
) -> FloorPlan:
    """One storey of the strokes `rows`. layer : of walls without a name; None: walls have names."""

    def strokes_m(kind: Kind, *, filled: bool = False) -> list[tuple[int, FloatArray]]:
        chosen = rows[(kinds[rows] == _CODES[kind]) & ((drawing.fill_of_stroke[rows] != NO_FILL) == filled)]
        return [(row, drawing.stroke(row)[:, :2] * unit_m) for row in chosen.tolist()]

    likely = None if layer is None else _likely(drawing, kinds, layer, unit_m)
    doubts: list[str] = []
    if likely is None:
        lines = [stroke for _, stroke in strokes_m(Kind.WALL)]
        area, doubts = _walls_area(drawing, lines, strokes_m(Kind.WALL, filled=True), walls)
    else:
        area = likely.area
    if area.area < _LEAST_WALLS_M2:
        raise SceneError(
            f"{drawing.name}: its wall layers hold no walls, that is no closed outlines, filled areas or pairs of "
            "parallel lines 0.04 to 0.56 m apart, expected a floor plan; check --units, or name the layer of the "
            "walls, such as --layer wall=NAME."
        )
    windows = () if likely is None else likely.windows
    are_windows_named = likely is None and bool((kinds == _CODES[Kind.WINDOW]).any())
    unknown = strokes_m(Kind.UNKNOWN)
    symbols = [
        *_symbols(drawing, OpeningKind.DOOR, strokes_m(Kind.DOOR)),
        *_symbols(drawing, OpeningKind.WINDOW, strokes_m(Kind.WINDOW)),
        *(SymbolLines(OpeningKind.WINDOW, window.exterior) for window in windows),
        *([] if are_windows_named else _panes(drawing, unknown, strokes_m(Kind.UNKNOWN, filled=True), layer)),
        *_swings(unknown),
    ]
    openings, area = openings_of(area, symbols, thickest_m=walls.thickest_m)
    texts = _texts(drawing, unit_m, height_m, patterns)
    filled = shapely.union_all([opening.area for opening in openings])
    seal_m = SEAL_M if likely is None else TRACED_SEAL_M
    rooms = rooms_of(area, filled, texts, seal_m)
    if likely is None and not are_windows_named:
        openings = [_door_between_rooms(opening, rooms) for opening in openings]
    if likely is not None and len(rooms) > 1 and all(o.kind == OpeningKind.WINDOW for o in openings):
        raise SceneError(
            f"{drawing.name}: no layer has a name for walls, and what looks like them encloses {len(rooms)} rooms "
            "without a door or a gap, as on facades and sections, expected a floor plan; name the layer of the walls, "
            "such as --layer wall=NAME."
        )
    enclosed = enclosed_by(sealed(area, filled, seal_m), seal_m)
    stairs = [stroke for _, stroke in strokes_m(Kind.STAIR)]
    unclear = unclear_stairs(stairs, drawing.name)
    return FloorPlan(
        name=name,
        walls=tuple(straight_pieces(area, thickest_m=walls.thickest_m)),
        openings=tuple(openings),
        rooms=tuple(rooms),
        outline=slab_of(enclosed),
        treads=tuple(treads_of(stairs)),
        height_m=height_m,
        warnings=(*doubts, *_doubts(enclosed, drawing.name, name, symbols, openings), *unclear),
        texts=tuple(texts),
        is_traced=likely is not None,
        lines=drawn_lines(drawing, rows, unit_m),
        from_picture=drawing.from_picture,
    )


def _walls_area(
    drawing: Drawing, lines: list[FloatArray], fills: list[tuple[int, FloatArray]], walls: _NamedWalls
) -> tuple[Any, list[str]]:
    """The area of walls, and a warning of lines that bound none."""
    outlined = outlined_area(lines, thickest_m=walls.thickest_m)
    filled = _filled_area(drawing, fills)
    if fills and filled.area >= _FILLED_SHARE * outlined.area:
        return filled, []
    area = shapely.union_all([outlined, filled])
    lost = lines_without_walls(lines, area)
    all_m = float(shapely.length(shapely.union_all(shapely.linestrings(segments_of(lines)))))
    share = lost.length / all_m if all_m else 0.0
    if share <= _LOST_SHARE:
        return area, []
    longest = max(shapely.get_parts(lost), key=lambda line: (line.length, *line.bounds))
    x, y = shapely.get_coordinates(shapely.line_interpolate_point(longest, 0.5, normalized=True))[0].tolist()
    which = f"{share:.0%} of the lines on its wall layers, the longest at x {x:.2f}, y {y:.2f} m,".replace("%", " %", 1)
    if walls.other_units and share > _LOST_SHARE_OF_WRONG_UNIT:
        raise SceneError(
            f"{drawing.name}: {which} bound no wall, and its sizes fit {' and '.join(walls.other_units)} as well as "
            f"the unit that it states, expected to know its unit; pass it, such as --units {walls.other_units[0]}."
        )
    if walls.are_doors_drawn and share > _SINGLE_SHARE:
        single = shapely.buffer(lost, 0.5 * _SINGLE_M, cap_style="square", join_style="mitre")
        line = f"{which} have no line beside them and are walls {_SINGLE_M:g} m thick"
        return polygons_of(shapely.union_all([area, single])), [
            f"{drawing.name}: {line}; if that is wrong, pass --units."
        ]
    return area, [f"{drawing.name}: {which} bound no wall and are left out; check the map."]


def _filled_area(drawing: Drawing, fills: list[tuple[int, FloatArray]]) -> Any:
    rings: dict[int, list[FloatArray]] = {}
    for row, ring in fills:
        rings.setdefault(int(drawing.fill_of_stroke[row]), []).append(ring)
    return fills_area(list(rings.values()))


def _symbols(drawing: Drawing, kind: OpeningKind, strokes: list[tuple[int, FloatArray]]) -> list[SymbolLines]:
    """Group strokes that touch or are of one block; a door or a window each."""
    if not strokes:
        return []
    lines = shapely.linestrings(
        np.concatenate([stroke for _, stroke in strokes]),
        indices=np.repeat(np.arange(len(strokes)), [len(stroke) for _, stroke in strokes]),
    )
    tree = shapely.STRtree(lines)
    a, b = tree.query(lines, predicate="dwithin", distance=_TOUCH_M)
    block = drawing.symbol_of_stroke[[row for row, _ in strokes]]
    order = np.argsort(block, kind="stable")
    same = np.flatnonzero((np.diff(block[order]) == 0) & (block[order][1:] >= 0))
    a, b = np.concatenate([a, order[same]]), np.concatenate([b, order[same + 1]])
    n_groups, group = connected_components(
        coo_array((np.ones(len(a)), (a, b)), shape=(len(lines),) * 2), directed=False
    )
    found = []
    for number in range(n_groups):
        members = np.flatnonzero(group == number)
        of_block = [int(each) for each in block[members] if each >= 0]
        name = drawing.symbols[of_block[0]].name.rpartition("/")[2] if of_block else ""
        swings = tuple(swing_arcs([strokes[row][1] for row in members.tolist()]))
        found.append(SymbolLines(kind, shapely.multilinestrings(lines[members]), name, swings))
    return found


def _swings(strokes: list[tuple[int, FloatArray]]) -> list[SymbolLines]:
    """Doors by their swings alone, on layers whose names state nothing."""
    found = []
    for arc in swing_arcs(stroke for _, stroke in strokes):
        if _SWING_M[0] <= arc.radius <= _SWING_M[1]:
            lines = shapely.multilinestrings([np.stack([arc.centre, end]) for end in (arc.start, arc.end)])
            found.append(SymbolLines(OpeningKind.DOOR, lines, "", (arc,)))
    return found


def _panes(
    drawing: Drawing, lines: list[tuple[int, FloatArray]], fills: list[tuple[int, FloatArray]], layer: int | None
) -> list[SymbolLines]:
    """Windows of drawings that name none: lines side by side on other layers than the walls', and single ones."""
    others = [stroke for row, stroke in lines if drawing.layer_of_stroke[row] != layer]
    single = [shapely.LineString(stroke) for _, stroke in lines if _is_pane(stroke)]
    single += [shapely.LineString(ring) for _, ring in fills if len(ring) <= 8 and _is_pane(ring)]
    return [SymbolLines(OpeningKind.WINDOW, lines, is_loose=True) for lines in (*lines_side_by_side(others), *single)]


def _door_between_rooms(opening: Opening, rooms: Sequence[RoomOutline]) -> Opening:
    """What lines of no name fill: outside it is a window, between two rooms a door without a swing, as sliding ones."""
    if opening.kind != OpeningKind.WINDOW:
        return opening
    middle, across = opening.corners_m.mean(axis=0), opening.corners_m[3] - opening.corners_m[0]
    sides = shapely.points(middle + np.array([[-1.0], [1.0]]) * across)
    inside = [any(shapely.covers(room.outline, side) for room in rooms) for side in sides]
    return replace(opening, kind=OpeningKind.DOOR) if all(inside) else opening


def _is_pane(stroke: FloatArray) -> bool:
    """Whether a stroke is long and straight, of the size of a window."""
    box = shapely.oriented_envelope(shapely.LineString(stroke))
    length = 0.5 * box.length if box.geom_type == "Polygon" else box.length
    return bool(_PANE_M[0] <= length <= _PANE_M[1] and box.area <= _PANE_THICK_M * length)


def _texts(drawing: Drawing, unit_m: float, height_m: float | None, patterns: Mapping[str, Kind]) -> list[PlacedText]:
    return [
        PlacedText(text.text, text.x * unit_m, text.y * unit_m)
        for text in drawing.texts
        if kind_of_name(text.layer, patterns) != Kind.IGNORED
        and (height_m is None or abs(text.z * unit_m - height_m) < 0.5 * _STOREY_M[0])
    ]


def _groups(outline: Any) -> int:
    """Number of large parts of what is enclosed that lie far apart, as storeys drawn side by side do."""
    near = shapely.get_parts(shapely.union_all(shapely.buffer(shapely.get_parts(outline), 0.5 * _APART_M)))
    areas = np.array([shapely.intersection(part, outline).area for part in near])
    return int((areas >= _GROUP_SHARE * areas.max(initial=0.0)).sum()) if len(areas) else 0


def _doubts(
    enclosed: Any, file: str, name: str, symbols: Sequence[SymbolLines], openings: Sequence[Opening]
) -> list[str]:
    where = f"{file}, {name}" if name else file
    lines = []
    doubtful = [opening for opening in openings if opening.is_doubtful]
    if doubtful:
        noun = "gap in the walls has" if len(doubtful) == 1 else "gaps in the walls have"
        lines.append(
            f"{where}: {len(doubtful)} {noun} no door or window drawn and count as open; --doubtful as-wall "
            "closes such gaps."
        )
    lost = [symbol for symbol in symbols if not symbol.is_loose and not is_in_opening(symbol, openings)]
    if lost:
        x, y = shapely.get_coordinates(shapely.centroid(lost[0].lines))[0].tolist()
        noun = "door or window that lies" if len(lost) == 1 else "doors and windows that lie"
        lines.append(f"{where}: {len(lost)} {noun} in no wall left out, the first at x {x:.2f}, y {y:.2f} m.")
    groups = _groups(enclosed)
    if groups > 1:
        lines.append(
            f"{where}: its walls are {groups} groups more than {_APART_M:g} m apart, taken as one storey; where they "
            "are storeys side by side, name the part of each, such as --part 'X1,Y1,X2,Y2;X1,Y1,X2,Y2'."
        )
    return lines

"""DXF (ASCII and binary, R12 to 2018) -> `Drawing`, by ezdxf: blocks in blocks are taken apart, curves flattened.

What a crew sees is read: model space, or the first sheet where that is empty; no layer that is off or frozen. The unit
is `$INSUNITS`, which many programs leave as it was: `planner_core.drawings.units` checks it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from planner_core import child_process
from planner_core.drawings.drawing import NO_FILL, NO_SYMBOL, Drawing, DrawingParts, DrawingText
from planner_core.errors import MissingPackageError, SceneError, grouped, one_line, reason_of
from planner_core.progress import ProgressEvent

MOST_ENTITIES = 3_000_000
"""Strokes of one drawing, blocks taken apart: floors of large hospitals have some hundred thousand."""
_DEEPEST = 16
"""Blocks in blocks; deeper ones hold themselves."""
_SAG_SHARE = 1e-3
"""Flattened curves leave their circle by at most this share of their size, and have no more corners than needed."""
_PROGRESS_EACH = 20_000
_METRES = {
    1: 0.0254, 2: 0.3048, 3: 1609.344, 4: 0.001, 5: 0.01, 6: 1.0, 7: 1000.0, 10: 0.9144, 14: 0.1, 15: 10.0, 16: 100.0,
    21: 1200.0 / 3937.0,
}  # fmt: skip
"""Metres of `$INSUNITS`, by the DXF reference."""
_CURVES = frozenset({"LINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE", "LWPOLYLINE", "POLYLINE", "HELIX", "MLINE"})
_AREAS = frozenset({"SOLID", "TRACE", "3DFACE"})
_TEXTS = frozenset({"TEXT", "MTEXT", "ATTRIB"})


def read_dxf(path: str) -> Drawing:
    """Read a DXF file.

    Raises
    ------
    SceneError
        Not a DXF file, cut off, or without anything that can be drawn.
    MissingPackageError
        ezdxf is not installed.
    """
    file = Path(path)
    document = _opened(file)
    reader = _Reader(document, file.name)
    space = document.modelspace()
    if not len(space):
        space = next((sheet for sheet in document.layouts if not sheet.is_modelspace and len(sheet) > 1), space)
    reader.read(space)
    if not reader.parts.n_strokes:
        hidden = " on a layer that is on" if reader.n_hidden else ""
        raise SceneError(f"{file.name}: it has no lines{hidden}, expected a floor plan; export the plan's view as DXF.")
    unit = int(document.header.get("$INSUNITS", 0))
    return reader.parts.drawing(
        file.name, unit_m=_METRES.get(unit), unit_source="$INSUNITS", warnings=tuple(reader.warnings())
    )


def _opened(file: Path) -> Any:
    """Return ezdxf's document; a damaged file is mended as far as ezdxf can."""
    try:
        from ezdxf import filemanagement, recover
        from ezdxf.lldxf.const import DXFError
    except ImportError as error:
        raise MissingPackageError(
            f"{file.name}: reading DXF needs the package ezdxf, which is missing; run pip install ezdxf."
        ) from error
    child_process.at("the file as a whole")
    with file.open("rb") as opened:
        start = opened.read(6)
    if not start:
        raise SceneError(f"{file.name}: the file is empty, expected a drawing; copy or export it again.")
    if start[:4] == b"AC10":
        raise SceneError(
            f"{file.name}: it is a DWG file, expected DXF; save it as DXF in the program that made it, or convert it "
            "with a DWG converter."
        )
    try:
        return filemanagement.readfile(file)
    except (DXFError, OSError, ValueError, TypeError, KeyError, IndexError, AttributeError):
        child_process.at("the file as a whole, a second time to mend it")
    try:
        return recover.readfile(file)[0]
    except (DXFError, OSError, ValueError, TypeError, KeyError, IndexError, AttributeError) as error:
        raise SceneError(
            f"{file.name}: ezdxf can't read it ({reason_of(error)}), expected a DXF file; export it again."
        ) from error


class _Reader:
    """Goes through entities and blocks, and remembers what it leaves out."""

    def __init__(self, document: Any, name: str) -> None:
        self.parts = DrawingParts()
        self.n_hidden = 0
        self._document = document
        self._name = name
        self._missing: list[str] = []
        self._n_damaged = 0
        self._n_read = 0
        layers = [layer for layer in document.layers if layer.is_off() or layer.is_frozen()]
        self._hidden = {layer.dxf.name.casefold() for layer in layers}

    def read(self, entities: Iterable[Any]) -> None:
        """Read a space's entities."""
        self._read(entities, symbol=NO_SYMBOL, outer="0", depth=0, names="")

    def warnings(self) -> Iterator[str]:
        """Lines about what is left out."""
        if self._missing:
            names = ", ".join(one_line(name) for name in dict.fromkeys(self._missing))
            yield f"{self._name}: it refers to files that are not read: {names}; bind them into the drawing (xbind)."
        if self._n_damaged:
            yield f"{self._name}: {grouped(self._n_damaged)} damaged entities are left out; audit it in CAD."

    def _read(self, entities: Iterable[Any], *, symbol: int, outer: str, depth: int, names: str) -> None:
        for entity in entities:
            self._n_read += 1
            if self._n_read % _PROGRESS_EACH == 0:
                child_process.progress_of_child(
                    ProgressEvent("load", self._n_read, 0, f"{grouped(self._n_read)} entities")
                )
            layer = entity.dxf.get("layer", "0")
            layer = outer if layer == "0" else layer
            if layer.casefold() in self._hidden or entity.dxf.get("invisible", 0) or _is_hidden_attribute(entity):
                self.n_hidden += 1
                continue
            if entity.dxftype() == "INSERT":
                self._read_insert(entity, symbol=symbol, layer=layer, depth=depth, names=names)
            else:
                self._read_entity(entity, layer, symbol)

    def _read_insert(self, insert: Any, *, symbol: int, layer: str, depth: int, names: str) -> None:
        name = str(insert.dxf.name)
        block = self._document.blocks.get(name)
        if block is None or block.block.is_xref:
            self._missing.append(name if block is None else str(block.block.dxf.get("xref_path", name)) or name)
            return
        if depth >= _DEEPEST:
            self._n_damaged += 1
            return
        names = f"{names}/{name}" if names else name
        anonymous = name.startswith("*")
        for each in insert.multi_insert() if insert.mcount > 1 else [insert]:
            number = symbol if anonymous and symbol != NO_SYMBOL else self.parts.add_symbol(names, layer)
            try:
                entities = list(each.virtual_entities())
            except (TypeError, ValueError, ArithmeticError, AttributeError):
                self._n_damaged += 1
                continue
            self._read(entities, symbol=number, outer=layer, depth=depth + 1, names=names)
            self._read(each.attribs, symbol=number, outer=layer, depth=depth + 1, names=names)

    def _read_entity(self, entity: Any, layer: str, symbol: int) -> None:
        kind = entity.dxftype()
        try:
            if kind in _CURVES:
                self._add_curves(entity, layer, symbol)
            elif kind in _AREAS:
                corners = np.array([tuple(corner) for corner in entity.wcs_vertices()])
                self._add(corners, layer, symbol, fill=self.parts.new_fill(), closed=True)
            elif kind in ("HATCH", "MPOLYGON"):
                self._add_hatch(entity, layer, symbol)
            elif kind in _TEXTS:
                self._add_text(entity, layer)
        except SceneError:
            raise
        except (TypeError, ValueError, ArithmeticError, AttributeError, KeyError, IndexError):
            self._n_damaged += 1

    def _add_curves(self, entity: Any, layer: str, symbol: int) -> None:
        if entity.dxftype() == "MLINE":
            for part in entity.virtual_entities():
                self._read_entity(part, layer, symbol)
            return
        if entity.dxftype() == "LINE":
            self._add(np.array([tuple(entity.dxf.start), tuple(entity.dxf.end)]), layer, symbol)
            return
        self._add_path(_path(entity), layer, symbol)

    def _add_hatch(self, entity: Any, layer: str, symbol: int) -> None:
        from ezdxf.path import from_hatch

        paths = [path for path in from_hatch(entity) if len(path)]
        fill = self.parts.new_fill()
        for path in paths:
            self._add_path(path, layer, symbol, fill=fill, closed=True)

    def _add_path(self, path: Any, layer: str, symbol: int, *, fill: int = NO_FILL, closed: bool = False) -> None:
        for part in path.sub_paths() if path.has_sub_paths else [path]:
            self._add(_flattened(part), layer, symbol, fill=fill, closed=closed)

    def _add(
        self, points: np.ndarray[Any, Any], layer: str, symbol: int, *, fill: int = NO_FILL, closed: bool = False
    ) -> None:
        if self.parts.n_strokes >= MOST_ENTITIES:
            raise SceneError(
                f"{self._name}: it has more than {grouped(MOST_ENTITIES)} lines, expected a floor plan; export the "
                "layers of walls, doors, windows and stairs alone."
            )
        self.parts.add_stroke(points, layer, symbol=symbol, fill=fill, closed=closed)

    def _add_text(self, entity: Any, layer: str) -> None:
        is_paragraph = entity.dxftype() == "MTEXT"
        text = "\n".join(" ".join(line.split()) for line in str(entity.plain_text()).splitlines()).strip()
        if not text:
            return
        x, y, z = entity.dxf.insert
        if not is_paragraph:  # the insertion is mostly its lower left corner
            height = float(entity.dxf.get("height", 0.0))
            angle = np.radians(float(entity.dxf.get("rotation", 0.0)))
            if entity.dxf.get("halign", 0) or entity.dxf.get("valign", 0):
                x, y, z = entity.dxf.get("align_point", entity.dxf.insert)
            else:
                along, up = 0.4 * height * len(text), 0.5 * height
                x, y = x + along * np.cos(angle) - up * np.sin(angle), y + along * np.sin(angle) + up * np.cos(angle)
        self.parts.texts.append(DrawingText(text, float(x), float(y), float(z), layer))


def _is_hidden_attribute(entity: Any) -> bool:
    return entity.dxftype() == "ATTRIB" and bool(entity.is_invisible)


def _path(entity: Any) -> Any:
    from ezdxf.path import make_path

    return make_path(entity)


def _flattened(path: Any) -> np.ndarray[Any, Any]:
    """(K, 3) corners of a path; straight parts keep their ends bit by bit."""
    if not path.has_curves:
        return np.array([tuple(point) for point in path.control_vertices()])
    box = np.array([tuple(point) for point in path.control_vertices()])
    size = float(np.ptp(box[:, :2], axis=0).max(initial=0.0))
    return np.array([tuple(point) for point in path.flattening(max(_SAG_SHARE * size, 1e-9), segments=4)])

"""The common form of a drawing: strokes, filled areas and texts of one file, still in the file's unit.

A reader of one format makes it; everything behind reads nothing else. Curves are flattened by the reader.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.model import FloatArray, Int64Array

NO_SYMBOL = -1
NO_FILL = -1


@dataclass(frozen=True)
class Symbol:
    """One block that is inserted into a drawing, or a part of a page that is drawn as one."""

    name: str
    """Names of the block and of those that it is inserted in, the outermost first, joined by `/`."""
    layer: str


@dataclass(frozen=True)
class DrawingText:
    """A line or paragraph of text, with the middle of its box."""

    text: str
    x: float
    y: float
    z: float
    layer: str


@dataclass(frozen=True)
class Drawing:
    """What a reader of one format returns.

    points : (N, 3) float64 corners of all strokes, file's unit. starts : (S + 1,) int64 into them, CSR.
    layer_of_stroke, symbol_of_stroke : (S,) int64 into `layers` and `symbols`; `NO_SYMBOL`: of no block.
    fill_of_stroke : (S,) int64; strokes of one number are the rings of one filled area by the even-odd rule; `NO_FILL`:
    a line. Closed strokes repeat their first point.
    """

    name: str
    """Of the file, for messages."""
    points: FloatArray
    starts: Int64Array
    layer_of_stroke: Int64Array
    symbol_of_stroke: Int64Array
    fill_of_stroke: Int64Array
    layers: tuple[str, ...]
    symbols: tuple[Symbol, ...] = ()
    texts: tuple[DrawingText, ...] = ()
    unit_m: float | None = None
    """Metres in a unit of the file, as the file states it; None: it states none."""
    unit_source: str = ""
    """Where the file states it, for messages, such as `$INSUNITS`."""
    paper_unit_m: float | None = None
    """Metres of paper in a unit, of a page or of a picture of known resolution: of the plan's scale, nothing."""
    page_height: float | None = None
    """Of a page or a picture, in its unit; None: it has no page, but a space."""
    warnings: tuple[str, ...] = ()
    from_picture: FloatArray | None = None
    """(3, 3) homography from pixels of the picture that it was traced in, y up, to its unit; None: it is no picture."""

    @property
    def n_strokes(self) -> int:
        """Number of strokes, rings of fills included."""
        return int(self.layer_of_stroke.size)

    def stroke(self, number: int) -> FloatArray:
        """(K, 3) corners of one stroke."""
        return self.points[self.starts[number] : self.starts[number + 1]]


class DrawingParts:
    """Collects the strokes and texts of a drawing while a reader goes through its file."""

    def __init__(self) -> None:
        self.texts: list[DrawingText] = []
        self.symbols: list[Symbol] = []
        self._points: list[FloatArray] = []
        self._layers: dict[str, int] = {}
        self._rows: list[tuple[int, int, int]] = []
        self._n_fills = 0

    @property
    def n_strokes(self) -> int:
        """Number of strokes so far."""
        return len(self._rows)

    def add_symbol(self, name: str, layer: str) -> int:
        """Add a block and return its number, for the strokes that belong to it."""
        self.symbols.append(Symbol(name, layer))
        return len(self.symbols) - 1

    def new_fill(self) -> int:
        """Return the number of the next filled area."""
        self._n_fills += 1
        return self._n_fills - 1

    def add_stroke(
        self, points: FloatArray, layer: str, *, symbol: int = NO_SYMBOL, fill: int = NO_FILL, closed: bool = False
    ) -> None:
        """Add a polyline (K, 2) or (K, 3); those of fewer than two finite points are left out."""
        at = np.asarray(points, dtype=np.float64)
        if at.shape[1] == 2:
            at = np.column_stack([at, np.zeros(len(at))])
        at = at[np.isfinite(at).all(axis=1)]
        if closed and len(at) > 1 and (at[0, :2] != at[-1, :2]).any():
            at = np.concatenate([at, at[:1]])
        if len(at) < 2:
            return
        self._points.append(at)
        self._rows.append((self._layers.setdefault(layer, len(self._layers)), symbol, fill))

    def drawing(
        self,
        name: str,
        *,
        unit_m: float | None,
        unit_source: str = "",
        paper_unit_m: float | None = None,
        page_height: float | None = None,
        warnings: tuple[str, ...] = (),
        from_picture: FloatArray | None = None,
    ) -> Drawing:
        """Return all that was added as one drawing."""
        rows = np.array(self._rows, dtype=np.int64).reshape(-1, 3)
        lengths = [len(each) for each in self._points]
        return Drawing(
            name=name,
            points=np.concatenate(self._points) if self._points else np.empty((0, 3)),
            starts=np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64),
            layer_of_stroke=rows[:, 0].copy(),
            symbol_of_stroke=rows[:, 1].copy(),
            fill_of_stroke=rows[:, 2].copy(),
            layers=tuple(self._layers),
            symbols=tuple(self.symbols),
            texts=tuple(self.texts),
            unit_m=unit_m,
            unit_source=unit_source,
            paper_unit_m=paper_unit_m,
            page_height=page_height,
            warnings=warnings,
            from_picture=from_picture,
        )

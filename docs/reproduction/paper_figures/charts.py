"""How the figures of the reproduction look: one style for all charts, drawn by matplotlib without a screen."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .figure import Bench, Picture

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

#: Colours that colour-blind readers and black-and-white prints keep apart (Okabe and Ito's).
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
DPI = 130


@contextmanager
def chart(
    bench: Bench, file: str, shows: str, *, columns: int = 1, rows: int = 1, size_in: tuple[float, float] = (4.2, 3.4)
) -> Iterator[tuple[Any, list[Any], list[Picture]]]:
    """Give a figure, its axes (row by row) and a list that gets the `Picture` once it is written."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Sheet

    sheet = Sheet(figsize=(size_in[0] * columns, size_in[1] * rows), dpi=DPI, layout="constrained")
    FigureCanvasAgg(sheet)
    axes = list(sheet.subplots(rows, columns, squeeze=False).flat)
    for one in axes:
        one.spines[["top", "right"]].set_visible(False)
        one.tick_params(labelsize=8)
    written: list[Picture] = []
    yield sheet, axes, written
    save(sheet, bench.folder / file)
    written.append(Picture(file, shows))


def save(sheet: Any, path: Path) -> None:
    """Write a PNG whose bytes hold neither a date nor a version."""
    sheet.savefig(path, metadata={"Software": None, "Creation Time": None})


def label(axes: Any, title: str, x: str, y: str) -> None:
    """Title and axis names in the one size for all charts."""
    axes.set_title(title, fontsize=9, loc="left")
    axes.set_xlabel(x, fontsize=8)
    axes.set_ylabel(y, fontsize=8)


def draw_walls(axes: Any, lines_m: NDArray[np.float64]) -> None:
    """Draw cut walls, (N, 2, 2) segments in metres, and make both axes of one scale without numbers."""
    from matplotlib.collections import LineCollection

    axes.add_collection(LineCollection(list(lines_m), colors="#444444", linewidths=0.5))
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.autoscale_view()


def draw_nothing(axes: Any, f2_m2: float, *, unit: str = "m2") -> None:
    """Draw the line of F2 where a station would be that sees nothing: the sum of all references."""
    axes.axhline(f2_m2, color="#888888", linewidth=0.8, linestyle=":")
    axes.annotate(
        f"a station that sees nothing: {f2_m2:.0f} {unit}",
        (0.02, f2_m2),
        xycoords=("axes fraction", "data"),
        xytext=(0, 2),
        textcoords="offset points",
        fontsize=6,
        color="#555555",
    )

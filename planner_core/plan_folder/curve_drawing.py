"""The curve of coverage: covered share of the achievable area against the number of stations. PlanSource -> drawing."""

from __future__ import annotations

from pathlib import Path

from planner_core.plan_folder.drawing import plot
from planner_core.plan_folder.drawing.canvas import Box, Canvas
from planner_core.plan_folder.drawing.png_canvas import PngCanvas
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.plan_folder.sheet import WIDTH_MM


def draw_curve(canvas: Canvas, plan: PlanSource, box: Box) -> None:
    """Draw covered share against number of stations, the most useful first where the plan has their order."""
    why = plan.document.get("why")
    steps = [] if why is None else why["curve"]
    number = {station.id: station.number for station in plan.stations}
    plot.draw_curve(
        canvas,
        box,
        [step["fraction_of_achievable"] for step in steps] or list(plan.document.get("coverage_curve", ())),
        [str(number.get(step["station"], step["station"])) for step in steps],
        required=float(plan.document["requirements"]["coverage"]),
    )


def write_coverage_curve(plan: PlanSource, path: Path) -> None:
    """Write the curve as a PNG."""
    zoom = 1.6
    canvas = PngCanvas(WIDTH_MM / zoom, 80.0, zoom=zoom)
    draw_curve(canvas, plan, Box(5.0, 2.0, canvas.box.width - 10.0, 76.0))
    canvas.save(path)

"""The curve of coverage: covered share of the achievable area against the number of stations. Plan -> PNG."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from planner_core.model import Plan
from planner_core.plan_folder import palette
from planner_core.plan_folder.sheet import new_sheet, save_sheet

#: Up to here points are drawn, and named while there is room.
_MAX_POINTS, _MAX_NAMES = 60, 25


def write_coverage_curve(plan: Plan, path: Path) -> None:
    """Draw the curve with the station first that adds most; in the order of choice where the plan does not say why."""
    steps = plan.why.curve if plan.why is not None else ()
    shares = [step.fraction_of_achievable for step in steps] or list(plan.coverage_curve)
    curve = np.concatenate([[0.0], 100 * np.asarray(shares, dtype=np.float64)])
    figure = new_sheet(7.0)
    axes = figure.add_axes((0.07, 0.12, 0.89, 0.72))
    asked = 100 * plan.settings.requirements.coverage
    axes.axhline(asked, color=palette.UNSEEN, linewidth=1.5, linestyle=(0, (6, 4)))
    axes.text(0.0, asked + 1.2, f" required: {asked:g} %", color=palette.UNSEEN, fontsize=13, va="bottom")
    marker = "o" if len(curve) <= _MAX_POINTS else ""
    axes.plot(np.arange(len(curve)), curve, color=palette.SEEN_OFTEN, linewidth=2.5, marker=marker, markersize=6)
    if len(steps) <= _MAX_NAMES:
        for number, step in enumerate(steps, start=1):
            at = (number, float(curve[number]))
            axes.annotate(step.station, at, (6, -14), textcoords="offset points", fontsize=10, color=palette.INK)
    axes.set_xlim(0, max(1, len(curve) - 1) * 1.04)
    axes.set_ylim(0, 105)
    axes.set_xlabel("stations", fontsize=13, color=palette.INK)
    axes.set_ylabel("covered share of the achievable area, %", fontsize=13, color=palette.INK)
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.tick_params(labelsize=12, colors=palette.INK)
    axes.grid(color=(0.9, 0.9, 0.9))
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    title = "What each further station adds" + (", the most useful first" if steps else "")
    figure.text(0.028, 0.91, title, fontsize=20, weight="bold", color=palette.INK)
    save_sheet(figure, path)

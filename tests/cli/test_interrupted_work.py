"""Ctrl-C in the middle of work, at a moment that progress names: nothing half-written, or the best plan so far."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tlsplan.progress import ProgressReporter

import scenes_synthetic
from planner_core.progress import ProgressEvent

Tlsplan = Callable[..., Any]


def interrupt_at(monkeypatch: pytest.MonkeyPatch, folder: Path, *stages: str) -> list[set[Path]]:
    """Send one Ctrl-C once something of one of the stages is done; what the folder holds then is in the list."""
    held, show = list[set[Path]](), ProgressReporter.show

    def strike(self: ProgressReporter, event: ProgressEvent) -> None:
        show(self, event)
        if not held and event.stage in stages and event.done > 0:
            held.append(set(folder.iterdir()))
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(ProgressReporter, "show", strike)
    return held


def test_interrupted_simulation_leaves_nothing_half_written(
    tlsplan: Tlsplan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = scenes_synthetic.write(scenes_synthetic.build("box"), tmp_path / "box.ifc")
    (tmp_path / "mine.csv").write_text("id,x_m,y_m,z_m\nA,3,2,1.5\nB,2,2,1.5\n")
    before = set(tmp_path.iterdir())
    held = interrupt_at(monkeypatch, tmp_path, "clouds")
    done = tlsplan(
        "simulate", scene, "--stations", tmp_path / "mine.csv", "-o", tmp_path / "scans", "--scanner", "hdl-64e",
        "--format", "ply",
    )  # fmt: skip
    assert held[0] > before
    assert done.returncode == 130, done.stderr
    assert "interrupted" in done.stderr
    assert "Traceback" not in done.stderr
    assert set(tmp_path.iterdir()) == before


@pytest.mark.slow
def test_an_interrupt_while_stations_are_chosen_leaves_the_best_plan_so_far(
    tlsplan: Tlsplan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = scenes_synthetic.write(scenes_synthetic.build("corridor-comb"), tmp_path / "comb.ifc")
    asked, folder = tmp_path / "asked.yaml", tmp_path / "plan"
    asked.write_text(
        "coverage: 97 %\nseen_from: 2\nclasses:\n  IfcSlab: {coverage: 98 %}\nfloors:\n  F0: {coverage: 96 %}\n"
    )
    held = interrupt_at(monkeypatch, tmp_path, "bound", "prove")
    options = ("--grid", "1", "--height", "1.5", "--patch-area", "0.4", "--verify", "0", "--deliverable", "none")
    done = tlsplan("plan", scene, "-o", folder, "--scanner", "hdl-64e", "--requirements", asked, *options)
    assert (len(held), done.returncode) == (1, 0), done.stderr
    assert "interrupted: keeping the best plan so far" in done.stderr
    document = json.loads((folder / "plan.json").read_text())
    optimality = document["optimality"]
    assert optimality["why_stopped"] == "interrupted"
    assert 0 < optimality["lower_bound"] <= optimality["stations"] == len(document["stations"])
    results = document["requirements"]["results"]
    assert {"overall", "IfcSlab", "F0"} <= {result["name"] for result in results}
    assert all(result["met"] for result in results)
    complete = ["plan.usda", "stations.csv", "viewer/stage.usdc", "viewer/patches.u8", "report/index.html"]
    assert [name for name in complete if not (folder / name).is_file()] == []
    assert [path for path in tmp_path.iterdir() if path.name.startswith(".")] == []

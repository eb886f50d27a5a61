"""`tlsplan batch`: jobs are done once, one that fails fails alone, and whatever ends a batch, it goes on."""

from __future__ import annotations

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
from collections import namedtuple
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tlsplan.batch import runner
from waiting import PATIENCE_S, until

HERE = Path(__file__).parent
STAND_IN = (sys.executable, "-P", str(HERE / "stand_in.py"))
#: The command in a process of its own, its jobs stood in for.
PROGRAM = (
    f"import sys; from tlsplan.batch import runner; runner._PROGRAM = {STAND_IN!r}; "
    "from tlsplan.main import main; main()"
)
Tlsplan = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="session")
def some_plan(tlsplan: Tlsplan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("batch")
    assert tlsplan("scene", "box", "-o", folder / "box.obj").returncode == 0
    done = tlsplan(
        "plan", folder / "box.obj", "-o", folder / "plan", "--grid", "1", "--patch-area", "0.5", "--method", "greedy",
        "--verify", "0", "--coverage", "50",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return folder / "plan" / "plan.json"


@pytest.fixture
def stood_in(some_plan: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(runner, "_PROGRAM", STAND_IN)
    monkeypatch.setenv("STAND_IN_PLAN", str(some_plan))
    return some_plan


def sites(folder: Path, more: str = "", **does: str) -> Path:
    """A sites file of scenes that do something each."""
    lines = [f"  - {{scene: {name}.obj{', ' + more if more else ''}}}" for name in does]
    for name, what in does.items():
        (folder / f"{name}.obj").write_text(what)
    path = folder / "sites.yaml"
    path.write_text("prices: {currency: EUR, hour: 90, station: 5}\nsites:\n" + "\n".join(lines))
    return path


def rows(folder: Path) -> dict[str, dict[str, Any]]:
    return {row["name"]: row for row in json.loads((folder / "summary.json").read_text())["rows"]}


def begun(folder: Path) -> dict[str, int]:
    """When each job was begun last."""
    return {path.stem: path.stat().st_mtime_ns for path in (folder / "jobs").glob("*.log")}


@pytest.mark.slow
def test_figures_of_the_summary_are_those_of_the_plans(tlsplan: Tlsplan, stood_in: Path, tmp_path: Path) -> None:
    done = tlsplan("batch", sites(tmp_path, a="plan", b="plan"), "-o", tmp_path / "out", "--jobs", 2)
    assert done.returncode == 0, done.stderr
    document = json.loads(stood_in.read_text())
    row, time_s = rows(tmp_path / "out")["a"], document["field_time"]["total_s"]
    assert row["stations"] == len(document["stations"]) > 0
    assert (row["lower_bound"], row["gap"]) == (document["optimality"]["lower_bound"], document["optimality"]["gap"])
    assert row["coverage"] == document["coverage"]["fraction_of_achievable"]
    assert row["field_time_s"] == time_s > 0
    assert row["cost"] == pytest.approx(5 * row["stations"] + 90 * time_s / 3600, abs=0.006)
    (total,) = json.loads((tmp_path / "out" / "summary.json").read_text())["totals"]
    assert (total["stations"], total["jobs"], total["failed"]) == (2 * row["stations"], 2, 0)
    assert total["cost"] == pytest.approx(2 * row["cost"])
    assert total["coverage"] == pytest.approx(row["coverage"])
    with (tmp_path / "out" / "summary.csv").open() as file:
        assert [(each["name"], each["stations"]) for each in csv.DictReader(file)] == [
            (name, str(row["stations"])) for name in "ab"
        ]
    page = (tmp_path / "out" / "index.html").read_text()
    assert 'href="plans/a/report/index.html"' in page
    assert f"{row['cost']:.2f}" in page


def test_one_that_fails_is_a_line_and_the_rest_is_planned(tlsplan: Tlsplan, stood_in: Path, tmp_path: Path) -> None:
    path = sites(tmp_path, crash="crash", good="plan", bad="refuse")
    path.write_text(path.read_text() + "\n  - {scene: gone.ifc}\n")
    done = tlsplan("batch", path, "-o", tmp_path / "out")
    assert done.returncode == 8
    warnings = [line for line in done.stderr.splitlines() if line.startswith("warning: ")]
    assert [line.split(":")[1].strip() for line in warnings] == ["gone", "crash", "bad"]
    assert "crashed (segmentation fault)" in warnings[1]
    assert warnings[2].endswith("no triangles, expected some; check the file")
    assert {name: row["state"] for name, row in rows(tmp_path / "out").items()} == {
        "crash": "failed", "good": "planned", "bad": "failed", "gone": "failed",
    }  # fmt: skip
    assert "segmentation fault" in (tmp_path / "out" / "index.html").read_text()


def test_what_is_planned_is_not_planned_again_and_what_failed_is_tried_again(
    tlsplan: Tlsplan, stood_in: Path, tmp_path: Path
) -> None:
    path, out = sites(tmp_path, a="plan", b="plan", c="crash"), tmp_path / "out"
    assert tlsplan("batch", path, "-o", out).returncode == 8
    first = begun(out)
    (tmp_path / "c.obj").write_text("plan")
    (tmp_path / "a.obj").touch()
    assert tlsplan("batch", path, "-o", out).returncode == 0
    second = begun(out)
    assert [name for name in first if first[name] != second[name]] == ["c"]
    path.write_text(path.read_text().replace("a.obj", "a.obj, coverage: 90"))  # another option of one
    (out / "plans" / "b" / "plan.json").write_text("{}")  # a plan that was changed
    assert tlsplan("batch", path, "-o", out).returncode == 0
    third = begun(out)
    assert sorted(name for name in second if second[name] != third[name]) == ["a", "b"]
    assert "--coverage=90" in (out / "plans" / "a" / "words.txt").read_text()


def test_each_storey_has_a_plan_of_its_own(tlsplan: Tlsplan, stood_in: Path, tmp_path: Path) -> None:
    path, out = sites(tmp_path, "floors: each", a="plan"), tmp_path / "out"
    assert tlsplan("batch", path, "-o", out).returncode == 0
    assert [(row["name"], row["floor"]) for row in rows(out).values()] == [("a-F0", "F0"), ("a-F1", "F1")]
    assert "--floor=F1" in (out / "plans" / "a-F1" / "words.txt").read_text()
    first = begun(out)
    assert tlsplan("batch", path, "-o", out).returncode == 0
    assert begun(out) == first


def test_a_folder_that_no_batch_wrote_is_refused(tlsplan: Tlsplan, stood_in: Path, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine.txt").write_text("x")
    done = tlsplan("batch", sites(tmp_path, a="plan"), "-o", tmp_path / "out")
    assert (done.returncode, done.stderr.count("\n")) == (5, 1)
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["mine.txt"]


def test_a_disk_that_is_full_ends_the_batch_and_nothing_is_lost(
    tlsplan: Tlsplan, stood_in: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, out = sites(tmp_path, a="plan", b="plan"), tmp_path / "out"
    usage, frees = namedtuple("usage", "total used free"), iter([10**9, 10**6])
    with monkeypatch.context() as patch:
        patch.setattr(shutil, "disk_usage", lambda where: usage(0, 0, next(frees)))
        done = tlsplan("batch", path, "-o", out, "--jobs", 1)
    assert done.returncode == 9
    assert "its disk has 1 MB left" in done.stderr
    assert {name: row["state"] for name, row in rows(out).items()} == {"a": "planned", "b": "not planned yet"}
    assert tlsplan("batch", path, "-o", out).returncode == 0


# ------------------------------------------------------------------------------------------------ processes
def started(path: Path, out: Path, plan: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM, "batch", str(path), "-o", str(out), "--jobs", "2"],
        env={**os.environ, "STAND_IN_PLAN": str(plan)}, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def process_of(log: Path) -> int:
    text = log.read_text() if log.is_file() else ""
    return int(text.split("process ")[1]) if "process" in text and text.endswith("\n") else 0


def is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()[0] != b"Z"
    except OSError:
        return False


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="jobs of a killed batch end on Linux alone")
@pytest.mark.parametrize(
    "number",
    [signal.SIGKILL, *(pytest.param(number, marks=pytest.mark.slow) for number in (signal.SIGINT, signal.SIGTERM))],
)
def test_a_batch_that_is_ended_takes_its_jobs_along_and_goes_on(
    number: int, tlsplan: Tlsplan, stood_in: Path, tmp_path: Path
) -> None:
    path, out = sites(tmp_path, a="plan", b="wait", c="plan"), tmp_path / "out"
    batch = started(path, out, stood_in)
    try:
        pid = until(lambda: process_of(out / "jobs" / "b.log"))
        until(lambda: (out / "jobs" / "c.json").is_file())
        done = tlsplan("batch", path, "-o", out)
        assert (done.returncode, done.stderr.count("\n")) == (5, 1)
        assert "another batch is at work in it" in done.stderr
        assert is_alive(pid)
        batch.send_signal(number)
        _, said = batch.communicate(timeout=PATIENCE_S)
    finally:
        batch.kill()
    until(lambda: not is_alive(pid))
    if number != signal.SIGKILL:
        assert batch.returncode == 130
        assert said.count("interrupted") == 1
        assert rows(out)["b"]["state"] == "not planned yet"
    assert not (out / "plans" / "b").exists()
    first = begun(out)
    (tmp_path / "b.obj").write_text("plan")
    assert tlsplan("batch", path, "-o", out).returncode == 0
    second = begun(out)
    assert [name for name in first if first[name] != second[name]] == ["b"]


@pytest.mark.slow
def test_the_plan_of_a_batch_is_that_of_the_command_alone(tlsplan: Tlsplan, tmp_path: Path) -> None:
    assert tlsplan("scene", "box", "-o", tmp_path / "box.obj").returncode == 0
    options = {"grid": 1, "patch_area": 0.5, "coverage": 80, "verify": 0, "set": "work_limit=1"}
    words = [f"--{name.replace('_', '-')}={value}" for name, value in options.items()]
    (tmp_path / "sites.json").write_text(json.dumps({"defaults": options, "sites": [{"scene": "box.obj"}]}))
    done = tlsplan("batch", tmp_path / "sites.json", "-o", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    alone = tmp_path / "out" / "plans" / "alone"  # as far from the scene: plan.json says the way to it
    assert tlsplan("plan", tmp_path / "box.obj", "-o", alone, *words).returncode == 0
    documents = [json.loads((folder / "plan.json").read_text()) for folder in (alone, alone.with_name("box"))]
    for document in documents:
        del document["timings_s"]
    assert documents[0] == documents[1]

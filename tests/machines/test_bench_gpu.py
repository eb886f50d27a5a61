"""What runs on a machine with a GPU, in small, on this one's processor."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def bench_gpu(*arguments: object) -> None:
    command = [sys.executable, "-m", "tests.benchmarks.bench_gpu", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
@pytest.mark.usefixtures("needs_opencl")
def test_every_step_runs_from_the_packed_folder_and_the_page_shows_it(tmp_path: Path) -> None:
    bench_gpu("pack", tmp_path / "packed")
    bench_gpu("run", tmp_path / "packed", "--quick", "--cpu", "--write", tmp_path / "results.json")
    steps = json.loads((tmp_path / "results.json").read_text())["steps"]
    assert {step: each["ended"] for step, each in steps.items() if each["ended"]} == {}
    assert steps["check"]["rows"][0]["problem"] == ""
    assert steps["kernels"]["rows"][0]["same_bits"] is True
    assert all(row["share"] < 1e-4 for row in steps["scans"]["rows"] if "share" in row)
    assert all(row["same_set"] for row in steps["genetic"]["rows"])
    assert steps["tests"]["rows"][0]["failed"] == []
    bench_gpu("page", tmp_path / "results.json", "--write", tmp_path / "gpu.md")
    page = (tmp_path / "gpu.md").read_text()
    assert "to the bit what a processor computes" in page
    assert page.count("| done |") == len(steps) == 7


@pytest.mark.slow
def test_a_step_that_fails_costs_its_own_rows(tmp_path: Path) -> None:
    (tmp_path / "kernels.json").write_text("{}")
    results = tmp_path / "results.json"
    results.write_text(json.dumps({"steps": {"check": {"rows": [], "ended": "", "seconds": 1.0}}}))
    bench_gpu("run", tmp_path, "--quick", "--cpu", "--only", "genetic", "tune", "--write", results)
    steps = json.loads(results.read_text())["steps"]
    assert list(steps) == ["check", "genetic", "tune"]
    assert "synthetic office.scene.npz" in steps["tune"]["ended"]
    assert steps["genetic"]["rows"] == []

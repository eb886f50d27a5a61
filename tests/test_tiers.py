"""Every test is in one of two tiers, and continuous integration runs both; skips are listed, the order is free."""

import json
import os
import re
import subprocess
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

ROOT = Path(__file__).resolve().parents[1]
E2E = ROOT / "viewer_web" / "e2e"
SCRIPTS = json.loads((ROOT / "viewer_web" / "package.json").read_text())["scripts"]


def make(*words: str, **variables: str) -> str:
    """Output of make without the settings of a make that runs these tests."""
    env = {name: value for name, value in os.environ.items() if name not in {"MAKEFLAGS", "MAKELEVEL", "PYTEST_ARGS"}}
    command = ["make", *words]
    return subprocess.run(command, cwd=ROOT, env=env | variables, capture_output=True, text=True, check=True).stdout


def test_processes_keep_compiled_modules_under_make(tmp_path: Path) -> None:
    environment = tmp_path / "environment.mk"
    environment.write_text("environment:\n\t@env\n")
    shown = make("-s", "-f", "Makefile", "-f", str(environment), "environment", PYTHONDONTWRITEBYTECODE="1")
    assert "\nPATH=" in f"\n{shown}"
    assert "PYTHONDONTWRITEBYTECODE" not in shown


def test_tiers_hold_every_check_and_every_test() -> None:
    quick, slow = make("-n", "test"), make("-n", "test-slow")
    checks = ("ruff check .", "ruff format --check .", "mypy", "lint-imports")
    for command in (*checks, *(f"npm run --silent {name}" for name in ("lint", "typecheck", "test", "e2e:main"))):
        assert command in quick, command
    assert "npm run --silent e2e\n" in slow
    [of_quick], [of_slow] = (
        re.findall(r"^(?:\w+=\d )*\S*/pytest .*$", commands, flags=re.M) for commands in (quick, slow)
    )
    assert of_quick.replace("not slow", "slow and not campaign") == of_slow != of_quick


def test_campaigns_run_all_of_what_the_slow_tier_samples() -> None:
    campaigns = make("-n", "campaigns")
    for program in (
        "-m campaign",
        "demo_everywhere.py", "check_kernels.py", "tests.faults.campaign", "fuzz_scenes", "fuzz_documents",
        "soak_watertight.py", "soak_server.py", "--random-order", "bare_systems/run.sh",
    ):  # fmt: skip
        assert program in campaigns, program


def test_every_browser_test_runs_in_one_mode_and_the_tiers_share_two_of_them() -> None:
    """A mode that lists no files has all others; the other modes are outside both tiers."""
    assert {name: script.split("--mode ")[-1] for name, script in SCRIPTS.items() if name.startswith("e2e")} == {
        "e2e:main": "main",
        "e2e": "rest",
        "e2e:firefox": "firefox",
        "e2e:scenes": "scenes",
    }
    listed = re.findall(r"^  (\w+): \[(.*)\],$", (E2E / "vitest.config.ts").read_text(), flags=re.M)
    assert [(mode, re.findall(r"'([^']+)'", files)) for mode, files in listed] == [
        ("main", ["journeys.e2e.ts"]),
        ("firefox", ["firefox-more.e2e.ts"]),
        ("scenes", ["scenes.e2e.ts", "memory.e2e.ts"]),
    ]
    assert [path for path in E2E.rglob("*.e2e.ts") if path.parent != E2E] == []


@pytest.mark.parametrize("failing", ["none", "test", "test-slow"])
def test_ci_runs_both_tiers_and_fails_where_either_fails(tmp_path: Path, failing: str) -> None:
    targets, stub = tmp_path / "targets", tmp_path / "make"
    stub.write_text(f'#!/bin/sh\necho "$1" >> {targets}\n[ "$1" != {failing} ]\n')
    stub.chmod(0o755)
    env = {**os.environ, "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
    command = ["bash", str(ROOT / ".ci" / "run")]
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
    assert targets.read_text().split() == ["test", "test-slow"]
    assert (done.returncode, done.stdout) == ((0, "") if failing == "none" else (1, f"make {failing} failed\n"))


@pytest.fixture
def arrangement(request: pytest.FixtureRequest) -> ModuleType:
    """`tests/conftest.py`."""
    plugin = request.config.pluginmanager.get_plugin(str(ROOT / "tests" / "conftest.py"))
    assert isinstance(plugin, ModuleType)
    return plugin


def test_random_order_keeps_groups_together_and_repeats(arrangement: ModuleType) -> None:
    def order_of(seed: str) -> list[str]:
        items = [
            SimpleNamespace(nodeid=f"{group}{n}", get_closest_marker=group_of(group))
            for group in "abc"
            for n in range(9)
        ]
        arrangement.pytest_collection_modifyitems(SimpleNamespace(getoption=lambda _: seed), items)
        return [item.nodeid for item in items]

    def group_of(group: str) -> Callable[[str], pytest.Mark | None]:
        return lambda marker: pytest.mark.xdist_group(group).mark if marker == "xdist_group" else None

    first = order_of("1")
    assert order_of("1") == first != order_of("2")
    assert sorted(first) == sorted(order_of(""))
    for group in "abc":
        numbers = [name for name in first if name.startswith(group)]
        assert "".join(numbers) in "".join(first)
        assert numbers != sorted(numbers)


def test_skipped_tests_are_counted_and_named_by_reason(
    arrangement: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    skipped = [("a.py::test_x", "no browser"), ("a.py::test_y[1]", "no browser"), ("b.py", "no device")]
    reports = [SimpleNamespace(nodeid=name, longrepr=("", 1, f"Skipped: {reason}")) for name, reason in skipped]
    shown: list[str] = []
    reporter = SimpleNamespace(getreports=lambda _: reports, write_line=shown.append)
    monkeypatch.setenv("SKIPPED_TESTS", str(tmp_path / "skipped.txt"))
    monkeypatch.setenv("PYTEST_XDIST_WORKER", "gw0")  # its tests are those of the controller, too
    arrangement.pytest_terminal_summary(reporter)
    assert shown == ["2 skipped: no browser (a.py)", "1 skipped: no device (b.py)"]
    monkeypatch.delenv("PYTEST_XDIST_WORKER")
    for _ in range(2):
        arrangement.pytest_terminal_summary(reporter)
    assert (tmp_path / "skipped.txt").read_text().splitlines() == shown[2:] == 2 * shown[:2]

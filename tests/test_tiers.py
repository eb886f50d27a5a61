"""No test falls between the tiers: what `make test` leaves out `make test-slow` runs, and CI runs both."""

import json
import os
import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
E2E = ROOT / "viewer_web" / "e2e"
SCRIPTS = json.loads((ROOT / "viewer_web" / "package.json").read_text())["scripts"]


def commands_of(target: str) -> list[str]:
    """What make would run, without what a make around this test told it."""
    env = {name: value for name, value in os.environ.items() if name not in {"MAKEFLAGS", "MAKELEVEL", "PYTEST_ARGS"}}
    done = subprocess.run(["make", "-n", target], cwd=ROOT, env=env, capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


def test_processes_keep_what_they_compiled_wherever_make_runs(tmp_path: Path) -> None:
    told = tmp_path / "told.mk"
    told.write_text("told:\n\t@env\n")
    env = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
    command = ["make", "-s", "-f", "Makefile", "-f", str(told), "told"]
    said = subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True, check=True).stdout
    assert "\nPATH=" in f"\n{said}"
    assert "PYTHONDONTWRITEBYTECODE" not in said


def pytest_of(target: str) -> str:
    """The command that takes all tests; those on other machines name folders."""
    [command] = [line.strip() for line in commands_of(target) if "/pytest " in line and "PYTHONPATH" not in line]
    return command


def test_python_tests_are_slow_or_they_are_not() -> None:
    fast, slow = pytest_of("test"), pytest_of("test-slow")
    assert '-m "not slow"' in fast
    assert "-m slow" in slow
    assert fast.replace('-m "not slow"', "") == slow.replace("-m slow", "")


def test_the_quick_tier_has_every_static_check_the_viewers_tests_and_a_browser() -> None:
    said = "\n".join(commands_of("test"))
    scripts = [f"npm run --silent {name}" for name in ("lint", "typecheck", "test", "e2e:main")]
    for part in ("ruff check .", "ruff format --check .", "mypy", "lint-imports", *scripts):
        assert part in said, part


def test_the_slow_tier_has_the_kernels_the_soak_the_fuzzer_and_all_of_the_browser() -> None:
    said = "\n".join(commands_of("test-slow"))
    for part in (
        "check_kernels.py",
        "soak_watertight.py",
        "fuzz_scenes",
        "npm run --silent e2e\n",
        "demo_everywhere.py",
    ):
        assert part in f"{said}\n", part


def test_the_browsers_main_paths_are_a_part_of_all_paths_and_no_file_is_left_out() -> None:
    assert SCRIPTS["e2e:main"] == f"{SCRIPTS['e2e']} --tags-filter main"
    assert "filter" not in SCRIPTS["e2e"]
    config = (E2E / "vitest.config.ts").read_text()
    included, excluded = (re.findall(rf"^ +{key}: (.*),$", config, flags=re.M) for key in ("include", "exclude"))
    assert included == ["['*.e2e.ts']"]
    # Plans of whole scenes, and of sixty stations.
    assert excluded == ["['scenes.e2e.ts', 'memory.e2e.ts']"]
    assert "include: ['scenes.e2e.ts', 'memory.e2e.ts']" in (E2E / "scenes.config.ts").read_text()
    assert [path for path in E2E.rglob("*.e2e.ts") if path.parent != E2E] == []


def test_ci_runs_both_tiers_and_fails_where_either_fails(tmp_path: Path) -> None:
    asked = tmp_path / "asked"
    for failing in ("none", "test", "test-slow"):
        asked.write_text("")
        (tmp_path / "make").write_text(
            f'#!/bin/sh\nfor last; do :; done\necho "$last" >> {asked}\n[ "$last" != {failing} ]\n'
        )
        (tmp_path / "make").chmod(0o755)
        env = {**os.environ, "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
        done = subprocess.run(["bash", str(ROOT / ".ci" / "run")], env=env, check=False)
        assert asked.read_text().split() == ["test", "test-slow"]
        assert (done.returncode == 0) == (failing == "none")

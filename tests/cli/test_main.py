"""The command group: help, laziness, exit codes, reference."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner
from tlsplan import exit_codes
from tlsplan.group import COMMANDS, RENAMED_OPTIONS, cli

Tlsplan = Callable[..., "subprocess.CompletedProcess[str]"]
ROOT = Path(__file__).resolve().parents[2]
HEAVY = (
    "open3d",
    "pyopencl",
    "pxr",
    "pyvista",
    "vtk",
    "OpenImageIO",
    "ifcopenshell",
    "numba",
    "scipy",
    "numpy",
    "rich",
)


def test_help_loads_no_heavy_package() -> None:
    program = (
        "import sys\n"
        "from tlsplan.group import COMMANDS, cli\n"
        "for arguments in (['--help'], *([name, '--help'] for name in COMMANDS)):\n"
        "    cli.main(arguments, standalone_mode=False)\n"
        f"    print(arguments, sorted(set(sys.modules) & set({HEAVY!r})), file=sys.stderr)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=240, check=True)
    assert done.stdout.count("Usage:") == 1 + len(COMMANDS)
    assert [line for line in done.stderr.splitlines() if not line.endswith("] []")] == []
    assert len(done.stderr.splitlines()) == 1 + len(COMMANDS)


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_every_command_shows_an_example(name: str) -> None:
    text = CliRunner().invoke(cli, [name, "--help"]).output
    assert "Example:  tlsplan" in text


@pytest.mark.parametrize("given", [("--fixed", "done.csv"), ("--fixed=done.csv",)])
def test_options_by_the_names_of_the_last_release_are_taken_with_a_notice(
    given: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    told = CliRunner().invoke(cli, ["plan", *given, "house.ifc"])
    assert told.stderr == "warning: --fixed is now --scanned; the old name will be removed in the next release\n"
    assert str(told.exception).startswith("done.csv: no such file")
    literal = CliRunner().invoke(cli, ["plan", "--", *given])
    assert "is now" not in literal.stderr


def test_renamed_options_are_options_and_their_old_names_are_not() -> None:
    context = cli.make_context("tlsplan", [], resilient_parsing=True)
    commands = [cli.get_command(context, name) for name in COMMANDS]
    names = {name for command in commands if command is not None for each in command.params for name in each.opts}
    assert names >= set(RENAMED_OPTIONS.values())
    assert not names & set(RENAMED_OPTIONS)


def test_help_of_every_option_says_what_it_is() -> None:
    context = cli.make_context("tlsplan", [], resilient_parsing=True)
    for name in cli.list_commands(context):
        command = cli.get_command(context, name)
        assert command is not None
        for parameter in command.params:
            assert parameter.param_type_name == "argument" or parameter.help, f"{name}: {parameter.name} has no help"


def test_every_command_file_is_listed() -> None:
    files = {path.stem for path in (ROOT / "cli" / "commands").glob("*.py")} - {"__init__"}
    assert files == set(COMMANDS)


def test_reference_in_docs_is_the_one_the_commands_give(tmp_path: Path) -> None:
    # In a process of its own: click keeps the help option of a command that a test called without its group.
    made = tmp_path / "cli.md"
    subprocess.run([sys.executable, "-m", "tlsplan.reference", str(made)], check=True)
    in_docs = (ROOT / "docs" / "reference" / "cli.md").read_text(encoding="utf-8")
    assert in_docs == made.read_text(encoding="utf-8"), "run `make docs`"


def test_missing_scene_ends_with_one_line_and_code_3(tlsplan: Tlsplan, tmp_path: Path) -> None:
    done = tlsplan("plan", tmp_path / "nowhere.ifc", "-o", tmp_path / "plan")
    assert done.returncode == 3
    assert done.stderr.count("\n") == 1
    assert "nowhere.ifc" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_unknown_scanner_ends_with_the_names_there_are(tlsplan: Tlsplan, tmp_path: Path) -> None:
    done = tlsplan("plan", tmp_path / "x.obj", "--scanner", "hdl-65e")
    assert done.returncode in (3, 4)
    assert done.stderr.count("\n") == 1
    assert "hdl-64e" in done.stderr


def test_internal_errors_are_one_line_that_asks_for_a_report() -> None:
    line = exit_codes.line_of(ZeroDivisionError("division\nby zero"))
    assert "\n" not in line
    assert "report" in line
    assert exit_codes.exit_code_of(ZeroDivisionError()) == 1


@pytest.mark.parametrize(
    ("name", "code"),
    [
        ("SceneError", 3), ("SceneNotFoundError", 3), ("StationListError", 3), ("PlanFolderError", 3),
        ("RequirementError", 4), ("OutputExistsError", 5), ("DeviceError", 6), ("MissingPackageError", 6),
    ],
)  # fmt: skip
def test_every_error_class_has_the_documented_exit_code(name: str, code: int) -> None:
    from planner_core import errors

    assert exit_codes.exit_code_of(getattr(errors, name)("x")) == code


@pytest.mark.slow
def test_scanners_json_lists_the_hdl_64e_in_a_process_of_its_own() -> None:
    command = [sys.executable, "-m", "tlsplan", "scanners", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 0
    scanner = next(s for s in json.loads(done.stdout)["scanners"] if s["name"] == "hdl-64e")
    assert (scanner["n_azimuths"], scanner["n_channels"], scanner["range_max_m"]) == (4500, 64, 5.0)
    assert (scanner["elevation_min_deg"], scanner["elevation_max_deg"]) == (-24.9, 2.0)


@pytest.mark.slow  # it compiles all kernels anew; tests/cli/test_doctor.py asks all but that
@pytest.mark.opencl
def test_doctor_finds_a_healthy_installation(tlsplan: Tlsplan) -> None:
    done = tlsplan("doctor", "--json")
    document = json.loads(done.stdout)
    assert [f for f in document["findings"] if f["needed"] and not f["ok"]] == []
    assert done.returncode == 0
    assert any(f["subject"] == "scan engine" for f in document["findings"])

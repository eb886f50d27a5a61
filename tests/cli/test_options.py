"""Options that are refused before anything is loaded."""

import click
import pytest
from click.testing import CliRunner
from tlsplan.commands.batch import command as batch
from tlsplan.main import main
from tlsplan.options import scheduler_option


@click.command()
@scheduler_option
def told(scheduler: str | None) -> None:
    click.echo(scheduler)


@pytest.mark.parametrize("address", ["local", "local:1", "local:1000", "tcp://10.0.0.1:8786", "inproc://10.0.0.1/1/2"])
def test_a_scheduler_is_an_address_or_workers_of_this_machine(address: str) -> None:
    assert CliRunner().invoke(told, ["--scheduler", address]).output == f"{address}\n"


@pytest.mark.parametrize("address", ["", "local:", "local:0", "local:1001", "local:many", "10.0.0.1:8786", "locals"])
def test_what_names_no_scheduler_is_refused_in_one_line(address: str) -> None:
    for command, more in ((told, []), (batch, ["no sites.yaml", "-o", "out"])):
        result = CliRunner().invoke(command, [*more, "--scheduler", address])
        assert result.exit_code == 2
        expected = f"got {address}, expected tcp://HOST:PORT, local, or local:N with 1 to 1000 workers"
        assert expected in " ".join(result.output.split())


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["plan", "a.ifc", "--grid", "1in"], "or the unit: 20in. See `tlsplan plan --help`."),
        (["plan", "a.ifc", "--glass", "no"], "'stop', 'pass', 'return'. See `tlsplan plan --help`."),
        (
            ["plan", "a.ifc", "--join", "outside", "--doors", "closed"],
            "through open doors: leave out --doors closed. See `tlsplan plan --help`.",
        ),
        (["plan", "a.ifc", "--gird", "1"], "? See `tlsplan plan --help`."),
    ],
)
def test_a_line_about_usage_ends_its_sentence(
    words: list[str], line: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", ["tlsplan", *words])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert said.endswith(f"{line}\n"), said
    assert said.count("\n") == 1

"""The documentation: its links lead somewhere, and its commands are commands of the program."""

import re
import shlex
from pathlib import Path

import click
import pytest
from tlsplan.group import cli

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
BY_NAME = {str(page.relative_to(ROOT)): page for page in PAGES}


def commands(page: Path) -> list[str]:
    """Lines of code blocks that call tlsplan, with prompt, comment and quoted output taken off."""
    found = []
    fenced = False
    for line in page.read_text(encoding="utf-8").splitlines():
        if line.startswith("```"):
            fenced = not fenced
            continue
        match = re.match(r"(?:\$ )?(?:\.venv/bin/)?(tlsplan .*)", line.removeprefix("    "))
        if match and (fenced or line.startswith("    ")):
            found.append(match[1])
    return found


@pytest.mark.parametrize("name", BY_NAME)
def test_links_lead_to_files_of_the_repository(name: str) -> None:
    text = re.sub(r"```.*?```", "", BY_NAME[name].read_text(encoding="utf-8"), flags=re.S)
    targets = re.findall(r"\]\(([^)#\s]+)[^)]*\)", text)
    missing = [t for t in targets if "://" not in t and not (BY_NAME[name].parent / t).exists()]
    assert missing == []


@pytest.mark.parametrize("name", [name for name, page in BY_NAME.items() if commands(page)])
def test_commands_in_the_documentation_are_understood(name: str) -> None:
    for line in commands(BY_NAME[name]):
        words = shlex.split(line, comments=True)[1:]
        group = click.Context(cli, info_name="tlsplan")
        if words[0].startswith("-"):
            cli.make_context("tlsplan", words, resilient_parsing=True)
            continue
        command = cli.get_command(group, words[0])
        assert command is not None, line
        try:
            command.make_context(words[0], words[1:], parent=group)
        except click.exceptions.Exit:
            continue  # --help
        except click.UsageError as error:
            pytest.fail(f"{line}: {error.format_message()}")


def test_tutorial_calls_the_program() -> None:
    assert len(commands(ROOT / "docs" / "tutorial.md")) >= 5

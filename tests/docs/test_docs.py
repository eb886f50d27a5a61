"""The documentation: its links and names lead somewhere, its commands run as they stand, and it quotes what they print.

`make docs` runs the same pages and writes what came out into them.
"""

import os
import re
import shutil
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import click
import pytest
from doc_pages import Block, Page, refreshed
from in_process import Tlsplan
from tlsplan.group import cli

ROOT = Path(__file__).resolve().parents[2]
TOP_PAGES = [ROOT / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md")]
PAGES = sorted([*TOP_PAGES, *(ROOT / "docs").rglob("*.md")])
BY_NAME = {str(page.relative_to(ROOT)): page for page in PAGES}
FIRST = ["README.md", "docs/tour.md"]
CheckPage = Callable[[str, Callable[[Block], bool]], None]
TOPS = "planner_core|cli|docs|tests|kernels|viewer_web|scenes_synthetic|requirements"
MADE = r"node_modules|test-results|/dist\b"
"""Folders that only runs of something make."""
OF_OTHERS = {
    "CHANGELOG.md", "Drawing.saveas", "KilledWorker", "CorrespondenceRejectorTrimmed", "Runtime.getHeapUsage",
    "pandarGeneral_internal.cc", "angle_correction_Pandar64.csv", "summary.seen_area", "File_0_architecture_ifc",
    "Flatten", "gps_time", "links_F0.png", "easting_ftUS", "db.xml", "HesaiLidar_General_SDK",
}  # fmt: skip
"""Names that pages give and no source has: of other programs, of examples, of what was decided against."""
RUN = sorted({*FIRST, "docs/tutorial.md", *(name for name in BY_NAME if name.startswith("docs/howto/"))})


def test_links_lead_to_files_of_the_repository() -> None:
    for name, page in BY_NAME.items():
        text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.S)
        targets = re.findall(r"\]\(([^)#\s]+)[^)]*\)", text) + re.findall(r'<img src="([^"]+)"', text)
        assert [t for t in targets if "://" not in t and not (page.parent / t).exists()] == [], name


@pytest.fixture
def check_page(
    tlsplan: Tlsplan, request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> CheckPage:
    """Run due blocks of a page in a folder of its own, and compare it with what came out, or write that into it."""

    def give(name: str) -> str:
        assert name == "demo"
        demo: Path = request.getfixturevalue("demo_folder")
        shutil.copytree(demo, "out")
        return (demo / "printed.txt").read_text()

    def check(name: str, is_due: Callable[[Block], bool]) -> None:
        monkeypatch.chdir(tmp_path)
        page = Page(BY_NAME[name])
        fresh = page.run(tlsplan, give, is_due)
        if "WRITE_DOCS" in os.environ:
            BY_NAME[name].write_text("\n".join(fresh) + "\n", encoding="utf-8")
        else:
            assert page.lines == fresh, f"{name} quotes what is not printed: run `make docs`"

    return check


@pytest.mark.opencl
@pytest.mark.parametrize("name", FIRST)
def test_the_first_pages_quote_what_their_commands_print(name: str, check_page: CheckPage) -> None:
    check_page(name, lambda block: not block.is_slow)


@pytest.mark.opencl
@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in RUN if name not in FIRST or Page(BY_NAME[name]).has_slow_blocks])
def test_all_pages_quote_what_their_commands_print(name: str, check_page: CheckPage) -> None:
    check_page(name, lambda block: block.is_slow or name not in FIRST)


def test_blocks_of_pages_are_run_or_say_why_not() -> None:
    for name in RUN:
        page = Page(BY_NAME[name])
        source = "\n".join(page.lines)
        assert source.count("```") == 2 * sum(block.is_fenced for block in page.blocks), name
        prompts = sum(line.startswith("$ ") for block in page.blocks for line in block.lines)
        assert len(re.findall(r"^ *\$ ", source, flags=re.M)) == prompts, name
        for block in page.blocks:
            runs = block.is_left_out or "file" in block.comments or block.language in {"sh", "python", "", "text"}
            assert runs, f"{name}:{block.first}: neither run nor a file, and no comment gives the reason"


def test_commands_of_the_documentation_are_understood_where_no_page_runs_them() -> None:
    seen = 0
    for name in BY_NAME:
        for block in Page(BY_NAME[name]).blocks:
            for command, _ in block.parts() if block.is_left_out or name not in RUN else []:
                if command is not None and command.arguments is not None:
                    _understand(f"{name}:{command.line}", command.arguments)
                    seen += 1
    assert seen > 10


def _understand(place: str, words: list[str]) -> None:
    group = click.Context(cli, info_name="tlsplan")
    if words[0].startswith("-"):
        cli.make_context("tlsplan", words, resilient_parsing=True)
        return
    command = cli.get_command(group, words[0])
    assert command is not None, place
    try:
        command.make_context(words[0], words[1:], parent=group)
    except click.exceptions.Exit:
        return  # --help
    except click.UsageError as error:
        pytest.fail(f"{place}: {error.format_message()}")


@cache
def _paths_of_the_repository() -> str:
    folders = [path for path in ROOT.iterdir() if path.is_dir() and path.name not in {"out", "build", "dist"}]
    below = [path for folder in folders if folder.name[0] != "." for path in folder.rglob("*")]
    return "".join(f"/{path.relative_to(ROOT).as_posix()}\n" for path in [*ROOT.iterdir(), *below])


def test_names_in_backticks_are_files_and_targets_of_the_repository() -> None:
    targets = set(re.findall(r"^([a-z][\w-]*):", (ROOT / "Makefile").read_text(), flags=re.M))
    for name, page in BY_NAME.items():
        source = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.S)
        words = re.findall(r"`([^`\n]+)`", re.sub(r"github\.com/.*\n.*", "", source))  # files of other projects
        missing = [word for word in words if (made := re.match(r"make ([a-z][\w-]*)", word)) and made[1] not in targets]
        for word in words:
            if re.fullmatch(rf"[\w./*-]+\.(py|cl|h|ts|sh|lock)|({TOPS})/[\w./*-]*", word) and not re.search(MADE, word):
                path = re.escape(word.rstrip("/")).replace(r"\*", "[^\n]*")
                missing += [] if re.search(rf"/{path}\n", _paths_of_the_repository()) else [word]
        assert missing == [], name


@cache
def _words_of_the_code() -> frozenset[str]:
    """What sources outside docstrings and comments name, and the names of files: modules, classes, functions, keys."""
    folders = (
        "planner_core",
        "cli",
        "viewer_web/server",
        "viewer_web/src",
        "scenes_synthetic",
        "kernels",
        "docs",
        "tests",
    )
    files = [
        file for folder in folders for file in (ROOT / folder).rglob("*") if file.suffix in {".py", ".ts", ".cl", ".h"}
    ]
    source = "\n".join(file.read_text(encoding="utf-8") for file in [*files, ROOT / "Makefile"])
    code = re.sub(r'"""[\s\S]*?"""|(#|//) .*', "", source)
    stems = {name for file in files for name in (file.stem, file.parent.name)}
    words = {*re.findall(r"--[a-z][\w-]*|\w+", code), *stems}
    return frozenset(words | {word[2:].replace("-", "_") for word in words if word.startswith("--")})  # in files


@cache
def _options_of(name: str) -> frozenset[str] | None:
    """Options of a command of tlsplan, and of those in its group; None: there is no such command."""
    context = click.Context(cli, info_name="tlsplan")
    command = cli.get_command(context, name)
    if command is None:
        return None
    commands = [command, *(command.commands.values() if isinstance(command, click.Group) else ())]
    options = {opt for each in commands for param in each.params for opt in (*param.opts, *param.secondary_opts)}
    return frozenset({*options, "--help"})


def _unknown(text: str) -> list[str]:
    """Names in a piece of code, such as `module.Class` or `tlsplan plan --seed 1`, that the sources do not have."""
    options = re.findall(r"(?<![\w-])--[a-z][\w-]*", text)
    if command := re.match(r"(?:\.venv/bin/)?tlsplan ([a-z]+)", text):
        known = _options_of(command[1])
        return [text] if known is None else [option for option in options if option not in known]
    if re.match(r"--[a-z]", text):
        return [opt for opt in options if not any(opt in (_options_of(each) or ()) for each in cli.list_commands(None))
                and opt not in _words_of_the_code()]  # fmt: skip
    name = text.partition("(")[0]
    if not re.fullmatch(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)+|_?[A-Z][a-z]\w{2,}|[a-z]{2}\w*_\w+", name):
        return []
    return [name for word in name.split(".") if word not in _words_of_the_code()]


def _docstrings() -> Iterator[tuple[str, str]]:
    for folder in ("planner_core", "cli", "viewer_web/server", "scenes_synthetic", "docs"):
        for file in sorted((ROOT / folder).rglob("*.py")):
            yield (
                file.relative_to(ROOT).as_posix(),
                "\n".join(re.findall(r'"""[\s\S]*?"""|# .*', file.read_text(encoding="utf-8"))),
            )


def test_names_in_pages_and_docstrings_are_those_of_the_code() -> None:
    """Modules, classes, functions, fields, commands and options in backticks; a path of the repository anywhere."""
    pages = [(name, re.sub(r"```[\s\S]*?```|github\.com/.*\n.*", "", page.read_text(encoding="utf-8")))
             for name, page in BY_NAME.items()]  # fmt: skip
    missing = {(name, unknown) for name, text in [*pages, *_docstrings()] for code in re.findall(r"`([^`\n]+)`", text)
               for unknown in _unknown(code)}  # fmt: skip
    paths = {(name, path) for name, text in _docstrings()
             for path in re.findall(rf"(?<![\w./-])(?:{TOPS})/[\w./-]*\.[a-z]+\b", text)}  # fmt: skip
    missing |= {(name, path) for name, path in paths if not (ROOT / path).exists()}
    lost = sorted(f"{where}: {name} is not in the code" for where, name in missing if name not in OF_OTHERS)
    assert not lost, "\n".join(lost)


def test_a_quotation_is_refreshed_line_by_line_and_keeps_its_gaps() -> None:
    printed = (
        "load: 3 of 3  shapes\nwarning: one\nstations      7 (lower bound 6)\ncoverage      96 %\nroute         16 m\n"
    )
    for quoted, fresh in (
        ("warning: two|...", "warning: one|..."),
        ("warning: one|stations      9, proven|...", "warning: one|stations      7 (lower bound 6)|..."),
        ("...|coverage      91 %|...", "...|coverage      96 %|..."),
        ("...|coverage      91 %", "...|coverage      96 %|route         16 m"),
        ("", ""),
    ):
        assert refreshed(quoted.split("|"), printed) == fresh.split("|")


def test_a_page_is_run_in_its_order_and_quotes_are_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    source = """# Page
<!-- file: list.csv -->
```
a
b
```
- In a list:

      $ cat list.csv
      c
<!-- run: no, needs a browser -->
```sh
false
```
<!-- exit: 1 -->
```sh
cat missing.csv 2> error.txt
```
<!-- run: wc -l list.csv -->

    7 list.csv
"""
    (tmp_path / "page.md").write_text(source)
    fresh = Page(tmp_path / "page.md").run(_no_tlsplan, str, lambda _: True)
    assert "\n".join(fresh) + "\n" == source.replace("      c\n", "      a\n      b\n").replace("7 list", "2 list")
    (tmp_path / "page.md").write_text(source.replace("exit: 1", "exit: 0"))
    with pytest.raises(AssertionError, match=r"cat missing\.csv.*: exit code 1, expected 0"):
        Page(tmp_path / "page.md").run(_no_tlsplan, str, lambda _: True)


def _no_tlsplan(*arguments: str) -> None:
    raise AssertionError(arguments)

"""Pages of the documentation as programs: their blocks run in order, and what they quote is what came out.

A block is fenced, or indented by four spaces. In a `sh` block every line is a command, in others a line that begins
with `$ `; the lines below it quote its output, as does a block without commands the output of the last one. `...` in a
quotation stands for lines left out. A `python` block is run. Comments above a block, which no reader of the page sees:

    <!-- run: no, REASON -->     the block is not run, nor compared
    <!-- run: slow -->           run among the slow tests
    <!-- run: COMMAND -->        run at this place, as if it stood on the page
    <!-- file: NAME -->          the block is the contents of this file
    <!-- output: COMMAND -->     the block quotes what this command printed, farther up on the page
    <!-- exit: CODE -->          with which commands of the block end; default: 0
    <!-- given: NAME -->         files that are made once for several pages, and what was printed as they were made
"""

from __future__ import annotations

import re
import shlex
import subprocess
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from difflib import SequenceMatcher
from io import StringIO
from itertools import groupby
from pathlib import Path
from typing import Any

from in_process import Tlsplan

_COMMENT = re.compile(r"<!-- (run|file|output|exit|given): (.*?) -->")
_PROGRESS = re.compile(r"[a-z ]+: (\d+( of \d+)?|\.\.\.)(  .*)?")
_TLSPLAN = re.compile(r"(?:\.venv/bin/)?(tlsplan .*)")


@dataclass(frozen=True)
class Command:
    line: int
    text: str

    @property
    def arguments(self) -> list[str] | None:
        """Those of `tlsplan`; None for another program."""
        match = _TLSPLAN.fullmatch(self.text)
        return shlex.split(match[1], comments=True)[1:] if match else None


@dataclass(frozen=True)
class Block:
    """Lines `first` to `last`, not included, of a page, less their indentation."""

    first: int
    last: int
    is_fenced: bool
    language: str
    indent: str
    lines: list[str]
    comments: dict[str, str] = field(default_factory=dict)

    @property
    def is_left_out(self) -> bool:
        return self.comments.get("run", "").startswith("no, ")

    @property
    def is_slow(self) -> bool:
        return self.comments.get("run") == "slow"

    def parts(self) -> list[tuple[Command | None, list[str]]]:
        """Return commands with the lines that quote their output; None: of the last command before the block."""
        found: list[tuple[Command | None, list[str]]] = []
        for number, line in enumerate(self.lines, start=self.first + 1):
            if self.language == "sh" and line and not line.startswith("#"):
                found.append((Command(number, line), []))
            elif line.startswith("$ "):
                found.append((Command(number, line.removeprefix("$ ")), []))
            elif self.language != "sh":
                found = found or [(None, [])]
                found[-1][1].append(line)
        return found


class Page:
    """A page's source: `lines`, and its `blocks` and comments in their order."""

    def __init__(self, path: Path) -> None:
        self.lines = path.read_text(encoding="utf-8").splitlines()
        self.sequence: list[Block | tuple[str, str]] = []
        self._read()
        self.blocks = [each for each in self.sequence if isinstance(each, Block)]

    @property
    def has_slow_blocks(self) -> bool:
        return any(block.is_slow for block in self.blocks)

    def _read(self) -> None:
        comments: dict[str, str] = {}
        at = 0
        while at < len(self.lines):
            line = self.lines[at]
            if match := _COMMENT.fullmatch(line.strip()):
                if match[1] == "given" or (match[1] == "run" and not re.match("no, |slow$", match[2])):
                    self.sequence.append((match[1], match[2]))
                else:
                    comments[match[1]] = match[2]
            elif fence := re.fullmatch(r"( *)```(\w*)", line):
                last = self.lines.index(f"{fence[1]}```", at + 1)
                self._add(at + 1, last, fence[2], fence[1], comments)
                at = last
            elif line.startswith("    ") and re.match(r"\s*$|#|<!--", self.lines[at - 1]):
                inside = [line.startswith("    ") or not line for line in self.lines[at:]] + [False]
                last = at + inside.index(False)
                while not self.lines[last - 1]:
                    last -= 1
                indent = min(len(line) - len(line.lstrip()) for line in self.lines[at:last] if line)
                self._add(at, last, None, " " * indent, comments)
                at = last - 1
            if line.strip() and not match:
                comments = {}
            at += 1

    def _add(self, first: int, last: int, language: str | None, indent: str, comments: dict[str, str]) -> None:
        lines = [line.removeprefix(indent) for line in self.lines[first:last]]
        self.sequence.append(Block(first, last, language is not None, language or "", indent, lines, comments))

    def run(self, tlsplan: Tlsplan, give: Callable[[str], str], is_due: Callable[[Block], bool]) -> list[str]:
        """Run due blocks in the current folder, and return the page's lines with the output as it came out."""
        printed = {"": ""}
        names: dict[str, Any] = {}
        fresh: list[tuple[Block, list[str]]] = []
        for each in self.sequence:
            if not isinstance(each, Block):
                kind, text = each
                printed[text] = printed[""] = give(text) if kind == "given" else _output(text, tlsplan)
            elif "file" in each.comments:  # of use to every block
                Path(each.comments["file"]).write_text("\n".join(each.lines) + "\n", encoding="utf-8")
            elif each.is_left_out or not is_due(each):
                continue
            elif each.language == "python":
                with redirect_stdout(StringIO()) as out:
                    exec("\n".join(each.lines), names)
                printed[""] = out.getvalue()
            else:
                fresh.append((each, _run_block(each, printed, tlsplan)))
        lines = list(self.lines)
        for block, own in reversed(fresh):
            lines[block.first : block.last] = [f"{block.indent}{line}".rstrip() for line in own]
        return lines


def _run_block(block: Block, printed: dict[str, str], tlsplan: Tlsplan) -> list[str]:
    """Run a block's commands and return its lines with the output as it came out."""
    lines = list(block.lines) if block.language == "sh" else []
    for command, quoted in block.parts():
        if command is not None:
            code = int(block.comments.get("exit", 0))
            printed[command.text] = printed[""] = _output(command.text, tlsplan, code)
            lines += [] if block.language == "sh" else [f"$ {command.text}"]
        lines += refreshed(quoted, printed[block.comments.get("output", "")])
    return lines


def refreshed(quoted: list[str], printed: str) -> list[str]:
    """Return quoted lines as they were printed: from the line most like the first to the one most like the last.

    A quotation, or what stands between two `...`, has no gaps; it starts and ends with the output where no `...` does.
    """
    lines = [line.rstrip() for line in printed.strip("\n").splitlines() if not _PROGRESS.fullmatch(line)]
    runs = [(dots, list(group)) for dots, group in groupby(quoted, key=lambda line: line.strip() == "...")]
    found: list[str] = []
    at = 0
    for number, (dots, run) in enumerate(runs):
        if dots or not any(run):
            found += run
            continue
        first = at if number == 0 else _nearest(run[0], lines, at)
        last = len(lines) - 1 if number == len(runs) - 1 else _nearest(run[-1], lines, first)
        found += lines[first : last + 1]
        at = last + 1
    return found


def _nearest(line: str, lines: list[str], start: int) -> int:
    """Return the number of the line from `start` on whose beginning is most like this one."""
    own = line.strip()
    likeness = [SequenceMatcher(None, own, other.strip()[: len(own)]).ratio() for other in lines[start:]]
    best = max(likeness, default=0.0)
    assert best > 0.5, f"no line is printed that is like: {line}"
    return start + likeness.index(best)


def _output(text: str, tlsplan: Tlsplan, code: int = 0) -> str:
    """Run a command in the current folder and return what it prints: warnings, then the result."""
    arguments = Command(0, text).arguments
    if arguments is None:
        done = subprocess.run(["bash", "-c", text], capture_output=True, text=True, check=False)
    else:
        assert not {">", "|", "&&", ";"} & {*arguments}, f"{text}: a shell's signs, and no shell runs it"
        done = tlsplan(*arguments)
    assert done.returncode == code, f"{text}: exit code {done.returncode}, expected {code}\n{done.stdout}{done.stderr}"
    return done.stderr + done.stdout

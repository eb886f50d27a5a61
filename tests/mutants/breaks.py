"""Random faults in product code, one per broken line: which line, what stands there instead.

A break changes one expression of one function: a comparison, an operator, a number, a condition, a returned value; or
it leaves a statement out. The same seed breaks the same lines of the same sources.
"""

from __future__ import annotations

import ast
import random
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("planner_core", "cli", "viewer_web/server")
_COMPARISONS = {
    ast.Lt: "<=",
    ast.LtE: "<",
    ast.Gt: ">=",
    ast.GtE: ">",
    ast.Eq: "!=",
    ast.NotEq: "==",
    ast.Is: "is not",
    ast.IsNot: "is",
    ast.In: "not in",
    ast.NotIn: "in",
}
_OPERATORS = {ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.FloorDiv: "*"}


@dataclass(frozen=True)
class Break:
    """A fault: the bytes `start` to `end` of a file become `text`; `line` and `statement_line` count from 1."""

    path: str
    line: int
    statement_line: int
    start: int
    end: int
    text: str
    is_compiled: bool

    def applied(self, source: bytes) -> bytes:
        """Return the file's content with the fault."""
        return source[: self.start] + self.text.encode() + source[self.end :]

    def described(self, source: bytes) -> str:
        """Return the fault in one line."""
        return f"{self.path}:{self.line}: {source[self.start : self.end].decode()!r} -> {self.text!r}"


def random_breaks(count: int, seed: int) -> list[Break]:
    """Return faults in `count` different lines, each line of code that can be broken being as likely as any other."""
    lines: dict[tuple[str, int], list[Break]] = {}
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*.py")):
            for each in _breaks_of(path):
                lines.setdefault((each.path, each.line), []).append(each)
    chance = random.Random(seed)
    return [chance.choice(lines[at]) for at in sorted(chance.sample(sorted(lines), count))]


def _breaks_of(path: Path) -> Iterator[Break]:
    source = path.read_bytes()
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))

    def span(node: ast.expr | ast.stmt) -> tuple[int, int]:
        assert node.end_lineno is not None and node.end_col_offset is not None
        return starts[node.lineno - 1] + node.col_offset, starts[node.end_lineno - 1] + node.end_col_offset

    def text(node: ast.expr) -> str:
        start, end = span(node)
        return source[start:end].decode()

    name = path.relative_to(ROOT).as_posix()
    for function in ast.walk(ast.parse(source)):
        if not isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        is_compiled = any(isinstance(each, ast.Name) and each.id == "compiled" for each in function.decorator_list)
        for statement in _statements(function.body):
            for node, replacement in _faults(statement, text):
                start, end = span(node)
                yield Break(name, node.lineno, statement.lineno, start, end, replacement, is_compiled)


def _statements(body: list[ast.stmt]) -> Iterator[ast.stmt]:
    """All statements of a function but those of functions inside it, docstrings and what raises errors."""
    for statement in body:
        is_text = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
        if is_text or isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef | ast.Raise):
            continue
        yield statement
        for name in ("body", "orelse", "finalbody"):
            yield from _statements(getattr(statement, name, []))
        for handler in getattr(statement, "handlers", []):
            yield from _statements(handler.body)


def _faults(statement: ast.stmt, text: object) -> Iterator[tuple[ast.expr, str]]:
    """The faults of a statement's own expressions, as pairs of what is replaced and by what."""
    assert callable(text)
    if isinstance(statement, ast.If | ast.While):
        yield statement.test, f"not ({text(statement.test)})"
    if isinstance(statement, ast.Return) and statement.value is not None:
        yield statement.value, "None"
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Call):
        yield statement.value, "None"
    for node in _expressions(statement):
        if isinstance(node, ast.Compare) and len(node.ops) == 1:
            other = _COMPARISONS[type(node.ops[0])]
            yield node, f"({text(node.left)} {other} {text(node.comparators[0])})"
        elif isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS and not _is_of_text(node):
            yield node, f"({text(node.left)} {_OPERATORS[type(node.op)]} {text(node.right)})"
        elif isinstance(node, ast.BoolOp):
            other = " or " if isinstance(node.op, ast.And) else " and "
            yield node, "(" + other.join(f"({text(each)})" for each in node.values) + ")"
        elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
            yield node, str(not node.value)
        elif isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            yield node, repr(node.value + 1)


def _is_of_text(node: ast.BinOp) -> bool:
    return any(
        isinstance(each, ast.JoinedStr) or (isinstance(each, ast.Constant) and isinstance(each.value, str | bytes))
        for each in (node.left, node.right)
    )


def _expressions(statement: ast.stmt) -> Iterator[ast.expr]:
    """The expressions of a statement, without those of statements inside it, of annotations and of formatted texts."""
    waiting: list[ast.AST] = [
        child
        for name, value in ast.iter_fields(statement)
        if name != "annotation"
        for child in (value if isinstance(value, list) else [value])
        if isinstance(child, ast.AST) and not isinstance(child, ast.stmt | ast.ExceptHandler)
    ]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.JoinedStr):
            continue
        if isinstance(node, ast.expr):
            yield node
        waiting.extend(ast.iter_child_nodes(node))

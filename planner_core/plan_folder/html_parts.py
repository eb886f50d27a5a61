"""What pages of a plan are made of: the page itself, figures, warnings, tables. Text -> HTML, all in one file."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from html import escape

from planner_core.plan_folder.drawing.fonts import unbroken
from planner_core.plan_folder.plan_tables import Table
from planner_core.plan_folder.plan_words import LEFT_OUT

_INSIDE_NAME = re.compile(r"(?<=\S)([:_])(?=\S)")
#: Written in red: what must not be missed.
_ALARMS = frozenset({"NOT met", "NOT MET", "NONE"})
_ALARM = ' class="alarm"'
#: On phones every row of a table is a block.
STYLE = """
body{font:15px/1.5 "DejaVu Sans",Verdana,system-ui,sans-serif;color:#111;background:#fff;max-width:1200px;
margin:1.5rem auto;padding:0 1rem}
h1{margin:0 0 .2em;font-size:1.9em;overflow-wrap:anywhere}h2{margin:1.8em 0 .4em;font-size:1.25em}
.quiet{color:#555;margin:.2em 0}
table{border-collapse:collapse;width:100%;font-size:13px;margin-bottom:1.2em}
th,td{padding:.3em .8em .3em 0;text-align:left;vertical-align:top;border-bottom:1px solid #bbb;
overflow-wrap:break-word}
.figures{table-layout:fixed}.figures th{width:8.2em}
thead th{border-bottom:2px solid #111;color:#444}
.n{text-align:right;font-variant-numeric:tabular-nums;}td.n,td.b{white-space:nowrap}.b{font-weight:bold}
.alarm,.alarm th{color:#b3141b;font-weight:bold}
.heed{border:2px solid #111;padding:.6em 1.2em}.heed ul{padding-left:1.2em;margin:.3em 0}
figure{margin:1rem 0}img,svg{max-width:100%;height:auto;display:block}
.wide{overflow-x:auto}
@media screen and (max-width:640px){body{margin:1rem auto;padding:0 .8rem}h1{font-size:1.5em}
.figures th{width:7.6em}
.rows,.rows tbody,.rows tr{display:block}.rows thead{display:none}
.rows tr{border-bottom:2px solid #111;padding:.5em 0}.rows tr:first-child{border-top:2px solid #111}
.rows td{display:flex;justify-content:space-between;gap:1.2em;padding:.1em 0;border:0;text-align:right;
white-space:normal}
.rows td::before{content:attr(data-name);color:#555;font-weight:normal;text-align:left;flex:0 0 42%}
.rows td:empty{display:none}}
@media print{figure,tr{break-inside:avoid}h2,.quiet{break-after:avoid}.wide{overflow:visible}
td{overflow-wrap:anywhere}}
"""


class Html(str):
    """Words that are HTML already."""

    __slots__ = ()


def page(title: str, parts: Iterable[str], *, more_style: str = "") -> str:
    """Return a page. parts : of its body; empty ones are left out."""
    body = "\n".join(part for part in parts if part)
    return (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<meta name="viewport" '
        f'content="width=device-width,initial-scale=1">\n<title>{escape(unbroken(title))}</title>\n<style>{STYLE}{more_style}'
        f"</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )


def words(text: str) -> str:
    """Text as HTML; long names, as those of Revit, break where they have no blanks."""
    if isinstance(text, Html):
        return text
    return _INSIDE_NAME.sub(r"\1<wbr>", escape(unbroken(text)))


def figures(rows: Sequence[tuple[str, str]]) -> str:
    """Names and values."""
    lines = "\n".join(
        f'<tr{_ALARM if name == LEFT_OUT else ""}><th scope="row">{words(name)}</th><td>{words(value)}</td></tr>'
        for name, value in rows
    )
    return f'<table class="figures">\n{lines}\n</table>'


def warnings(lines: Sequence[str]) -> str:
    """A box of warnings; empty where there are none."""
    if not lines:
        return ""
    items = "\n".join(f"<li>{words(line)}</li>" for line in lines)
    return f'<div class="heed"><b>Warnings</b>\n<ul>\n{items}\n</ul></div>'


def rows_of(table: Table) -> str:
    """A table under its heading; its head is repeated on every page when printed."""
    kinds = ["".join(f" {mark}" for mark, on in (("n", c.number), ("b", c.bold)) if on) for c in table.columns]
    # On phones every row is a block, and its cells have the names of their columns.
    names = [f' data-name="{escape(unbroken(column.title))}"' for column in table.columns]

    def cells(tag: str, row: Sequence[str], more: Sequence[str]) -> str:
        marked = ((f"{kind} alarm" if cell in _ALARMS else kind).strip() for kind, cell in zip(kinds, row, strict=True))
        marks = (f' class="{kind}"{name}' if kind else name for kind, name in zip(marked, more, strict=True))
        return "".join(f"<{tag}{mark}>{words(cell)}</{tag}>" for mark, cell in zip(marks, row, strict=True))

    head = cells("th", [column.title for column in table.columns], [""] * len(names))
    rows = "\n".join(f"<tr>{cells('td', row, names)}</tr>" for row in table.rows)
    note = f'<p class="quiet">{words(table.note)}</p>\n' if table.note else ""
    return (
        f'<h2>{words(table.title)}</h2>\n{note}<div class="wide"><table class="rows">\n'
        f"<thead><tr>{head}</tr></thead>\n<tbody>\n{rows}\n</tbody>\n</table></div>"
    )

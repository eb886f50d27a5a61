"""A small YAML or JSON file to plain mappings, lists, texts and numbers, and nothing that could do harm.

YAML in the types of its version 1.2: `no` is a text and `1:30` is one too. Keys are always text. Not taken: anchors and
aliases, which can blow a file up, merge keys, tags, keys that are there twice.
"""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner_core.documents import is_deeper, shown
from planner_core.errors import RequirementError
from planner_core.scene.file_formats import is_scene_file

if TYPE_CHECKING:
    import yaml

#: Bytes of a file. The parser is slow on purpose-made input; a thousand zones have 100 kB.
MOST_BYTES = 2**18
#: Lists and mappings inside each other.
_MOST_DEEP = 20


def read_document(path: Path, *, of: str = "requirements", such_as: str = "coverage: 95 %") -> dict[str, Any]:
    """Read a file, which has to be one mapping: JSON where its name ends in `.json`, else YAML.

    Parameters
    ----------
    of, such_as
        For messages: what it is a file of, and of which page in docs/formats; an entry.

    Raises
    ------
    RequirementError
        It is missing, too large, not UTF-8, not YAML or JSON, or has what is not taken.
    """
    try:
        text = _text_of(path, of)
        found = _json(text) if path.suffix.casefold() == ".json" else _yaml(text)
    except json.JSONDecodeError as error:
        raise _refused(path, of, f"line {error.lineno}: {error.msg}", "JSON") from error
    except _RefusedError as error:
        raise _refused(path, of, str(error), error.expected) from error
    except RecursionError as error:
        raise _refused(path, of, "brackets inside brackets without end", "a plain file") from error
    except ValueError as error:  # whole numbers of thousands of digits
        raise _refused(path, of, "a number that is too long to be one", "a plain file") from error
    if not isinstance(found, dict) or not found:
        got = "nothing" if not found else shown(found)
        raise _refused(path, of, got, f"entries such as `{such_as}`")
    if is_deeper(found, _MOST_DEEP):
        raise _refused(path, of, f"more than {_MOST_DEEP} lists and mappings inside each other", "a plain file")
    return found


class _RefusedError(Exception):
    """Something in a file that is not taken; the message names what and where."""

    def __init__(self, got: str, expected: str = "a plain file") -> None:
        super().__init__(got)
        self.expected = expected


def _refused(path: Path, of: str, got: str, expected: str) -> RequirementError:
    name = "".join(sign if sign.isprintable() else "?" for sign in str(path))
    return RequirementError(f"{name}: got {got}, expected {expected}; see docs/formats/{of}.md")


def _text_of(path: Path, of: str) -> str:
    try:
        if not path.is_file():
            raise _RefusedError("a folder" if path.is_dir() else "no such file", f"a file of {of}")
        if is_scene_file(path):
            raise _RefusedError("a scene file", f"a file of {of}, YAML or JSON")
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise _RefusedError(f"a file that can't be opened ({error.strerror})", "one that can be read") from error
    if len(content) > MOST_BYTES:
        raise _RefusedError("a larger file", f"at most {MOST_BYTES // 1024} KiB")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise _RefusedError(f"other than UTF-8 at byte {error.start}", "a file in UTF-8") from error


def _json(text: str) -> Any:
    return json.loads(text, object_pairs_hook=_once, parse_constant=_no_constant)


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise _RefusedError(f"{key!r} twice")
        found[key] = value
    return found


def _no_constant(name: str) -> Any:
    raise _RefusedError(f"{name}, which is no number")


def _yaml(text: str) -> Any:
    import yaml

    try:
        return yaml.load(text, Loader=_loader())
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        what = " ".join(str(getattr(error, "problem", None) or "characters that are not text").split())
        raise _RefusedError(f"line {mark.line + 1}: {what}" if mark else what) from error


@cache
def _loader() -> type[yaml.SafeLoader]:
    """A SafeLoader of YAML 1.2's types that refuses what the head of this module names."""
    import yaml

    class Plain(yaml.SafeLoader):  # type: ignore[misc]
        """Texts, whole numbers, decimals, true and false, null; lists and mappings."""

        yaml_implicit_resolvers: dict[str, Any] = {}  # noqa: RUF012 - as its base declares it

        def compose_node(self, parent: Any, index: Any) -> Any:
            event = self.peek_event()
            line = event.start_mark.line + 1
            if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None):
                raise _RefusedError(f"line {line}: an anchor or alias; put names that begin with * or & in quotes")
            if getattr(event, "tag", None):
                raise _RefusedError(f"line {line}: a tag; put texts that begin with ! in quotes")
            return super().compose_node(parent, index)

        def construct_mapping(self, node: Any, deep: bool = False) -> dict[str, Any]:
            found: dict[str, Any] = {}
            for key_node, value_node in node.value:
                line = key_node.start_mark.line + 1
                if not isinstance(key_node, yaml.ScalarNode):
                    raise _RefusedError(f"line {line}: a name that is a list or mapping")
                if key_node.value in found:
                    raise _RefusedError(f"line {line}: {key_node.value!r} a second time")
                found[key_node.value] = self.construct_object(value_node, deep=deep)
            return found

    def construct_map(loader: Plain, node: Any) -> dict[str, Any]:
        return loader.construct_mapping(node, deep=True)

    Plain.add_constructor("tag:yaml.org,2002:map", construct_map)
    for kind, pattern, first in (
        ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
        ("bool", r"true|True|TRUE|false|False|FALSE", list("tTfF")),
        ("int", r"[-+]?(?:0|[1-9][0-9]*)", list("-+0123456789")),
        ("float", r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?", list("-+.0123456789")),
    ):
        Plain.add_implicit_resolver(f"tag:yaml.org,2002:{kind}", re.compile(rf"(?:{pattern})\Z"), first)
    return Plain

"""Wording of the scene stage's messages: numbers, texts out of files, and one error that readers share."""

from __future__ import annotations

from pathlib import Path

from planner_core.errors import SceneError, one_line

_LONGEST_REASON = 300
_OF_OTHERS = frozenset({"", ".json", ".csv", ".txt", ".yaml", ".yml"})


def grouped(number: int) -> str:
    """`41022` as `41 022`."""
    return f"{number:,}".replace(",", " ")


def readable(text: str) -> str:
    """`text` with halves of surrogate pairs replaced by U+FFFD: files may hold them, and no encoding can write them."""
    return text.encode("utf-16-le", "surrogatepass").decode("utf-16-le", "replace")


def is_text(name: str) -> bool:
    """A name of a file can be written as UTF-8: those of other times and systems may be any bytes."""
    try:
        name.encode()
    except UnicodeEncodeError:
        return False
    return True


def is_scene_file(path: Path) -> bool:
    """Whether a path is of a scene file, by its extension: for readers of other files, which were given one."""
    if path.suffix.lower() in _OF_OTHERS or not path.is_file():
        return False
    from planner_core.scene.load import FORMAT_OF_EXTENSION  # takes a while to import

    return path.suffix.lower() in FORMAT_OF_EXTENSION


def reason_of(error: Exception) -> str:
    """A library's message on a file, fit for a message."""
    return shortened(str(error)) or type(error).__name__


def shortened(text: str) -> str:
    """`one_line` of a text that a library made, no longer than a user reads."""
    line = one_line(text)
    return line if len(line) <= _LONGEST_REASON else f"{line[:_LONGEST_REASON]}..."


def bad_index_error(
    name: str, n_bad: int, n_faces: int, vertex_number: int, n_vertices: int, *, first_number: int, owner: str
) -> SceneError:
    """The one wording for faces that name a missing vertex.

    `first_number`: how the format numbers its first vertex. `owner`: what has the vertices, a file or a mesh.
    """
    last = n_vertices - 1 + first_number
    has = f"the {owner} has {grouped(n_vertices)}" + ("" if first_number else f", the last is {grouped(last)}")
    verb = "names" if n_bad == 1 else "name"
    return SceneError(
        f"{name}: {grouped(n_bad)} of {grouped(n_faces)} faces {verb} vertex {grouped(vertex_number)}, {has}. "
        "Repair it or pass --skip-bad-faces."
    )

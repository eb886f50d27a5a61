"""The JSON of a glTF file, read through checks: what breaks glTF 2.0 ends in one line that names its place.

Every value is checked where it is read and not before: what nobody reads may be wrong. Exceptions of any other kind
out of a reader that asks here are its own bugs, and are not taken for faults of the file.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from planner_core.errors import SceneError, readable

_MOST = 2**53
"""Whole numbers beyond this are not exact in JSON, and no file has so many of anything."""


@dataclass(frozen=True)
class JsonObject:
    """An object of the tree. place: where it is, such as `meshes/0`; empty: the root."""

    file_name: str
    place: str
    members: dict[str, Any]

    def has(self, key: str) -> bool:
        """The member is there."""
        return key in self.members

    def object(self, key: str) -> JsonObject:
        """Return a member that has to be an object."""
        return self._as_object(key, self._member(key))

    def objects(self, key: str) -> list[JsonObject]:
        """Return a member that has to be a list of objects; empty where it is not there."""
        return [self._as_object(f"{key}/{i}", value) for i, value in enumerate(self._list(key))]

    def required_objects(self, key: str) -> list[JsonObject]:
        """Return a member that has to be there, and a list of objects."""
        self._member(key)
        return self.objects(key)

    def whole(self, key: str, default: int | None = None, *, below: int = _MOST) -> int:
        """Return a whole number from 0 to `below` (exclusive); `default` where it is not there, None: it has to be."""
        if default is not None and key not in self.members:
            return default
        return self._as_whole(key, self._member(key), below)

    def wholes(self, key: str, *, below: int) -> list[int]:
        """Return a list of whole numbers from 0 to `below` (exclusive); empty where it is not there."""
        return [self._as_whole(f"{key}/{i}", value, below) for i, value in enumerate(self._list(key))]

    def number(self, key: str, default: float) -> float:
        """Return a number; `default` where it is not there."""
        value = self.members.get(key, default)
        if not _is_number(value):
            raise self._fault(key, value, "a number")
        return float(value)

    def numbers(self, key: str, default: tuple[float, ...]) -> list[float]:
        """Return as many numbers as `default` has, which holds where the member is not there."""
        if key not in self.members:
            return list(default)
        values = self._list(key)
        if len(values) != len(default) or not all(_is_number(value) for value in values):
            raise self._fault(key, self.members[key], f"{len(default)} numbers")
        return [float(value) for value in values]

    def text(self, key: str) -> str:
        """Return a text, empty where it is not there."""
        value = self.members.get(key, "")
        if not isinstance(value, str):
            raise self._fault(key, value, "text")
        return readable(value)

    def texts(self, key: str) -> list[str]:
        """Return a list of texts; empty where it is not there."""
        values = self._list(key)
        if not all(isinstance(value, str) for value in values):
            raise self._fault(key, values, "a list of texts")
        return [readable(value) for value in values]

    def _member(self, key: str) -> Any:
        if key not in self.members:
            raise self._does_not_follow(f"{self._at(key)} is missing")
        return self.members[key]

    def _list(self, key: str) -> list[Any]:
        values = self.members.get(key, [])
        if not isinstance(values, list):
            raise self._fault(key, values, "a list")
        return values

    def _as_object(self, key: str, value: Any) -> JsonObject:
        if not isinstance(value, dict):
            raise self._fault(key, value, "an object")
        return JsonObject(self.file_name, self._at(key), value)

    def _as_whole(self, key: str, value: Any, below: int) -> int:
        is_whole = _is_number(value) and value == value // 1
        if not (is_whole and 0 <= value < below):
            raise self._fault(key, value, f"a whole number from 0 to {below - 1}" if below else "none")
        return int(value)

    def _at(self, key: str) -> str:
        return f"{self.place}/{key}" if self.place else key

    def _fault(self, key: str, got: Any, expected: str) -> SceneError:
        shown = "a list" if isinstance(got, list) else "an object" if isinstance(got, dict) else repr(got)[:40]
        return self._does_not_follow(f"{self._at(key)} is {shown}, expected {expected}")

    def _does_not_follow(self, detail: str) -> SceneError:
        return SceneError(
            f"{self.file_name}: its contents do not follow glTF 2.0 ({detail}); validate it and export it again."
        )


def _is_number(value: Any) -> bool:
    """A number that a float64 holds; JSON's true and false are none."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= 1.7e308

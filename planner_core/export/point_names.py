"""Names of points as other people's programs take them: short, of few characters, each once. Texts in, texts out."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence

from planner_core.errors import ExportError

#: Letters that Unicode does not take apart into a plain one and a mark.
_PLAIN = str.maketrans(
    {"ß": "ss", "æ": "ae", "Æ": "AE", "ø": "o", "Ø": "O", "œ": "oe", "Œ": "OE", "ł": "l", "Ł": "L", "đ": "d", "Đ": "D"}
)
#: Renamed points that a remark names; of more it gives the number.
_MAX_NAMED = 4


def plain_text(text: str) -> str:
    """Return `text` in ASCII: marks of letters are dropped, what has no plain letter becomes a question mark."""
    spread = unicodedata.normalize("NFKD", text.translate(_PLAIN))
    kept = "".join(letter for letter in spread if not unicodedata.combining(letter))
    return kept.encode("ascii", "replace").decode("ascii")


def fitted_names(
    ids: Sequence[str], *, what: str, limit: int, allowed: str = r"[\x21-\x7e]"
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return a name for each id, in their order, and remarks on those that had to change.

    Parameters
    ----------
    ids
        Of the stations; each occurs once.
    what
        Whose rules these are, for remarks and errors: `GSI-8`.
    limit
        Most characters of a name.
    allowed
        A regular expression that matches one character that may stand in a name.

    Raises
    ------
    ExportError
        The same id twice, or no short names left that differ.
    """
    for index, name in enumerate(ids):
        if name in ids[:index]:
            raise ExportError(f"{what}: station {name!r} occurs twice, expected each id once; rename one in the plan")
    kept = {name for name in ids if _fits(name, limit, allowed)}
    names = {name: name for name in kept}
    for name in ids:
        if name not in kept:
            names[name] = _new_name(name, set(names.values()), what, limit, allowed)
    changed = [f"{name} is {names[name]}" for name in ids if names[name] != name]
    if not changed:
        return tuple(ids), ()
    more = f" and {len(changed) - _MAX_NAMED} more" if len(changed) > _MAX_NAMED else ""
    remark = f"{what} takes names of {limit} plain characters: {', '.join(changed[:_MAX_NAMED])}{more}"
    return tuple(names[name] for name in ids), (remark,)


def _fits(name: str, limit: int, allowed: str) -> bool:
    return 0 < len(name) <= limit and re.fullmatch(f"(?:{allowed})+", name) is not None


def _new_name(name: str, taken: set[str], what: str, limit: int, allowed: str) -> str:
    """Shorten a name from its end, which distinguishes stations; where that is taken, its last characters count up."""
    plain = "".join(letter for letter in plain_text(name) if re.fullmatch(allowed, letter)) or "P"
    short = plain[-limit:]
    if short not in taken:
        return short
    for number in range(2, 10 ** min(limit, 6)):
        counted = f"{short[: limit - len(str(number))]}{number}"
        if counted not in taken:
            return counted
    raise ExportError(f"{what}: no name of {limit} characters is left for station {name!r}; shorten the ids")

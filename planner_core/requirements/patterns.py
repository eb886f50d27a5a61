"""Patterns of names: `*` stands for any letters, none too, and `?` for any one; all else is what it is."""

from __future__ import annotations


def fits(pattern: str, name: str) -> bool:
    """Whether the whole of a name is as a pattern says, capitals and all.

    Notes
    -----
    Each piece between two stars is taken where it fits first, which leaves most to the pieces behind it: at most
    `len(pattern) * len(name)` comparisons, however many stars there are.
    """
    first, *others = pattern.split("*")
    if not others:
        return len(name) == len(first) and _lies_at(first, name, 0)
    last = others.pop()
    end = len(name) - len(last)
    if len(first) > end or not _lies_at(first, name, 0) or not _lies_at(last, name, end):
        return False
    begin = len(first)
    for piece in filter(None, others):
        while begin + len(piece) <= end and not _lies_at(piece, name, begin):
            begin += 1
        begin += len(piece)
        if begin > end:
            return False
    return True


def _lies_at(piece: str, name: str, begin: int) -> bool:
    """Whether a piece without stars is what stands in a name from `begin` on."""
    there = name[begin : begin + len(piece)]
    return there == piece or all(sign in ("?", letter) for sign, letter in zip(piece, there, strict=True))

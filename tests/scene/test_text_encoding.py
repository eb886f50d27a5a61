"""Names in old code pages are read as they were written. Oracle: Python's codecs wrote them."""

from __future__ import annotations

import pytest

from planner_core.scene.text_encoding import encoding_of, encoding_title

NAMES = {
    "cp932": ["屋根", "1階", "2階 床", "基準階", "（壁）-100", "ドア", "エレベーター", "表"],
    "gbk": ["一层", "二层 楼板", "屋顶", "墙-200", "（走廊）"],
    "big5": ["一樓", "二樓 樓板", "屋頂", "牆", "樓梯間"],
    "cp949": ["1층", "지붕", "벽 - 콘크리트", "계단실"],
    "cp1251": ["Уровень 1", "Кровля", "Стена: 400мм"],
    "cp1252": ["Erdgeschoß", "Küche", "Außenwand", "Étage", "Fenêtre", "Tür 1,01 × 2,13"],
}


@pytest.mark.parametrize(("encoding", "names"), NAMES.items())
def test_names_of_a_file_are_read_back(encoding, names):
    raw = [name.encode(encoding) for name in names]
    found = encoding_of(raw)
    assert [text.decode(found) for text in raw] == names
    assert encoding_title(found)


@pytest.mark.parametrize(
    ("encoding", "name"), [("cp932", "屋根"), ("gbk", "一层"), ("big5", "屋頂"), ("cp1252", "Küche")]
)
def test_one_name_suffices(encoding, name):
    raw = name.encode(encoding)
    assert raw.decode(encoding_of([raw])) == name


@pytest.mark.parametrize("names", NAMES.values())
def test_utf_8_goes_first(names):
    assert encoding_of([name.encode() for name in names]) == "utf-8"


def test_any_bytes_can_be_read():
    raw = bytes(range(256))
    assert raw.decode(encoding_of([raw]))

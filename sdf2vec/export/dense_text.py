"""Shader text in as few bytes as say the same: no comments, no needless spaces and digits, short names."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from itertools import chain, product
from string import ascii_letters

from .exported import MARK

COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
TOKEN = re.compile(
    r"#[^\n]*|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\w*|\w+|\s+|\+\+|--|&&|\|\||<<|>>|->|[-<>=!+*/&|^]=|[^\w\s]"
)
DECLARED = re.compile(r"\b(?:float|int|bool|void|[iu]?vec[234]|mat[234])\s+(\w+)")
KEPT = {"main", "mainImage"}


def dense(text: str, renamed: bool) -> str:
    """GLSL or WGSL without what only a reader needs; with short names only where no one else calls them (GLSL)."""
    tokens = [token for token in TOKEN.findall(COMMENT.sub(" ", text)) if not token.isspace()]
    names = _short_names(tokens, text) if renamed else {}
    written, before = [f"// {MARK}\n"], "\n"
    for index, token in enumerate(tokens):
        is_member = index > 0 and tokens[index - 1] == "."
        said = (
            _line(token, names)
            if token[0] == "#"
            else token
            if is_member
            else names.get(token, _short(token))
        )
        written.append(_between(before, said) + said)
        before = said
    return "".join(written).strip() + "\n"


def _between(before: str, after: str) -> str:
    """What keeps two tokens apart."""
    if after[0] == "#":
        return "" if before[-1] == "\n" else "\n"
    is_word = before[-1].isalnum() or before[-1] == "_"
    meet = is_word and (after[0].isalnum() or after[0] == "_" or (after[0] == "." and len(after) > 1))
    return " " if meet or before[-1] + after[0] in ("++", "--", "//", "/*") else ""


def _line(line: str, names: dict[str, str]) -> str:
    """A line for the preprocessor, which ends with its end."""
    return re.sub(r"\b\w+\b", lambda match: names.get(match[0], match[0]), line.rstrip()) + "\n"


def _short(token: str) -> str:
    """A number without needless zeros; anything else as it is."""
    said = re.fullmatch(r"(\d*)\.(\d*?)0*", token)
    if not said or token == ".":
        return token
    whole, part = said[1].lstrip("0"), said[2]
    return f"{whole}.{part}" if whole or part else "0."


def _short_names(tokens: list[str], text: str) -> dict[str, str]:
    """A new name for each that the text declares, the shortest for the most frequent."""
    declared = set(DECLARED.findall(COMMENT.sub(" ", text))) - KEPT
    counts = Counter(token for token in tokens if token in declared)
    used = set(re.findall(r"\w+", text))
    fresh = (name for name in _names() if name not in used)
    return {
        name: new for (name, _), new in zip(counts.most_common(), fresh, strict=False) if len(new) < len(name)
    }


def _names() -> Iterator[str]:
    return chain(ascii_letters, map("".join, product(ascii_letters, repeat=2)))


def brief(text: str) -> str:
    """A text without indentation and empty lines."""
    return "".join(f"{line.lstrip()}\n" for line in text.splitlines() if line)

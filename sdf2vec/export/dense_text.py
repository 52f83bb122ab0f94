"""Shader text in as few bytes as say the same: no comments, no needless spaces and digits, short names."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Container, Iterator, Sequence
from itertools import chain, product
from string import ascii_letters

from .exported import MARK

COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
TOKEN = re.compile(
    r"#[^\n]*|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\w*|\w+|\s+|\+\+|--|&&|\|\||<<|>>|->|[-<>=!+*/&|^]=|[^\w\s]"
)
TYPE = re.compile(r"float|int|bool|void|[iu]?vec[234]|mat[234]")
NAME = re.compile(r"[A-Za-z_]\w*")
DECLARED = ("=", ",", ";", "[", ")")  # what may follow a name that is declared
KEPT = {"main", "mainImage"}
EVERYWHERE = ""  # the scope of what is declared outside functions


def dense(text: str, renamed: bool) -> str:
    """GLSL or WGSL without what only a reader needs; with short names only where no one else calls them (GLSL)."""
    tokens = [token for token in TOKEN.findall(COMMENT.sub(" ", text)) if not token.isspace()]
    written, before = [f"// {MARK}\n"], "\n"
    for said in _declared_together(_renamed(tokens) if renamed else tokens):
        short = _short(said)
        written.append(_between(before, short) + short)
        before = short
    return "".join(written).strip() + "\n"


def _between(before: str, after: str) -> str:
    """What keeps two tokens apart."""
    if after[0] == "#":
        return "" if before[-1] == "\n" else "\n"
    is_word = before[-1].isalnum() or before[-1] == "_"
    meet = is_word and (after[0].isalnum() or after[0] == "_" or (after[0] == "." and len(after) > 1))
    return " " if meet or before[-1] + after[0] in ("++", "--", "//", "/*") else ""


def _short(token: str) -> str:
    """A number without needless zeros; a line for the preprocessor ends with its end; anything else as it is."""
    if token[0] == "#":
        return token.rstrip() + "\n"
    said = re.fullmatch(r"(\d*)\.(\d*?)0*", token)
    if not said or token == ".":
        return token
    whole, part = said[1].lstrip("0"), said[2]
    return f"{whole}.{part}" if whole or part else "0."


def _declared_together(tokens: Sequence[str]) -> Iterator[str]:
    """Statements that declare names of one type as a single one."""
    depth, declares = 0, ""  # within brackets; the type that the statement declares names of
    for index, token in enumerate(tokens):
        depth += (token in "([") - (token in ")]")
        starts = index == 0 or tokens[index - 1] in "{};"
        again = starts and depth == 0 and token == declares and _is_declared(tokens, index + 1)
        if starts and not again:
            declares = token if TYPE.fullmatch(token) and _is_declared(tokens, index + 1) else ""
        if token in "{}":
            declares = ""
        if token == ";" and _goes_on(tokens, index, declares, depth):
            yield ","
        elif not again:
            yield token


def _goes_on(tokens: Sequence[str], index: int, declares: str, depth: int) -> bool:
    """Whether the statement after one that declares names of a type declares more of them."""
    return (
        bool(declares)
        and depth == 0
        and tokens[index + 1 : index + 2] == [declares]
        and _is_declared(tokens, index + 2)
    )


def _is_declared(tokens: Sequence[str], index: int) -> bool:
    """Whether a name, no function's, stands here that is being declared, where it follows a type or a comma."""
    name, after = (*tokens[index : index + 2], "", "")[:2]
    return bool(NAME.fullmatch(name)) and after in DECLARED


def _renamed(tokens: Sequence[str]) -> list[str]:
    """A short name for each that is declared, the shortest for the most frequent; functions share those of what is
    theirs alone.
    """
    scopes = list(_scopes(tokens))
    declared = _declarations(tokens, scopes)
    counts = Counter(
        (scope if token in declared[scope] else EVERYWHERE, token)
        for token, scope, is_member in zip(tokens, scopes, _members(tokens), strict=True)
        if not is_member and (token in declared[scope] or token in declared[EVERYWHERE])
    )
    kept = {
        token
        for token, scope, is_member in zip(tokens, scopes, _members(tokens), strict=True)
        if not is_member and token not in declared[scope] and token not in declared[EVERYWHERE]
    }
    names: dict[str, dict[str, str]] = {}
    for scope in declared:
        taken = kept | set(names.get(EVERYWHERE, {}).values())
        mine = [name for (where, name), _ in counts.most_common() if where == scope]
        names[scope] = dict(zip(mine, _names(taken), strict=False))
    return [
        _said(token, names[EVERYWHERE] | names[scope], is_member)
        for token, scope, is_member in zip(tokens, scopes, _members(tokens), strict=True)
    ]


def _said(token: str, names: dict[str, str], is_member: bool) -> str:
    """A token with its new name, or those in a line for the preprocessor."""
    if token[0] == "#":
        return re.sub(r"\b\w+\b", lambda match: names.get(match[0], match[0]), token)
    return token if is_member else names.get(token, token)


def _members(tokens: Sequence[str]) -> Iterator[bool]:
    """Which are names of components."""
    yield from (index > 0 and tokens[index - 1] == "." for index in range(len(tokens)))


def _scopes(tokens: Sequence[str]) -> Iterator[str]:
    """The function that each token is in, with its parameters; its name is not."""
    depth, scope = 0, EVERYWHERE
    for index, token in enumerate(tokens):
        is_outside = depth == 0 and token == "(" and index > 1 and TYPE.fullmatch(tokens[index - 2])
        scope = tokens[index - 1] if is_outside else scope
        depth += (token in "({") - (token in ")}")
        yield scope
        if depth == 0 and token in ("}", ";"):
            scope = EVERYWHERE


def _declarations(tokens: Sequence[str], scopes: Sequence[str]) -> dict[str, set[str]]:
    """The names that each scope declares, those outside all functions first."""
    found: dict[str, set[str]] = {EVERYWHERE: set()}
    depth, inner = 0, -1  # within brackets; how deep, where names are declared
    for index, (token, scope) in enumerate(zip(tokens, scopes, strict=True)):
        depth += (token in "([") - (token in ")]")
        if token in (";", "{", "}") or depth < inner:
            inner = -1
        is_next = token == "," and depth == inner
        is_function = TYPE.fullmatch(token) and tokens[index + 2 : index + 3] == ["("]
        if is_function and scope == EVERYWHERE and NAME.fullmatch(tokens[index + 1]):
            found[EVERYWHERE].add(tokens[index + 1])
        elif (TYPE.fullmatch(token) or is_next) and _is_declared(tokens, index + 1):
            found.setdefault(scope, set()).add(tokens[index + 1])
            inner = depth
    found[EVERYWHERE] -= KEPT
    return {scope: found.get(scope, set()) for scope in (EVERYWHERE, *dict.fromkeys(scopes))}


def _names(taken: Container[str]) -> Iterator[str]:
    """All names but some, the shortest first."""
    every = chain(ascii_letters, map("".join, product(ascii_letters, repeat=2)))
    return (name for name in every if name not in taken)


def brief(text: str) -> str:
    """A text without indentation and empty lines."""
    return "".join(f"{line.lstrip()}\n" for line in text.splitlines() if line)

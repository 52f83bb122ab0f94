"""Shader text in as few bytes as say the same: no comments, no needless spaces and digits, short names."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Container, Iterator, Mapping, Sequence
from itertools import chain, product
from string import ascii_letters

from .exported import MARK

COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
TOKEN = re.compile(
    r"#[^\n]*|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\w*|\w+|\s+|\+\+|--|&&|\|\||<<|>>|->|[-<>=!+*/&|^]=|[^\w\s]"
)
TYPE = re.compile(r"float|int|bool|void|[iu]?vec[234]|mat[234]")
VECTOR = re.compile(r"vec[234]f?")
BRACKETS = ("([{", ")]}")
NAME = re.compile(r"[A-Za-z_]\w*")
DECLARED = ("=", ",", ";", "[", ")")  # what may follow a name that is declared
KEPT = {"main", "mainImage"}
MEMBER = "."  # what is before the name of a component
EVERYWHERE = ""  # the scope of what is declared outside functions


def dense(text: str, renamed: bool) -> str:
    """GLSL or WGSL without what only a reader needs; with short names only where no one else calls them (GLSL)."""
    tokens = [token for token in TOKEN.findall(COMMENT.sub(" ", text)) if not token.isspace()]
    written, before = [f"// {MARK}\n"], "\n"
    said = list(map(_short, _declared_together(_renamed(tokens) if renamed else tokens)))
    for short in _whole(said):
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


def _whole(tokens: Sequence[str]) -> Iterator[str]:
    """Whole numbers of which a vector is made without a point."""
    makers = [""]  # of what brackets are open, by what is before them
    for before, token, after in zip(["", *tokens], tokens, [*tokens[1:], ""], strict=False):
        if token in BRACKETS[0]:
            makers.append(before)
        elif token in BRACKETS[1]:
            makers.pop()
        is_alone = before in ("(", ",") and after in (",", ")")
        is_vector = VECTOR.fullmatch(makers[-1]) and is_alone
        yield token[:-1] if is_vector and re.fullmatch(r"\d+\.", token) else token


def _declared_together(tokens: Sequence[str]) -> list[str]:
    """Statements that declare names of one type as a single one."""
    found: list[str] = []
    declares = ""  # the type that the statement declares names of
    for index, token in enumerate(tokens):
        if index == 0 or tokens[index - 1] in "{};":
            before, declares = declares, ""
            if TYPE.fullmatch(token) and _is_declared(tokens, index + 1):
                declares = token
            if declares and declares == before and found[-1] == ";":
                found[-1] = ","
                continue
        found.append(token)
    return found


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
    owners = list(_owners(tokens, scopes, declared))
    counts = Counter(zip(owners, tokens, strict=True))
    kept = {token for (owner, token) in counts if owner is None}
    names: dict[str, dict[str, str]] = {}
    for scope in declared:
        taken = kept | set(names.get(EVERYWHERE, {}).values())
        mine = [name for (owner, name), _ in counts.most_common() if owner == scope]
        names[scope] = dict(zip(mine, _names(taken), strict=False))
    return [
        names[owner][token] if owner in names else _in_line(token, names[EVERYWHERE])
        for token, owner in zip(tokens, owners, strict=True)
    ]


def _owners(
    tokens: Sequence[str], scopes: Sequence[str], declared: Mapping[str, Container[str]]
) -> Iterator[str | None]:
    """The scope that declares each token, MEMBER of a component's name; none declares what is no name."""
    before = ""
    for token, scope in zip(tokens, scopes, strict=True):
        owner = next((where for where in (scope, EVERYWHERE) if token in declared[where]), None)
        yield MEMBER if before == MEMBER else owner
        before = token


def _in_line(token: str, names: Mapping[str, str]) -> str:
    """A line for the preprocessor, with new names; anything else as it is."""
    if token[0] != "#":
        return token
    return re.sub(r"\b\w+\b", lambda match: names.get(match[0], match[0]), token)


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

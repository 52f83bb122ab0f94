"""What a benchmark compares: presets and points between them, the thesis, variants, other programs; each a record.

A method of this program is the name of a pace, and words that change it: `balanced:circle:additive`, `fast:sharp`,
`thesis:ssim:box:union4`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..blend import COMPOSITING
from ..declared import check_choice
from ..errors import Sdf2vecError
from ..fit.presets import PRESETS
from ..fit.settings import LOSS_NAMES, MIXED
from ..paints import PAINTS
from ..shapes import KINDS
from .peers import PEERS, Peer


@dataclass(frozen=True)
class Pace:
    """A preset, with so many times its steps, and what it is fitted with unless words say otherwise."""

    preset: str
    steps: float = 1.0
    options: Mapping[str, Any] | None = None


PACES: dict[str, Pace] = {
    "draft": Pace("fast", 0.3),
    "fast": Pace("fast"),
    "fast-twice": Pace("fast", 2.0),
    "balanced-half": Pace("balanced", 0.5),
    "balanced": Pace("balanced"),
    "balanced-twice": Pace("balanced", 2.0),
    "best": Pace("best"),
    "thesis": Pace("thesis", options={"compositing": "additive"}),
}
WORDS: dict[str, dict[str, Any]] = {
    **{kind: {"kind": kind} for kind in (*KINDS, MIXED)},
    **{name: {"compositing": name} for name in COMPOSITING},
    **{name: {"paint": name} for name in PAINTS},
    **{name: {"loss": name} for name in LOSS_NAMES},
    "sharp": {"max_falloff": 0.0},
}
UNION = re.compile(r"union(\d{1,2})")

GROUPS: dict[str, tuple[str, ...]] = {
    "presets": ("draft", "fast", "balanced", "best"),
    "between": ("fast-twice", "balanced-half", "balanced-twice"),
    "thesis": ("thesis:mse", "thesis:ssim"),
    "variants": (
        "fast:sharp",
        "balanced:sharp",
        "balanced:additive",
        *(f"balanced:{kind}" for kind in ("circle", "ellipse", "box", "displaced", MIXED)),
        "balanced:linear",
        "balanced:ssim",
    ),
    "peers": tuple(PEERS),
}
USUAL = ("presets", "thesis", "variants", "peers")


@dataclass(frozen=True)
class Method:
    """One way to get from a picture to shapes: a fit with these options at this pace, or another program."""

    name: str
    family: str  # ours, variant, thesis, peer
    pace: Pace | None = None
    options: Mapping[str, Any] | None = None
    peer: Peer | None = None

    @property
    def union(self) -> int:
        """How many shapes each layer joins."""
        return int((self.options or {}).get("union", 1))

    @property
    def counts(self) -> bool:
        """Whether it is told how many shapes there are to be."""
        return self.peer is None or self.peer.counts


def methods_of(text: str) -> list[Method]:
    """From names, and names of groups, separated by commas. Raises Sdf2vecError for an unknown one."""
    names = [name.strip() for name in text.split(",") if name.strip()]
    listed = [method for name in names for method in GROUPS.get(name, (name,))]
    return [method_of(name) for name in dict.fromkeys(listed)]


def method_of(name: str) -> Method:
    """A method by its name. Raises Sdf2vecError for an unknown one."""
    if name in PEERS:
        return Method(name, "peer", peer=PEERS[name])
    first, *words = name.split(":")
    check_choice("method", first, (*PACES, *PEERS, *GROUPS))
    pace = PACES[first]
    options = dict(pace.options or {})
    for word in words:
        options |= _option_of(word)
    if "kind" not in options:
        options["kind"] = "triangle"
    family = "thesis" if pace.preset == "thesis" else "variant" if words else "ours"
    return Method(name, family, pace, options)


def _option_of(word: str) -> dict[str, Any]:
    joined = UNION.fullmatch(word)
    if joined:
        return {"union": int(joined[1])}
    if word not in WORDS:
        raise Sdf2vecError(f"unknown word {word!r} of a method; choose from {', '.join(WORDS)}, union4")
    return WORDS[word]


def described(methods: Sequence[Method]) -> list[str]:
    """A line for each: what exactly is done."""
    lines = []
    for method in methods:
        if method.peer:
            lines.append(f"`{method.name}`: {method.peer.about}")
            continue
        pace = method.pace
        assert pace is not None
        steps = PRESETS[pace.preset].paced(pace.steps).steps
        options = ", ".join(f"{key} {value}" for key, value in (method.options or {}).items())
        lines.append(f"`{method.name}`: preset {pace.preset}, {steps} steps, {options}")
    return lines

"""Options declared as fields: a record made up here gets its checks, its flags and its lines of documentation."""

from __future__ import annotations

import argparse
from typing import Annotated

import numpy as np
import pytest
from msgspec import Struct

from sdf2vec import Sdf2vecError, api
from sdf2vec.cli import SET_HERE, _convert_parser
from sdf2vec.declared import add_flags, checked, choice, chosen, documented, number, options_of, plain
from sdf2vec.export.options import Options
from sdf2vec.fit.settings import Settings

SPICES = {"mint": 1, "salt": 2}


class Toy(Struct, frozen=True):
    cups: Annotated[int, number("number of cups", "N", 1, 9, "how many cups")] = 2
    heat: Annotated[float, number("heat", "SHARE", 0, 1.5, "100 % is hot")] | None = None
    spice: Annotated[str, choice("spice", "what to add", SPICES)] = "salt"
    least_width: Annotated[int, number("least width", "W", 1, None, "at least so wide")] = 1
    sweet: Annotated[bool, plain("with sugar")] = False
    note: Annotated[tuple[str, ...], plain("written on it")] = ()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"cups": 0}, "the number of cups must be a whole number between 1 and 9, got 0"),
        ({"cups": 2.0}, "the number of cups must be a whole number between 1 and 9, got 2.0"),
        ({"cups": True}, "the number of cups must be a whole number between 1 and 9, got True"),
        ({"cups": None}, "the number of cups must be a whole number between 1 and 9, got None"),
        ({"cups": "3"}, "the number of cups must be a whole number between 1 and 9, got '3'"),
        ({"heat": 1.6}, "the heat must be a number between 0 and 1.5, got 1.6"),
        ({"heat": float("nan")}, "the heat must be a number between 0 and 1.5, got nan"),
        ({"least_width": 0}, "the least width must be a whole number of at least 1, got 0"),
        ({"spice": "sand"}, "unknown spice 'sand'; choose from mint, salt"),
        ({"spice": ["salt"]}, "unknown spice ['salt']; choose from mint, salt"),
    ],
)
def test_impossible_values(given, words):
    with pytest.raises(Sdf2vecError) as caught:
        checked(Toy, given)
    assert str(caught.value) == words


def test_possible_values():
    assert checked(Toy, {}) == Toy()
    made = checked(Toy, {"cups": np.int64(9), "heat": np.float32(0.5), "note": ("a",)})
    assert made == Toy(9, 0.5, note=("a",))
    assert (type(made.cups), type(made.heat)) == (int, float)
    assert checked(Toy, {"heat": None, "least_width": 10**12}).least_width == 10**12
    with pytest.raises(TypeError, match="cup"):
        checked(Toy, {"cup": 1})


def test_a_name_that_comes_later_is_known(monkeypatch):
    monkeypatch.setitem(SPICES, "dill", 3)
    assert checked(Toy, {"spice": "dill"}).spice == "dill"


def test_flags_give_what_was_said_and_nothing_else():
    parser = argparse.ArgumentParser()
    add_flags(parser, Toy, without=("note",))
    parser.add_argument("--other")
    namespace = parser.parse_args(["--least-width", "3", "--heat", ".5", "--sweet"])
    assert chosen(namespace, Toy) == {"least_width": 3, "heat": 0.5, "sweet": True}
    text = " ".join(parser.format_help().split())
    assert "--cups N how many cups (default: 2)" in text
    assert "--spice SPICE what to add (mint, salt; default: salt)" in text
    assert "--heat SHARE 100 % is hot --" in text
    assert "--sweet with sugar" in text
    assert "--note" not in text


def test_documentation_has_a_line_for_each():
    @documented(Toy)
    def brew():
        """Brews."""

    assert brew.__doc__
    assert brew.__doc__.startswith("Brews.\n")
    assert "    - `spice`: what to add (mint, salt; default: salt)\n" in brew.__doc__
    assert brew.__doc__.count("- `") == len(options_of(Toy))


def test_each_option_of_a_fit_and_an_export_has_a_flag_and_is_documented():
    flags = {action.dest for action in _convert_parser()._actions}
    assert flags >= set(options_of(Settings)) | set(options_of(Options)) - set(SET_HERE)
    for function, record in ((api.fitted, Settings), (api.exported, Options)):
        assert all(f"- `{name}`: " in (function.__doc__ or "") for name in options_of(record))

"""Drawings that are made once for several limits of their size."""

from functools import cache
from typing import Any

import pytest

from sdf2vec import exports
from sdf2vec.export import svg as svg_module


def remembered(function):
    """The function, which gives the same for the same: what it has been given may be unhashable."""
    known: list[tuple[Any, Any]] = []

    def again(given):
        for before, found in known:
            if before is given:
                return found
        known.append((given, function(given)))
        return known[-1][1]

    return again


@pytest.fixture
def drawn_once(monkeypatch):
    """A drawing follows from scene and detail: it is made once, however many limits it is held against.

    So are numbers of a grain from the scene, where no picture is given, and its render.
    """
    made, text, settled, drawable = {}, svg_module._text, {}, exports._drawable

    def settled_once(scene, views, grain, coarser):
        key = (scene, views, grain, coarser)
        if key not in settled:
            settled[key] = drawable(scene, views, grain, coarser)
        return settled[key]

    def once(planner, detail, options):
        key = (planner.scene, planner.filters, detail, options.title)
        if key not in made:
            made[key] = text(planner, detail, options)
        return made[key]

    monkeypatch.setattr(svg_module, "_text", once)
    monkeypatch.setattr(svg_module, "_planner", cache(svg_module._planner))
    monkeypatch.setattr(exports, "_drawable", settled_once)
    for name in ("_picture_of", "_views_of"):
        monkeypatch.setattr(exports, name, remembered(getattr(exports, name)))

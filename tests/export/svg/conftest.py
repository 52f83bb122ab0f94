"""Drawings that are made once for several limits of their size."""

from functools import cache

import pytest

from sdf2vec.export import svg as svg_module


@pytest.fixture
def drawn_once(monkeypatch):
    """A drawing follows from scene and detail: it is made once, however many limits it is held against."""
    made, text = {}, svg_module._text

    def once(planner, detail, options):
        key = (planner.scene, planner.filters, detail, options.title)
        if key not in made:
            made[key] = text(planner, detail, options)
        return made[key]

    monkeypatch.setattr(svg_module, "_text", once)
    monkeypatch.setattr(svg_module, "_planner", cache(svg_module._planner))

"""`<sdf-image>`: a web component that shows any scene file. Its formulas are lowered like all others."""

from __future__ import annotations

from ..blend import COMPOSITING, JOINS
from ..paints import PAINTS
from ..scene import Scene
from ..scene_file import FORMAT, VERSION
from ..shapes import KINDS
from ..templating import template
from .exported import Exported
from .options import Options
from .records import Form, Variant
from .script import script_parts


def component(scene: Scene, options: Options) -> Exported:
    """An ES module that defines the element; it is the same for every scene."""
    variants = tuple(
        Variant(kind, paint)
        for kind in sorted(KINDS, key=lambda name: KINDS[name].patch is not None)
        for paint in PAINTS
    )
    forms = [Form(variants, tuple(JOINS), name) for name in COMPOSITING]
    text = template("component.js.jinja").render(format=FORMAT, version=VERSION, **script_parts(forms))
    return Exported(text)

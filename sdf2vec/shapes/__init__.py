"""Every shape: its signed distance, its parameters, its extent, its outline; each in a module of its own.

To add a shape, write its distance as an expression and its record, and list that in `KINDS`; the renderers, the
gradients and all exports follow. A point `p` and all lengths are in scene units (the picture's shortest side), y points
down, angles are in radians and turn clockwise on the screen.
"""

from __future__ import annotations

from ..kind import Kind
from .arc import ARC
from .box import BOX
from .circle import CIRCLE
from .displaced import DISPLACED
from .ellipse import ELLIPSE
from .patches import GABOR, GAUSSIAN
from .triangle import ROUNDED_TRIANGLE, TRIANGLE

KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (
        CIRCLE,
        ELLIPSE,
        BOX,
        TRIANGLE,
        ROUNDED_TRIANGLE,
        ARC,
        DISPLACED,
        GAUSSIAN,
        GABOR,
    )
}

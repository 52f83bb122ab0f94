"""sdf2vec turns a picture into a few soft geometric shapes and those into shaders and SVG.

>>> scene = sdf2vec.fit("photo.png", shapes=64)
>>> text = sdf2vec.export(scene, "glsl")
"""

# The packages `fit`, `render` and `export` come first: once they are imported, nothing
# rebinds the names of the functions below. None of them imports numpy or torch.
import sdf2vec.export
import sdf2vec.fit
import sdf2vec.render  # noqa: F401 (see above)

from .api import check, export, exported, fit, fitted, render, share_of
from .errors import Sdf2vecError
from .export.exported import Exported
from .scene import Joint, Layer, Scene, SceneError, Shape
from .scene_file import dumps, load, loads, save
from .shapes import KINDS

__version__ = "0.1.0"

__all__ = [
    "KINDS",
    "Exported",
    "Joint",
    "Layer",
    "Scene",
    "SceneError",
    "Sdf2vecError",
    "Shape",
    "check",
    "dumps",
    "export",
    "exported",
    "fit",
    "fitted",
    "load",
    "loads",
    "render",
    "save",
    "share_of",
]

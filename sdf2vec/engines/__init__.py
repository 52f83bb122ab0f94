"""Real engines that draw an export off screen, to check it against the package's own renderer."""

from sdf2vec.deferred import deferred
from sdf2vec.engines.engine import Engine, EngineError
from sdf2vec.engines.glslang import glslang_validate


def _engine(name: str, advice: str, is_quick: bool = True) -> Engine:
    module = f"sdf2vec.engines.{name}"
    return Engine(name, deferred(module, "probe"), deferred(module, "render"), advice, is_quick)


def _in_chromium(drawing: str, probe: str = "probe") -> Engine:
    module = "sdf2vec.engines.pages"
    return Engine("chromium", deferred(module, probe), deferred(module, drawing), CHROMIUM, is_quick=False)


CHROMIUM = "a browser is needed: apt-get install chromium"

# The last four draw what is more than a picture: a page, an image's address, an element, a material.
ENGINES = {
    "opengl": _engine(
        "opengl", "OpenGL off screen needs a driver: apt-get install libegl1 libgl1 libgl1-mesa-dri"
    ),
    "webgpu": _engine(
        "webgpu", "WebGPU needs a Vulkan driver: apt-get install mesa-vulkan-drivers libvulkan1"
    ),
    "resvg": _engine("resvg", "reinstall it: pip install --force-reinstall resvg_py"),
    "librsvg": _engine("librsvg", "apt-get install librsvg2-bin"),
    "inkscape": _engine("inkscape", "apt-get install inkscape", is_quick=False),
    "cairosvg": _engine("cairosvg", "CairoSVG needs cairo: apt-get install libcairo2"),
    "pdfium": _engine("pdfium", "reinstall it: pip install --force-reinstall pypdfium2"),
    "chromium": _engine("chromium", CHROMIUM, is_quick=False),
    "firefox": _engine("firefox", "apt-get install firefox-esr", is_quick=False),
    "shadertoy": _engine(
        "shadertoy", "make engines puts wgpu-shadertoy in a place of its own", is_quick=False
    ),
    "page": _in_chromium("page"),
    "image": _in_chromium("image"),
    "element": _in_chromium("element"),
    "three": _in_chromium("material", "probe_three"),
}

__all__ = ["ENGINES", "Engine", "EngineError", "glslang_validate"]

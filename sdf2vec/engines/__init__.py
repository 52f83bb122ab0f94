"""Real engines that draw an export off screen, to check it against the package's own renderer."""

from sdf2vec.engines import cairosvg, chromium, firefox, librsvg, opengl, resvg, webgpu
from sdf2vec.engines.engine import Engine, EngineError
from sdf2vec.engines.glslang import glslang_validate

ENGINES = {
    "opengl": Engine("opengl", opengl.missing, opengl.render),
    "webgpu": Engine("webgpu", webgpu.missing, webgpu.render),
    "resvg": Engine("resvg", resvg.missing, resvg.render),
    "librsvg": Engine("librsvg", librsvg.missing, librsvg.render),
    "cairosvg": Engine("cairosvg", cairosvg.missing, cairosvg.render),
    "chromium": Engine("chromium", chromium.missing, chromium.render),
    "firefox": Engine("firefox", firefox.missing, firefox.render),
}

__all__ = ["ENGINES", "Engine", "EngineError", "glslang_validate"]

"""GLSL fragment shaders drawn by OpenGL, off screen through EGL, read back as float32."""

import re
from collections.abc import Callable
from contextlib import ExitStack
from functools import cache
from types import MappingProxyType
from typing import Any

import moderngl
import numpy as np

from sdf2vec.engines.engine import EngineError, Picture, Uniforms, prepare_mesa

# Three corners of a triangle that covers the screen; `gl_VertexID` makes buffers needless.
VERTEX_SHADER = """{version}
void main() {{
    gl_Position = vec4(vec2(gl_VertexID % 2, gl_VertexID / 2) * 4.0 - 1.0, 0.0, 1.0);
}}
"""

VERSION_LINE = re.compile(r"^\s*(#version[^\n]*)", re.MULTILINE)
# Mesa writes `0:12(5): error`, NVIDIA `0(12) : error`, ANGLE and others `ERROR: 0:12:`.
ERROR_LINE = re.compile(
    r"(?:ERROR:\s*)?\d+[:(](?P<line>\d+)[^:]*:\s*(?:error\s*:?\s*)?(?P<text>.*)", re.IGNORECASE
)


@cache
def probe() -> Any:
    """The context. Raises where OpenGL does not work."""
    prepare_mesa()
    settings: dict[str, Any] = {"backend": "egl"}
    return moderngl.create_context(standalone=True, **settings)


def render(
    fragment: str,
    width: int,
    height: int,
    uniforms: Uniforms = MappingProxyType({}),
    texture: Picture | None = None,
) -> Picture:
    """Draws a fragment shader over `width` × `height` pixels.

    Args:
        fragment: GLSL with its `#version` line (`300 es` or `330`).
        width: in pixels.
        height: in pixels.
        uniforms: values by name; names that the compiler has dropped are passed over.
        texture: float32 `[rows, columns, 4]`, bound as the sampler `data`:
            `texelFetch(data, ivec2(x, y), 0)` gives `texture[y, x]`.

    Returns:
        float32 `[height, width, 4]`, row 0 at the top (GL's own row 0 is at the bottom), values unclamped.

    Raises:
        EngineError: the shader is refused.
    """
    try:
        with probe() as context, ExitStack() as release:  # released while the context is current
            program = _program(context, fragment, release.callback)
            _set_uniforms(program, uniforms)
            if texture is not None:
                _bind_texture(context, texture, release.callback)
            pixels = _draw(context, program, (width, height), release.callback)
    except moderngl.Error as error:
        raise EngineError(_summary(str(error)), log=str(error)) from None
    return np.frombuffer(pixels, np.float32).reshape(height, width, 4)[::-1].copy()


def _draw(context: Any, program: Any, size: tuple[int, int], on_release: Callable[..., object]) -> bytes:
    target = context.renderbuffer(size, components=4, dtype="f4")
    on_release(target.release)
    framebuffer = context.framebuffer(color_attachments=[target])
    on_release(framebuffer.release)
    triangle = context.vertex_array(program, [])
    on_release(triangle.release)
    framebuffer.use()
    triangle.render(vertices=3)
    pixels: bytes = framebuffer.read(components=4, dtype="f4", alignment=1)
    return pixels


def _program(context: Any, fragment: str, on_release: Callable[..., object]) -> Any:
    version = VERSION_LINE.search(fragment)
    if version is None:
        raise EngineError("the fragment shader has no #version line")
    vertex = VERTEX_SHADER.format(version=version[1].strip())
    program = context.program(vertex_shader=vertex, fragment_shader=fragment)
    on_release(program.release)
    return program


def _summary(log: str) -> str:
    """The first error of a compiler's or linker's log, with its line in the shader."""
    lines = log.splitlines()
    for found in filter(None, map(ERROR_LINE.match, lines)):
        return f"OpenGL refuses the shader at line {found['line']}: {found['text']}"
    return f"OpenGL refuses: {' '.join(line for line in lines if line.strip('='))}"


def _set_uniforms(program: Any, uniforms: Uniforms) -> None:
    for name, value in uniforms.items():
        if name in program:
            program[name].value = value


def _bind_texture(context: Any, texture: Picture, on_release: Callable[..., object]) -> None:
    rows, columns, _ = texture.shape
    pixels = np.ascontiguousarray(texture, np.float32).tobytes()
    data = context.texture((columns, rows), components=4, data=pixels, dtype="f4")
    on_release(data.release)
    data.filter = (context.NEAREST, context.NEAREST)
    data.use(location=0)  # the unit that a sampler has unless told otherwise

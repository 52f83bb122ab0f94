"""GLSL ES 3.00 drawn by WebGL 2 in Chromium (ANGLE on SwiftShader), timed and read back."""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from sdf2vec.engines import chromium
from sdf2vec.engines.engine import EngineError, Picture, Uniforms

PAGE = "<!DOCTYPE html><canvas></canvas>"
# Draws once more than `frames` and reads back a pixel each time, so that the work is done when the clock stops.
DRAW = """
async ([fragment, width, height, uniforms, data, across, frames]) => {
  const canvas = document.querySelector("canvas");
  canvas.width = width;
  canvas.height = height;
  const gl = canvas.getContext("webgl2", { antialias: false });
  gl.getExtension("EXT_color_buffer_float");
  const started = performance.now();
  const program = gl.createProgram();
  const vertex = `#version 300 es
    void main() { gl_Position = vec4(vec2(gl_VertexID % 2, gl_VertexID / 2) * 4.0 - 1.0, 0.0, 1.0); }`;
  for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const part = gl.createShader(type);
    gl.shaderSource(part, text);
    gl.compileShader(part);
    if (!gl.getShaderParameter(part, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(part));
    gl.attachShader(program, part);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  gl.useProgram(program);
  const compiled = performance.now();
  if (data) {
    const bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0));
    const floats = new Float32Array(bytes.buffer);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, across, floats.length / 4 / across, 0, gl.RGBA, gl.FLOAT, floats);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  }
  const target = gl.createTexture();
  gl.activeTexture(gl.TEXTURE1);
  gl.bindTexture(gl.TEXTURE_2D, target);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, width, height);
  gl.activeTexture(gl.TEXTURE0);
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target, 0);
  gl.viewport(0, 0, width, height);
  for (const [name, value] of Object.entries(uniforms))
    gl["uniform" + value.length + "fv"](gl.getUniformLocation(program, name), value);
  const one = new Float32Array(4);
  const times = [];
  for (let i = 0; i <= frames; i++) {
    const before = performance.now();
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.FLOAT, one);
    times.push(performance.now() - before);
  }
  const pixels = new Float32Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, pixels);
  let text = "";
  const raw = new Uint8Array(pixels.buffer);
  for (let i = 0; i < raw.length; i += 32768) text += String.fromCharCode(...raw.subarray(i, i + 32768));
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return [btoa(text), (compiled - started) / 1000, times.map((t) => t / 1000)];
}
"""


@dataclass(frozen=True)
class Drawing:
    """A picture, and seconds: to compile, for the first frame, for a later one (the quickest)."""

    pixels: Picture
    compile: float
    first: float
    frame: float


def draw(
    fragment: str,
    width: int,
    height: int,
    uniforms: Uniforms = MappingProxyType({}),
    texture: Picture | None = None,
    frames: int = 0,
) -> Drawing:
    """Draws a fragment shader; arguments and pixels as in `opengl.render`, `frames` are drawn for the clock alone.

    Raises:
        EngineError: Chromium is missing, the size is out of range or the shader is refused.
    """
    data = None if texture is None else base64.b64encode(texture.astype("<f4").tobytes()).decode()
    values = {name: np.atleast_1d(value).tolist() for name, value in uniforms.items()}
    across = 0 if texture is None else texture.shape[1]
    with chromium.opened({"index.html": PAGE}, 64, 64) as page:
        try:
            arguments = json.loads(json.dumps([fragment, width, height, values, data, across, frames]))
            encoded, compiled, times = page.evaluate(DRAW, arguments)
        except Exception as error:  # Playwright's own error; its first line is the page's exception
            raise EngineError(
                f"Chromium refuses the shader: {str(error).splitlines()[0]}", str(error)
            ) from None
    pixels = np.frombuffer(base64.b64decode(encoded), "<f4").reshape(height, width, 4)[::-1].copy()
    return Drawing(pixels, compiled, times[0], min(times[1:], default=times[0]))


def render(
    fragment: str,
    width: int,
    height: int,
    uniforms: Uniforms = MappingProxyType({}),
    texture: Picture | None = None,
) -> Picture:
    """The picture that `draw` draws."""
    return draw(fragment, width, height, uniforms, texture).pixels

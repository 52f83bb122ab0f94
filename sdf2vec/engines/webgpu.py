"""WGSL fragment shaders drawn by WebGPU, off screen, read back as float32."""

import os
import re
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import wgpu

from sdf2vec.engines.engine import EngineError, Picture, Uniforms, prepare_mesa

TARGET_FORMAT = "rgba32float"

VERTEX_SHADER = """
@vertex
fn full_screen_triangle(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(vec2f(vec2u(index % 2u, index / 2u)) * 4.0 - 1.0, 0.0, 1.0);
}
"""

COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
BINDING = re.compile(
    r"@group\(\s*0\s*\)\s*@binding\(\s*(\d+)\s*\)\s*var\s*<\s*(uniform|storage)\b[^>]*>\s*(\w+)",
)

ERROR_TITLE = re.compile(r"Shader.*?error: (.*)")
ERROR_LINE = re.compile(r"┌─ \w*:(\d+):")
ERROR_NOTE = re.compile(r"^\s*= (.*)", re.MULTILINE)


class Binding(NamedTuple):
    """A resource that a WGSL module declares in group 0."""

    number: int
    space: str  # "uniform" or "storage"
    name: str


@cache
def probe() -> Any:
    """The device. Raises where WebGPU does not work."""
    prepare_mesa()
    with _runtime_folder():
        return wgpu.gpu.request_adapter_sync().request_device_sync()


def render(
    code: str,
    width: int,
    height: int,
    entry: str | None = None,
    uniforms: Uniforms = MappingProxyType({}),
    texture: Picture | None = None,
) -> Picture:
    """Draws the fragment stage of a WGSL module over `width` × `height` pixels.

    Args:
        code: a WGSL module with a fragment entry point; without a vertex entry point it gets one that
            covers the screen.
        width: in pixels.
        height: in pixels.
        entry: the fragment entry point's name, needless where the module has only one.
        uniforms: values by the name of their `var<uniform>` in group 0; names not declared are passed over.
        texture: float32 `[rows, columns, 4]`, the content of the module's `var<storage, read>` of vec4f:
            element `y * columns + x` is `texture[y, x]`.

    Returns:
        float32 `[height, width, 4]`, row 0 at the top, values unclamped.

    Raises:
        EngineError: a declared resource has no value or the module is refused.
    """
    contents = _contents(code, uniforms, texture)
    try:
        with ExitStack() as release:
            return _draw(code, (width, height), entry, contents, release.callback)
    except (wgpu.GPUError, RuntimeError) as error:
        raise EngineError(_summary(str(error)), log=str(error)) from None


def _draw(
    code: str,
    size: tuple[int, int],
    entry: str | None,
    contents: dict[Binding, bytes],
    on_release: Callable[..., object],
) -> Picture:
    width, height = size
    device = probe()
    layout, group = _bind(device, contents, on_release)
    pipeline = _pipeline(device, code, entry, layout)
    usage = wgpu.TextureUsage.RENDER_ATTACHMENT | wgpu.TextureUsage.COPY_SRC
    target = device.create_texture(size=(width, height, 1), format=TARGET_FORMAT, usage=usage)
    on_release(target.destroy)
    encoder = device.create_command_encoder()
    attachment = {"view": target.create_view(), "load_op": "clear", "store_op": "store"}
    render_pass = encoder.begin_render_pass(color_attachments=[attachment])
    render_pass.set_pipeline(pipeline)
    render_pass.set_bind_group(0, group)
    render_pass.draw(3)
    render_pass.end()
    device.queue.submit([encoder.finish()])
    rows = {"bytes_per_row": width * 16, "rows_per_image": height}
    pixels = device.queue.read_texture({"texture": target}, rows, (width, height, 1))
    return np.frombuffer(pixels, np.float32).reshape(height, width, 4).copy()


def _pipeline(device: Any, code: str, entry: str | None, layout: Any) -> Any:
    fragment = device.create_shader_module(code=code)
    own_vertex = "@vertex" in COMMENT.sub("", code)
    vertex = fragment if own_vertex else device.create_shader_module(code=VERTEX_SHADER)
    return device.create_render_pipeline(
        layout=device.create_pipeline_layout(bind_group_layouts=[layout]),
        vertex={"module": vertex},
        primitive={"topology": "triangle-list"},
        fragment={"module": fragment, "entry_point": entry, "targets": [{"format": TARGET_FORMAT}]},
    )


def _contents(code: str, uniforms: Uniforms, texture: Picture | None) -> dict[Binding, bytes]:
    """The bytes of every resource that the module declares."""
    declared = [
        Binding(int(number), space, name) for number, space, name in BINDING.findall(COMMENT.sub("", code))
    ]
    return {binding: _bytes_of(binding, uniforms, texture) for binding in declared}


def _bytes_of(binding: Binding, uniforms: Uniforms, texture: Picture | None) -> bytes:
    value = uniforms.get(binding.name) if binding.space == "uniform" else texture
    if value is None:
        raise EngineError(f"the module declares var<{binding.space}> {binding.name}, which has no value")
    return np.asarray(value, np.float32).tobytes()


def _bind(device: Any, contents: dict[Binding, bytes], on_release: Callable[..., object]) -> tuple[Any, Any]:
    """The layout and the group of all resources.

    The layout is spelled out, because an automatic one lacks what the entry point declares but never reads.
    """
    usages = {"uniform": wgpu.BufferUsage.UNIFORM, "storage": wgpu.BufferUsage.STORAGE}
    types = {"uniform": "uniform", "storage": "read-only-storage"}
    visibility = wgpu.ShaderStage.FRAGMENT | wgpu.ShaderStage.VERTEX
    layouts, entries = [], []
    for binding, data in contents.items():
        buffer = device.create_buffer_with_data(data=data, usage=usages[binding.space])
        on_release(buffer.destroy)
        layouts.append(
            {"binding": binding.number, "visibility": visibility, "buffer": {"type": types[binding.space]}}
        )
        entries.append({"binding": binding.number, "resource": {"buffer": buffer}})
    layout = device.create_bind_group_layout(entries=layouts)
    return layout, device.create_bind_group(layout=layout, entries=entries)


def _summary(log: str) -> str:
    """One line of an answer that draws the source and marks the place."""
    title, line = ERROR_TITLE.search(log), ERROR_LINE.search(log)
    if title is None:
        return f"WebGPU fails: {log.partition('Caused by:')[2] or log}"
    place = f" at line {line[1]}" if line else ""
    return f"WebGPU refuses the shader{place}: {'; '.join([title[1], *ERROR_NOTE.findall(log)])}"


@contextmanager
def _runtime_folder() -> Iterator[None]:
    """Lends a folder to Wayland's library, which complains on stderr where XDG_RUNTIME_DIR is unset."""
    if "XDG_RUNTIME_DIR" in os.environ:
        yield
        return
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_RUNTIME_DIR"] = folder
        try:
            yield
        finally:
            del os.environ["XDG_RUNTIME_DIR"]

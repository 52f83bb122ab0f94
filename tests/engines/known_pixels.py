"""Shaders that draw known pixels, and what these are."""

import os
from pathlib import Path

import numpy as np
import pytest

SIZES = [(5, 3), (3, 7), (1, 1), (64, 1), (65, 33)]
GLSL_VERSIONS = ["300 es", "330"]

GLSL_POSITION = "void main() { color = vec4(gl_FragCoord.xy, -gl_FragCoord.y, 1000.25); }\n"

GLSL_UNIFORMS = (
    "uniform float one;\nuniform vec2 resolution;\nuniform vec3 unused;\n"
    "void main() { color = vec4(resolution, one, 1.0); }\n"
)

GLSL_TEXTURE = (
    "uniform sampler2D data;\nvoid main() { color = texelFetch(data, ivec2(gl_FragCoord.xy), 0); }\n"
)


def glsl(version, body):
    header = "precision highp float;\nprecision highp sampler2D;\nout vec4 color;\n"
    return f"#version {version}\n{header}{body}"


def positions(width, height):
    y, x = np.mgrid[:height, :width].astype(np.float32) + np.float32(0.5)
    return x, y


def noise(width, height):
    values = np.random.default_rng(0).normal(0, 100, (height, width, 4))
    return values.astype(np.float32)


def growth(render):
    """Mebibytes by which this process grows through 40 renders of 4 MiB each, after a first one."""
    pages = Path("/proc/self/statm")
    if not pages.exists():
        pytest.skip("only Linux tells the size of a process in /proc")
    render()
    before = int(pages.read_text().split()[1])
    for _ in range(40):
        render()
    return (int(pages.read_text().split()[1]) - before) * os.sysconf("SC_PAGE_SIZE") / 2**20

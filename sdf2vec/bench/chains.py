"""What measures how fast a core multiplies and adds."""

from ..kernel_cache import kernel
from ..lower.loops import F32, I64, f32


@kernel
def chains(x: F32[1], rounds: I64):
    """Eight chains of multiply-adds that don't wait."""
    scale, shift = f32(0.999), f32(0.001)
    for _ in range(rounds):
        for i in range(x.size):
            a, b, c, d = x[i], x[i] + shift, x[i] - shift, x[i] * scale
            e, f, g, h = a - scale, b - scale, c - scale, d - scale
            for _ in range(16):
                a, b, c, d = a * scale + shift, b * scale + shift, c * scale + shift, d * scale + shift
                e, f, g, h = e * scale + shift, f * scale + shift, g * scale + shift, h * scale + shift
            x[i] = ((a + b) + (c + d)) + ((e + f) + (g + h))

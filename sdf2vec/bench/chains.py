"""What measures how fast a core multiplies and adds."""

from ..kernel_cache import kernel
from ..lower.loops import F32, I64, f32


@kernel
def chains(x: F32[1], rounds: I64):
    """Eight chains of multiply-adds that don't wait, and that can't be shortened; x stays near 0.28."""
    few, shift, share = f32(0.001), f32(0.2), f32(0.125)
    for _ in range(rounds):
        for i in range(x.size):
            a, b, c, d = x[i], x[i] + few, x[i] - few, x[i] * share
            e, f, g, h = a - shift, b - shift, c - shift, d - shift
            for _ in range(16):
                a, b, c, d = a * a + shift, b * b + shift, c * c + shift, d * d + shift
                e, f, g, h = e * e + shift, f * f + shift, g * g + shift, h * h + shift
            x[i] = ((a + b) + (c + d) + (e + f) + (g + h)) * share

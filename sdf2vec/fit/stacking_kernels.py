"""Layers laid on each other in many orders: the loops know no formula, only what each makes of what is below it."""

from ..kernel_cache import kernel
from ..lower.loops import F32, I64
from ..render.tiling import PIXELS


@kernel
def stack_layers(
    first: I64,
    step: I64,
    images: F32[4],
    orders: I64[2],
    lengths: I64[1],
    start: I64,
    keeps: F32[4],
    adds: F32[4],
    ground: F32[1],
):
    """Pictures [K, B, C, pixels], of every step-th block that `keeps` and `adds` [N, b, C, pixels] have, which begin at
    block `start`: on the ground so many layers of each order [K, most] lie on each other.
    """
    for block in range(first, keeps.shape[1], step):
        for k in range(orders.shape[0]):
            for c in range(keeps.shape[2]):
                seen = images[k, start + block, c]
                for i in range(PIXELS):
                    seen[i] = ground[c]
                for place in range(lengths[k]):
                    kept, added = keeps[orders[k, place], block, c], adds[orders[k, place], block, c]
                    for i in range(PIXELS):
                        seen[i] = kept[i] * seen[i] + added[i]

"""Whether a renderer computes the same function as the reference in float64: values and derivatives."""

import torch

from sdf2vec.render import reference
from sdf2vec.render.tensors import from_scene

VALUES, GRADIENTS = 1e-4, 1e-3
SURELY = 0.1  # share of these that what is well conditioned is off at most in single precision


def outcome(composite, tensors, size):
    """The image, and the derivatives of a fixed random sum of it, by the name of what each belongs to."""
    named = [(slot.parameter.name, v) for group in tensors.groups for slot, v in group.values.items()]
    named.append(("background", tensors.background))
    leaves = [tensor.requires_grad_() for _, tensor in named]
    image = composite(tensors, *size)
    weights = torch.randn(image.shape, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    grads = torch.autograd.grad((image * weights.to(image)).sum(), leaves)
    return image.detach().cpu().double(), [
        (name, grad.cpu().double()) for (name, _), grad in zip(named, grads, strict=True)
    ]


def assert_near_the_reference(composite, scene, tensors, size, channels=4):
    """`composite` of the scene as `tensors`, in so many channels, against the reference of the scene."""
    exact = _reference(scene, torch.float64, size, channels)
    drawn = outcome(lambda *arguments: composite(*arguments, channels), tensors, size)
    assert drawn[0].shape == (channels, size[1], size[0])
    assert _farther(exact, drawn) == []


def is_well_conditioned(scene, size):
    """Whether single precision tells the scene: the reference in it is ten times as near to that in float64 as
    another renderer must be, which sums in another order.

    Where two outlines that are joined sharply are about equally far from a pixel, rounding decides which of them
    counts there, and turns a derivative by more than any renderer may.
    """
    exact, single = (_reference(scene, dtype, size) for dtype in (torch.float64, torch.float32))
    return _farther(exact, single, SURELY) == []


def _reference(scene, dtype, size, channels=4):
    return outcome(
        lambda *arguments: reference.composite(*arguments)[:channels], from_scene(scene, dtype), size
    )


def _farther(exact, other, share=1.0):
    """What of an outcome is farther from the exact one than this share of what is allowed: "image", or the names of
    derivatives.
    """
    (image, grads), (drawn, drawn_grads) = exact, other
    largest: dict[str, float] = {}
    for name, grad in grads:
        largest[name] = max(largest.get(name, 0.1), float(grad.abs().max()))
    return [
        *(["image"] if not float((image - drawn).abs().max()) <= share * VALUES else []),
        *(
            name
            for (name, grad), (_, drawn_grad) in zip(grads, drawn_grads, strict=True)
            if not float((grad - drawn_grad).abs().max()) <= share * GRADIENTS * largest[name]
        ),
    ]

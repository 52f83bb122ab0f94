"""Whether a renderer computes the same function as the reference in float64: values and derivatives."""

import torch

from sdf2vec.render import reference
from sdf2vec.render.tensors import from_scene

VALUES, GRADIENTS = 1e-4, 1e-3


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
    exact = from_scene(scene, torch.float64)
    image, grads = outcome(lambda *arguments: reference.composite(*arguments)[:channels], exact, size)
    drawn, drawn_grads = outcome(lambda *arguments: composite(*arguments, channels), tensors, size)
    assert drawn.shape == (channels, size[1], size[0])
    assert float((image - drawn).abs().max()) <= VALUES
    largest: dict[str, float] = {}
    for name, grad in grads:
        largest[name] = max(largest.get(name, 0.1), float(grad.abs().max()))
    for (name, grad), (_, other) in zip(grads, drawn_grads, strict=True):
        assert float((grad - other).abs().max()) <= GRADIENTS * largest[name], name

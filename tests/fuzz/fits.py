"""Random fits of tiny pictures: nothing that is not finite, and nothing worse than a ground alone."""

import random
from dataclasses import replace

import numpy as np
import torch

import sdf2vec
from sdf2vec.fit.losses import objective
from sdf2vec.image import load
from sdf2vec.render.draw import draw
from sdf2vec.scene import Scene

SIDES = (1, 2, 3, 5, 16)
ALPHAS = ("opaque", "opaque", "half", "noise", "holes", "nothing")
SQUARED, PERCEIVED = 1e-6, 1e-4  # what a mean squared error, any other loss, may be off: scenes are rounded
UNSEEN = 1e-6  # mean squared error, 60 dB, from which on nothing is promised


def picture(r):
    """Noise, a flat colour or a ramp, with or without alpha."""
    noise = np.random.default_rng(r.randrange(2**32))
    long = r.random() < 0.1
    height, width = (r.choice([200, 1000]), 1) if long else (r.choice(SIDES), r.choice(SIDES))
    y, x = np.mgrid[:height, :width]
    ramp = (x / width + y / height)[..., None] * 0.5 * noise.random(3)
    color = r.choice([noise.random((height, width, 3)), np.broadcast_to(noise.random(3), ramp.shape), ramp])
    alpha = {
        "half": np.full((height, width), r.random()),
        "noise": noise.random((height, width)),
        "holes": (noise.random((height, width)) > 0.3) * 1.0,
        "nothing": np.zeros((height, width)),
    }.get(r.choice(ALPHAS))
    layers = [color] if alpha is None else [color, alpha[..., None]]
    return (np.concatenate(layers, axis=2) * 255).round().astype(np.uint8)


def options(r):
    """Of a fit."""
    given = {"shapes": r.choice([5, 5, 6, 9]), "preset": "fast", "seed": r.randrange(1000)}
    given |= r.choice([{}, {}, {"colors": 3}, {"palette": "#000,#fff,#f00"}])
    given |= r.choice([{}, {}, {"loss": r.choice(["mse", "ssim", "flip", "l1:0.5,flip:0.5"])}])
    if not given.keys() & {"colors", "palette"}:
        given |= r.choice([{}, {"compositing": "additive"}])
    return given | r.choice([{}, {}, {"kind": "circle"}, {"kind": "mixed"}])


def attack_fits(seed):
    """A fit of a tiny picture with any options, against its own ground and the best flat one."""
    r = random.Random(seed)
    pixels, given = picture(r), options(r)
    scene = sdf2vec.fit(pixels, **given)
    target = torch.from_numpy(load(pixels).premultiplied.transpose(2, 0, 1).copy())
    measures = ["mse"] if "loss" not in given else [given["loss"]]
    grounds = [scene.ground]
    if not given.keys() & {"colors", "palette"}:
        grounds.append((*target.mean(dim=(1, 2)).tolist(), 1.0)[:4])
    for measure in measures:
        own = _wrong(scene, target, measure)
        assert np.isfinite(own)
        if _wrong(scene, target, "mse") < UNSEEN:
            continue
        for ground in grounds:
            flat = _wrong(replace(scene, layers=(), background=_straight(ground)), target, measure)
            assert own <= flat + (SQUARED if measure == "mse" else PERCEIVED), (
                f"{own:.6f} {measure}, on the ground alone {flat:.6f} ({given})"
            )


def _wrong(scene: Scene, target, name):
    loss = [tuple(part.partition(":")[::2]) for part in name.split(",")]
    measure = objective(tuple((n, float(w or 1)) for n, w in loss), target)
    return float(measure(draw(scene)[: len(target)]))


def _straight(ground):
    return (*(min(light / ground[3], 1.0) if ground[3] else 0.0 for light in ground[:3]), ground[3])

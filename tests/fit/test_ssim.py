"""SSIM in kernels, as a loss, is the metric."""

import pytest
import torch

from sdf2vec.fit.ssim import Dissimilarity
from sdf2vec.metrics import ssim


@pytest.mark.parametrize("shape", [(3, 40, 56), (4, 7, 30), (1, 1, 1), (3, 1, 50), (1, 11, 11)])
def test_fused_ssim_is_the_metric(shape):
    generator = torch.Generator().manual_seed(0)
    target = torch.rand(shape, generator=generator)
    render = (target + 0.3 * torch.rand(shape, generator=generator)).clamp(0, 1)
    fast, exact = render.clone().requires_grad_(), render.double().requires_grad_()
    value, wanted = Dissimilarity(target)(fast), 1 - ssim(exact, target.double())
    assert value.item() == pytest.approx(wanted.item(), abs=1e-4)
    (grad,) = torch.autograd.grad(2.0 * value, fast)
    (want,) = torch.autograd.grad(2.0 * wanted, exact)
    assert float((grad - want).abs().max()) <= 1e-3 * float(want.abs().max())

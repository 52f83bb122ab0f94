"""Every operation as a Triton kernel, on hard inputs, against numpy."""

import numpy as np
import pytest
import torch

from sdf2vec import kernel_cache
from sdf2vec.expr import OPERATIONS, var
from sdf2vec.graph import scalarize
from sdf2vec.lower import triton as triton_lowering
from sdf2vec.lower.block import Block
from tests.operations import MEANINGS, expected
from tests.triton_device import DEVICE, MARKS

pytestmark = MARKS

ARGUMENTS = [var(name) for name in ("x0", "x1", "x2", "x3", "x4")]
SIZE = 256


def operation_text(name, meaning):
    """A kernel that computes an operation at `SIZE` rows of arguments."""
    inputs = tuple(ARGUMENTS[: meaning.arity])
    outputs = scalarize(meaning.build(*inputs))
    loads = ", ".join(f"tl.load(given + {i} * {SIZE} + tl.arange(0, {SIZE}))" for i in range(len(inputs)))
    names = [f"out{i}" for i in range(len(outputs))]
    stores = [f"    tl.store(to + {i} * {SIZE} + tl.arange(0, {SIZE}), {out})" for i, out in enumerate(names)]
    head = f"@triton.jit\ndef run_{name}(given, to):\n    {', '.join(names)} = op_{name}({loads})\n"
    return triton_lowering.forward(Block(f"op_{name}", outputs, inputs, ())) + head + "\n".join(stores) + "\n"


@pytest.mark.parametrize("name", OPERATIONS)
def test_operation(name):
    meaning = MEANINGS[name]
    texts = [operation_text(*item) for item in MEANINGS.items()]
    module = kernel_cache.load_file("\n\n".join([triton_lowering.PREAMBLE, *texts]))
    cases = np.array(meaning.cases, dtype=np.float32)
    given = torch.tensor(np.resize(cases, (SIZE, meaning.arity)).T.copy(), device=DEVICE)
    to = torch.empty((meaning.build(*ARGUMENTS[: meaning.arity]).type.width, SIZE), device=DEVICE)
    getattr(module, f"run_{name}")[(1,)](given, to)
    got, want = to.cpu().numpy()[:, : len(cases)], expected(meaning, cases)
    size = np.abs(cases).max(axis=1) if name in ("add", "sub", "mix", "dot") else 1.0
    scale = np.maximum(np.abs(want), size**2 if name == "dot" else size)
    assert (np.abs(got - want) <= 5e-6 * scale).all()


def test_every_row_that_computes_has_a_triton_cell():
    assert all(bool(row.triton) == bool(row.python) for row in OPERATIONS.values())

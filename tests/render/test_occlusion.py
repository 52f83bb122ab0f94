"""How much of layers is seen, by hand."""

import numpy as np

from sdf2vec.render.occlusion import showing


def test_a_layer_shows_through_those_above():
    assert showing(np.array([[0.5], [0.25], [0.5]])).tolist() == [[0.375], [0.5], [1.0]]

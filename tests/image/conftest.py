"""No picture that is read or written warns of anything."""

import warnings

import pytest


@pytest.fixture(autouse=True)
def _no_warnings():
    """Recorded, not raised: `load` would take a raised one for damage and refuse the picture."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield
    assert [str(warning.message) for warning in caught] == []

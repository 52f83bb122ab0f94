"""How tests call `sdf2vec bench`: in this process, as its entry point does."""

import pytest

from sdf2vec.cli import main


def bench(*arguments):
    """Its exit status."""
    with pytest.raises(SystemExit) as end:
        main(["bench", *map(str, arguments)])
    return end.value.code

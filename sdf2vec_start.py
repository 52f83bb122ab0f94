"""Where the program starts: Ctrl-C ends it without a word while its modules are still being imported."""

import signal

signal.signal(signal.SIGINT, signal.SIG_DFL)

from sdf2vec.cli import main  # noqa: E402 (see above)

__all__ = ["main"]

if __name__ == "__main__":
    main()

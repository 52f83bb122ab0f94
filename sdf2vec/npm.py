"""Where packages of npm are that checks and benches use: `make test` puts them beside those of Python."""

import sys
from pathlib import Path

NODE_MODULES = Path(sys.prefix, "npm", "node_modules")

"""Everything valid and much that is not, at random: see `python -m tests.fuzz --help`."""

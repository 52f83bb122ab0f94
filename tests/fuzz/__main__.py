"""`python -m tests.fuzz --seconds 600`: attacks pictures, scenes, arrays and options until the time is up."""

import argparse
import sys
import time

from tests.fuzz.attacks import ATTACKS, attempt


def main():
    """Prints each failure, with what repeats it, and a table; exits with 1 where there was one."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0, help="how long (default: 600)")
    parser.add_argument("--seed", type=int, default=0, help="the first seed (default: 0)")
    parser.add_argument("--only", choices=ATTACKS, help="one kind of attack")
    options = parser.parse_args()
    names = [options.only] if options.only else list(ATTACKS)
    tried, failed, slowest = dict.fromkeys(names, 0), dict.fromkeys(names, 0), dict.fromkeys(names, 0.0)
    end, seed = time.monotonic() + options.seconds, options.seed
    while time.monotonic() < end:
        name = names[seed % len(names)]
        started = time.process_time()
        problem = attempt(name, seed)
        slowest[name] = max(slowest[name], time.process_time() - started)
        tried[name] += 1
        if problem:
            failed[name] += 1
            print(f"{name} {seed}: {problem}", flush=True)
        seed += 1
    for name in names:
        print(f"{name}: {tried[name]} tried, {failed[name]} failed, slowest {slowest[name]:.1f} CPU s")
    sys.exit(1 if any(failed.values()) else 0)


if __name__ == "__main__":
    main()

"""`python -m tests.fuzz --seconds 600`: attacks pictures, scenes, arrays and options until the time is up."""

import argparse
import resource
import sys
import time

from tests.fuzz.attacks import ATTACKS, attempt

EXPORTED = ("scenes", "unions")
LONGEST = 20.0  # CPU seconds that a scene's export may take


def main():
    """Prints each failure, with what repeats it, and a table; exits with 1 where there was one.

    An export of a scene that takes too long is one, too.
    """
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
        spent = time.process_time() - started
        slowest[name] = max(slowest[name], spent)
        if name in EXPORTED and spent > LONGEST:
            problem = problem or f"took {spent:.0f} CPU s"
        tried[name] += 1
        if problem:
            failed[name] += 1
            print(f"{name} {seed}: {problem}", flush=True)
        seed += 1
    for name in names:
        print(f"{name}: {tried[name]} tried, {failed[name]} failed, slowest {slowest[name]:.1f} CPU s")
    print(f"peak memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
    sys.exit(1 if any(failed.values()) else 0)


if __name__ == "__main__":
    main()

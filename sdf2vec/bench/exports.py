"""How near the exports of one fit come to its render, on every engine present. Writes a table in Markdown.

python -m sdf2vec.bench.exports examples/coffee.png --shapes 64 -o docs/exports.md
"""

from __future__ import annotations

import argparse
from pathlib import Path

from .. import api
from ..files import write_atomically
from ..roundtrip import Check, check


def table(results: list[Check], name: str, about: str, command: str) -> str:
    """The page."""
    head = (
        "# Exports against the render",
        "",
        f"{name}, {about}. Each export drawn by a real engine and compared with the torch render in float64, over "
        "all pixels and RGBA; errors in 8-bit levels, the mean signed. OpenGL and WebGPU are read back as floats, "
        "all others as 8 bits.",
        "",
        f"    {command}",
        "",
        "| target | engine | size | PSNR dB | largest error | mean error | verdict |",
        "|---|---|---:|---:|---:|---:|---|",
    )
    body = (
        f"| {r.target} | {r.engine} | {r.width} x {r.height} | {r.psnr:.1f} | {r.largest_error:.4f} "
        f"| {r.mean_error:+.4f} | {r.verdict} |"
        for r in results
        if not r.missing
    )
    return "\n".join([*head, *body]) + "\n"


def main() -> None:
    """Entry point of `python -m sdf2vec.bench.exports`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--shapes", type=int, default=64)
    parser.add_argument("--kind", default="mixed")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args()
    scene = api.fit(options.picture, options.shapes, kind=options.kind, seed=options.seed)
    command = (
        f"python -m sdf2vec.bench.exports {options.picture} --shapes {options.shapes} --kind {options.kind} "
        f"--seed {options.seed} -o {options.output}"
    )
    about = f"{options.shapes} shapes, kind {options.kind}, seed {options.seed}"
    write_atomically(options.output, table(check(scene), options.picture.name, about, command).encode())


if __name__ == "__main__":
    main()

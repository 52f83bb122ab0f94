"""What a layer is stands in one place: templates compute no colours and no distances, modules repeat no constants."""

import ast
import math
import operator
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import sdf2vec
from sdf2vec import blend
from sdf2vec.templating import template

PACKAGE = Path(sdf2vec.__file__).parent
TEMPLATES = sorted(
    path
    for path in Path(str(template("glsl.jinja").filename)).parent.glob("*.jinja")
    if not path.name.startswith("completion.")  # scripts of shells
)

# --- templates -----------------------------------------------------------------------------------------------

TAGS = re.compile(r"\{#.*?#\}|\{%.*?%\}", re.DOTALL)
REMARKS = re.compile(r'//[^\n]*|(?<!\w)#(?!version)[^\n]*|""".*?"""|"[^"\n]*"|<style>.*?</style>', re.DOTALL)
WORKS = r"(?:\*\*|[-+*/])=?"
# Names of colours, coverages, distances and points of the scene; those of one letter mean so in shaders only.
SHARED = r"[prq]\d|p|d|below\d?|belows|cover|color|opacity|falloff|smoothness|outer|inner|corner|box|fragColor|COLOR"
NAMES = dict.fromkeys(("measures.py.jinja", "tiles.py.jinja", "tiles.triton.jinja"), SHARED)
IN_SHADERS = rf"c|s|o|v|g|{SHARED}"
FORMULAS = r"\b(?:mix|exp2?|log2?|(?<!Math\.)sqrt|pow|smoothstep|sigmoid|tanh|dot|length|normalize)\s*\("


def arithmetic(path: Path) -> list[str]:
    """Lines that compute with a colour or a distance."""
    value = rf"\b(?:{NAMES.get(path.name, IN_SHADERS)})\b(?![(\w-]\w)(?:\.[xyzwrgba]+\b|\[[^]]*\])*"
    after, before = rf"{value}\s*{WORKS}", rf"(?<=[\w)\]])\s*{WORKS}\s*{value}"
    picked = rf"\b(?:min|max|clamp|abs)\([^()]*{value}"
    found = re.compile("|".join((after, before, picked, FORMULAS)))
    return [line.strip() for line in code(path).splitlines() if found.search(line)]


def code(path: Path) -> str:
    """A template's own text: without what it inserts, its tags and remarks."""
    text = re.sub(r"\{\{.*?\}\}", "_", TAGS.sub("", path.read_text()), flags=re.DOTALL)
    return REMARKS.sub("", text)


@pytest.mark.parametrize("path", TEMPLATES, ids=[path.name for path in TEMPLATES])
def test_templates_compute_no_colours_and_no_distances(path):
    assert arithmetic(path) == []


@pytest.mark.parametrize(
    "line",
    [
        "c = c * (1.0 - a) + s * a;",
        "float d = min(s.w, o.w) - k;",
        "c.rgb += s.rgb;",
        "float a = exp(-t);",
        "c = mix(c, s, a);",
        "if d - around < limits[l, 0]:",
        "below0 = below0 + 1.0",
        "x = 1.0 - opacity",
    ],
)
def test_what_is_arithmetic(line, tmp_path):
    (tmp_path / "some.jinja").write_text(f"// fine: c * c\n{line}\n")
    assert arithmetic(tmp_path / "some.jinja") == [line]


# --- constants -----------------------------------------------------------------------------------------------

# Those of `blend` whose values mean nothing else: 10, 10⁻⁶ and 0.004 may be anything.
CONSTANTS = {
    "CUTOFF": blend.CUTOFF,
    "1 / CUTOFF - 1": 1.0 / blend.CUTOFF - 1.0,
    "1 / (1 - 2 CUTOFF)": 1.0 / (1.0 - 2.0 * blend.CUTOFF),
    "MIN_FALLOFF_PIXELS": blend.MIN_FALLOFF_PIXELS,
    "REACH": blend.REACH,
    "REACH * STEEPNESS": blend.REACH * blend.STEEPNESS,
}
OWN_NAMES = ("STEEPNESS", "CUTOFF", "MIN_FALLOFF_PIXELS", "SHARPEST")
BINARY = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv}
FUNCTIONS = {"sqrt": math.sqrt, "log": math.log, "exp": math.exp}


def folded(node: ast.AST) -> float | None:
    """The value of an expression of numbers only."""
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            value = folded(inner)
            return None if value is None else -value
        case ast.BinOp(left=left, op=op, right=right) if type(op) in BINARY:
            pair = folded(left), folded(right)
            if pair[0] is None or pair[1] is None or (isinstance(op, ast.Div) and pair[1] == 0):
                return None
            return float(BINARY[type(op)](*pair))
        case ast.Attribute(attr="pi"):
            return math.pi
        case ast.Call(func=ast.Attribute(attr=name), args=[inner]) if name in FUNCTIONS:
            value = folded(inner)
            return None if value is None or value <= 0 else FUNCTIONS[name](value)
    return None


def repeated(source: str) -> Iterator[str]:
    """Constants of `blend` that a module writes anew, by value or by name."""
    for node in ast.walk(ast.parse(source)):
        value = folded(node)
        if value is not None:
            yield from (name for name, known in CONSTANTS.items() if math.isclose(value, known, rel_tol=1e-4))
        if isinstance(node, ast.Assign):
            yield from (t.id for t in node.targets if isinstance(t, ast.Name) and t.id in OWN_NAMES)


MODULES = [path for path in sorted(PACKAGE.rglob("*.py")) if path != PACKAGE / "blend.py"]


def test_no_module_repeats_a_constant_of_the_formula():
    assert {
        str(p.relative_to(PACKAGE)): names for p in MODULES if (names := list(repeated(p.read_text())))
    } == {}


@pytest.mark.parametrize("path", TEMPLATES, ids=[path.name for path in TEMPLATES])
def test_no_template_repeats_one(path):
    numbers = [float(number) for number in re.findall(r"(?<![\w.])\d+\.\d+(?:e-?\d+)?", code(path))]
    assert not [
        n for n in numbers if any(math.isclose(n, known, rel_tol=1e-4) for known in CONSTANTS.values())
    ]


@pytest.mark.parametrize("source", ["x = 1 / 512", "y = a * 1.6", "CUTOFF = 3", "z = math.log(511.0) / 10.0"])
def test_what_is_a_repeated_constant(source):
    assert list(repeated(source))

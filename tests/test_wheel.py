"""The built wheel holds what it needs and works in an environment where no checkout can help it."""

import json
import os
import re
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from PIL import Image

CHECKOUT = Path(__file__).parent.parent
PYTHON_FOLDER, PROGRAM_SUFFIX = ("Scripts", ".exe") if os.name == "nt" else ("bin", "")


def _run(*command, folder):
    """The finished command; its output is in the failure's text if it failed."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        [str(word) for word in command],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    # With the build backend at hand nothing need be downloaded.
    isolation = ["--no-isolation"] if find_spec("hatchling") else []
    _run(sys.executable, "-m", "build", "--wheel", *isolation, "--outdir", folder, CHECKOUT, folder=folder)
    (built,) = folder.glob("*.whl")
    return built


@pytest.mark.parametrize(
    "checked", [("twine", "check", "--strict"), ("check_wheel_contents",)], ids=lambda c: c[0]
)
def test_wheel_is_fit_to_be_published(wheel, checked):
    if not find_spec(checked[0]):
        pytest.skip(f"{checked[0]} is not installed")
    _run(sys.executable, "-m", *checked, wheel, folder=CHECKOUT)


def test_the_lock_holds_all_dependencies_by_their_hashes():
    """What pyproject.toml asks for, the tests' own packages too; each file by its hash, from no place in particular."""
    text = (CHECKOUT / "requirements.lock").read_text()
    assert "://" not in text
    locked: dict[str, list[str]] = {}
    for entry in re.split(r"\n(?=\S)", text):
        assert "--hash=sha256:" in entry
        ((name, version),) = re.findall(r"^([\w.-]+)==([\w.+-]+)", entry)
        locked.setdefault(name.replace("_", "-"), []).append(version)
    project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    taken = ["test", *next(iter(Requirement(text).extras for text in extras["test"] if "[" in text))]
    wanted = [*project["dependencies"], *(d for extra in taken for d in extras[extra])]
    asked = [Requirement(text) for text in wanted if not text.startswith("sdf2vec[")]
    assert len(asked) > 25
    for requirement in asked:
        name = requirement.name.replace("_", "-")
        assert any(requirement.specifier.contains(version) for version in locked[name]), requirement


def test_the_licences_of_all_dependencies_are_told():
    told = (CHECKOUT / "docs" / "licences.md").read_text()
    project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text())["project"]
    for text in project["dependencies"]:
        assert f"| {Requirement(text).name} |" in told
    assert "LGPL-3.0-or-later" in told


def test_the_package_is_typed(wheel):
    assert "sdf2vec/py.typed" in zipfile.ZipFile(wheel).namelist()


@pytest.fixture(scope="module")
def fresh(wheel, tmp_path_factory):
    """A new environment with the wheel; it borrows the dependencies, above all torch, from the running one."""
    environment = tmp_path_factory.mktemp("fresh") / "environment"
    _run(sys.executable, "-m", "venv", "--without-pip", environment, folder=environment.parent)
    python = environment / PYTHON_FOLDER / f"python{PROGRAM_SUFFIX}"
    install = ("install", "--quiet", "--no-deps", "--no-index", wheel)
    _run(sys.executable, "-m", "pip", "--python", python, *install, folder=environment.parent)
    site_packages = _run(
        python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", folder=environment.parent
    ).stdout.strip()
    # A folder named in a .pth file comes after the environment's own, and its own .pth files, among them
    # that of an editable install, are not read.
    borrowed = "\n".join({sysconfig.get_path("purelib"), sysconfig.get_path("platlib")})
    Path(site_packages, "borrowed.pth").write_text(borrowed)
    return environment


def test_wheel_holds_the_package_and_its_templates(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    assert "sdf2vec/py.typed" in names
    templates = CHECKOUT / "templates"
    expected = {
        f"sdf2vec/templates/{path.relative_to(templates).as_posix()}"
        for path in templates.rglob("*")
        if path.is_file()
    }
    assert expected
    assert expected <= names
    assert "sdf2vec/__init__.py" in names
    assert {name.split("/")[0].split("-")[0] for name in names} == {"sdf2vec", "sdf2vec_start.py"}
    assert not any("test" in name for name in names)


def test_installed_wheel_converts_a_picture(fresh, tmp_path):
    scripts = fresh / PYTHON_FOLDER
    python = scripts / f"python{PROGRAM_SUFFIX}"
    found = _run(python, "-c", "import sdf2vec; print(sdf2vec.__file__)", folder=tmp_path).stdout.strip()
    assert Path(found).is_relative_to(fresh)

    Image.linear_gradient("L").resize((24, 16)).convert("RGB").save(tmp_path / "picture.png")
    command = ["picture.png", "--shapes", "4", "--preset", "fast", "--emit", "glsl,json", "-o", "OUT"]
    _run(scripts / f"sdf2vec{PROGRAM_SUFFIX}", *command, folder=tmp_path)
    assert "#version" in (tmp_path / "OUT" / "picture.glsl").read_text()
    assert json.loads((tmp_path / "OUT" / "picture.scene.json").read_text())

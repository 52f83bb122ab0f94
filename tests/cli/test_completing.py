"""Completion in shells: what bash offers, asked in bash; the others hold every flag, and parse where they are here."""

import os
import shutil
import subprocess

import pytest

from sdf2vec.cli import COMMANDS, WARM_UP
from tests.cli.command import assert_refused

ASK = """
source ./script
compopt() { :; }
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _sdf2vec
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.fixture
def script(folder, run):
    """The script for a shell, in a file."""

    def made(shell):
        (folder / "script").write_bytes(run("completion", shell).out)
        return (folder / "script").read_text()

    return made


@pytest.mark.skipif(not shutil.which("bash"), reason="bash is not here")
@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (["ren"], {"render"}),
        (["pho"], {"photo.jpg"}),
        (["photo.jpg", "--pres"], {"--preset"}),
        (["photo.jpg", "--preset", "b"], {"balanced", "best"}),
        (["--shapes", ""], {"auto"}),
        (["photo.jpg", "--emit", "svg,w"], {"svg,wgsl", "svg,webp"}),
        (["photo.jpg", "-o", "ph"], {"photo.jpg"}),
        (["photo.jpg", "--seed", ""], {""}),
        (["check", "--e"], {"--emit"}),
        (["export", "--anim"], {"--animate"}),
        (["render", "--anim"], {""}),
        (["completion", ""], {"bash", "zsh", "fish"}),
        (["bench", "sh"], {"shaders"}),
        (["bench", "pho"], {"photo.jpg"}),
        (["check", "sh"], {""}),
    ],
)
def test_what_bash_offers(script, words, offered):
    script("bash")
    command = ["bash", "-c", ASK, "bash", "sdf2vec", *words]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert (set(done.stdout.splitlines()), done.stderr) == (offered, "")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_every_flag_and_command_is_there(script, run, shell):
    text = script(shell)
    for command in ("", *(name for name in COMMANDS if name != WARM_UP)):
        assert command in text
        help = run(*([command] if command else []), "--help").out.decode()
        shown = {word.strip("[],") for word in help.split() if word.startswith("--")}
        flags = {word for word in shown if word.strip("-").replace("-", "").isalpha()}
        spelled = {flag: f"-l {flag[2:]} " if shell == "fish" else flag for flag in flags - {"--traceback"}}
        assert [flag for flag, how in spelled.items() if how not in text] == []
    if shutil.which(shell):
        subprocess.run([shell, "-n", "script"], check=True, env=os.environ | {"HOME": os.getcwd()})


def test_an_unknown_shell_is_refused(folder, run):
    assert_refused(run("completion", "tcsh"), "unknown shell 'tcsh'; choose from bash, zsh, fish")

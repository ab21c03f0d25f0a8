"""The archive of a release: the program, completions for each shell, a man page for each command."""

import re
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest
from conftest import find_command

SCRIPT = Path(__file__).parent.parent.parent / "packaging" / "archive.py"


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    out = tmp_path_factory.mktemp("archive")
    arguments = [find_command(), "--target", "x86_64-unknown-linux-gnu", "--out", str(out)]
    done = subprocess.run([sys.executable, SCRIPT, *arguments], capture_output=True, text=True, check=True)
    with tarfile.open(done.stdout.strip()) as packed:
        packed.extractall(out, filter="data")
    (folder,) = (path for path in out.iterdir() if path.is_dir())
    return folder


def test_the_archive_has_what_a_release_needs(archive):
    printed = subprocess.run([archive / "abbe", "--version"], capture_output=True, text=True, check=True).stdout
    assert archive.name == f"abbe-{printed.split()[1]}-x86_64-unknown-linux-gnu"
    names = {path.relative_to(archive).as_posix() for path in archive.rglob("*") if path.is_file()}
    shells = ["abbe.bash", "_abbe", "abbe.fish", "abbe.elv", "_abbe.ps1"]
    assert {"README.md", "LICENSE-MIT", "LICENSE-APACHE", *(f"completions/{shell}" for shell in shells)} <= names
    for command in ("fit", "trace", "plan", "compensate"):
        assert f"man/abbe-{command}.1" in names
    # One page for each command that completes, and one for the program.
    commands = set(re.findall(r"abbe,([a-z]+)\)", (archive / "completions/abbe.bash").read_text())) - {"help"}
    pages = {path.stem.removeprefix("abbe-") for path in (archive / "man").iterdir()}
    assert commands and pages == commands | {"abbe"}


def test_man_pages_are_read_without_a_warning(archive):
    if not shutil.which("groff"):
        pytest.skip("no groff")
    for page in sorted((archive / "man").iterdir()):
        done = subprocess.run(["groff", "-man", "-Tutf8", "-K", "utf8", "-ww", page], capture_output=True, text=True)
        if "cannot execute" in done.stderr or "preconv" in done.stderr:
            pytest.skip("no preconv")
        assert done.returncode == 0 and not done.stderr, done.stderr
        text = re.sub(r".\x08|\x1b\[[0-9;]*m", "", done.stdout)
        for part in ("NAME", "SYNOPSIS", "OPTIONS"):
            assert re.search(rf"^{part}$", text, re.MULTILINE), (page, part)

"""What the tests share: the command, the bundled sessions."""

import os
import shutil
import subprocess
import sysconfig
from pathlib import Path

import pytest

SESSIONS = Path(__file__).parent.parent.parent / "sessions"
MEASURED = [
    "hermle-c600u/measured/session.toml",
    "r-test/measured/session.toml",
    "table-and-head/measured/session.toml",
    "tilting-head/measured/session.toml",
]
PLANS = ["hermle-c600u/chapter4.toml", "hermle-c600u/chapter5.toml", "r-test/plan.toml"]


def find_command() -> str:
    """The command of the wheel that is installed, or that of `ABBE_COMMAND`."""
    own = Path(sysconfig.get_path("scripts")) / "abbe"
    found = os.environ.get("ABBE_COMMAND") or (str(own) if own.exists() else shutil.which("abbe"))
    assert found, "the command abbe is not installed"
    return found


@pytest.fixture
def command(tmp_path):
    """Runs the command; returns its JSON as text if it has some."""

    def run(*arguments, json=True, error=False):
        file = tmp_path / "command.json"
        line = [find_command(), *map(str, arguments), *(["--json", str(file)] if json else [])]
        done = subprocess.run(line, capture_output=True, text=True)
        assert (done.returncode != 0) == error, done.stderr
        if error:
            return done.stderr
        return file.read_text() if json else done.stdout

    return run


@pytest.fixture(scope="session")
def chapter5():
    """The plan of four ball-bar tests."""
    import abbe

    return abbe.Session.read(SESSIONS / "hermle-c600u" / "chapter5.toml")


@pytest.fixture(scope="session")
def measured():
    """The measured session of four ball-bar tests."""
    import abbe

    return abbe.Session.read(SESSIONS / "hermle-c600u" / "measured" / "session.toml")

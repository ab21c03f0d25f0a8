"""The build backend: maturin, after the command and the classes of results are built.

The wheel holds the command `abbe` as a binary beside the module, and `src/abbe/results.py`, which follows from the
schemas that the command prints. Both are made in the workspace, in one build with the module.

`ABBE_PROFILE` states a profile of Cargo other than `release`.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import maturin
from maturin import (
    get_requires_for_build_editable,
    get_requires_for_build_sdist,
    get_requires_for_build_wheel,
)

__all__ = [
    "build_editable",
    "build_sdist",
    "build_wheel",
    "get_requires_for_build_editable",
    "get_requires_for_build_sdist",
    "get_requires_for_build_wheel",
    "prepare_metadata_for_build_wheel",
]

HERE = Path(__file__).resolve().parent.parent
PROFILE = os.environ.get("ABBE_PROFILE", "release")


def data_folder() -> Path:
    """The folder of the command. Maturin asks for it even where it only states metadata."""
    folder = HERE / "data"
    folder.mkdir(exist_ok=True)
    return folder


def prepare() -> None:
    """Builds the command, and puts it and the classes of results where maturin takes them."""
    # Both packages are named, so that the crates of the command have the features that they have in the module, and are
    # built once.
    packages = ["--package", "abbe", "--package", "abbe-python", "--bin", "abbe"]
    messages = ["--message-format", "json-render-diagnostics"]
    build = ["cargo", "build", "--locked", "--profile", PROFILE, *packages, *messages]
    built = subprocess.run(build, cwd=HERE, stdout=subprocess.PIPE, text=True)
    if built.returncode != 0:
        raise SystemExit(
            "abbe cannot be built: it needs Rust 1.95 or later (https://rustup.rs) and its workspace beside `python`"
        )
    lines = map(json.loads, built.stdout.splitlines())
    binaries = [line["executable"] for line in lines if line.get("executable")]
    scripts = data_folder() / "scripts"
    scripts.mkdir(exist_ok=True)
    (binary,) = (Path(path) for path in binaries if Path(path).stem == "abbe")
    command = shutil.copy2(binary, scripts / binary.name)
    if shutil.which("strip"):
        subprocess.run(["strip", command], check=True)
    subprocess.run([sys.executable, HERE / "tools" / "results.py", command], check=True)


def with_profile(settings):
    """The settings of maturin with the profile."""
    given = dict(settings or {})
    arguments = given.get("build-args", "")
    given["build-args"] = f"{arguments} --profile {PROFILE}".strip()
    return given


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    """States the metadata of the wheel."""
    data_folder()
    return maturin.prepare_metadata_for_build_wheel(metadata_directory, config_settings)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """Builds the wheel."""
    prepare()
    return maturin.build_wheel(wheel_directory, with_profile(config_settings), metadata_directory)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    """Builds a wheel that refers to `src`."""
    prepare()
    return maturin.build_editable(wheel_directory, with_profile(config_settings), metadata_directory)


def build_sdist(sdist_directory, config_settings=None):
    """Builds the archive of sources, with the crates of the workspace."""
    data_folder()
    return maturin.build_sdist(sdist_directory, config_settings)

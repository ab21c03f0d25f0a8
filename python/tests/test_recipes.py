"""The recipes of docs/guide/fleet.md: what is printed there runs here, and gives the results of `abbe fleet run` alone."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import find_command
from fleets import make, recipe, results

COUNT = 6


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """Sessions, and their results by one `abbe fleet run`."""
    place = tmp_path_factory.mktemp("alone")
    make(place / "fleet", COUNT, machines=2)
    subprocess.run([find_command(), "fleet", "run", "fleet", "--out", "results", "--quiet"], cwd=place, check=True)
    assert len(results(place / "results")) == COUNT
    return place


@pytest.fixture
def place(alone, tmp_path):
    """A folder with the same sessions, and no results."""
    (tmp_path / "fleet").symlink_to(alone / "fleet")
    return tmp_path


def execute(line, place, **variables):
    """Runs a program of a recipe in its folder, with the command `abbe` on its path."""
    path = os.pathsep.join([str(Path(find_command()).parent), str(Path(sys.executable).parent), os.environ["PATH"]])
    environment = {**os.environ, **variables, "PATH": path}
    done = subprocess.run(line, cwd=place, env=environment, capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stderr
    return done


def test_array_of_slurm(alone, place):
    script = recipe("SLURM", "bash")
    (place / "job.sh").write_text(script)
    first, last = map(int, re.search(r"^#SBATCH --array=(\d+)-(\d+)$", script, re.MULTILINE).groups())
    for task in range(first, last + 1):
        execute(["bash", "job.sh"], place, SLURM_ARRAY_TASK_ID=str(task))
    assert results(place / "results") == results(alone / "results")


def job_of_kubernetes():
    yaml = pytest.importorskip("yaml")
    return yaml.safe_load(recipe("Kubernetes", "yaml"))


def test_indexed_job_of_kubernetes(alone, place):
    job = job_of_kubernetes()
    pod = job["spec"]["template"]["spec"]
    (container,) = pod["containers"]
    (mount,) = container["volumeMounts"]
    assert [volume["name"] for volume in pod["volumes"]] == [mount["name"]]
    for index in range(job["spec"]["completions"]):
        variables = {"JOB_COMPLETION_INDEX": str(index)}
        # Kubernetes replaces $(NAME) where it knows the name; the volume lies in another folder here.
        line = [re.sub(r"\$\(([^)]*)\)", lambda found: variables.get(found[1], found[0]), word)
                for word in container["command"]]  # fmt: skip
        line = [word.replace(mount["mountPath"] + "/", f"{place}/") for word in line]
        execute(line, place, **variables)
    assert results(place / "results") == results(alone / "results")


def test_the_job_of_kubernetes_has_its_schema():
    kubernetes = pytest.importorskip("kubernetes_validate")
    kubernetes.validate(job_of_kubernetes(), kubernetes.latest_version(), strict=True)


def test_snakemake(alone, place):
    pytest.importorskip("snakemake")
    (place / "Snakefile").write_text(recipe("Snakemake", "python"))
    execute(["snakemake", "--cores", "2"], place)
    assert results(place / "results") == results(alone / "results")
    # A second call has nothing to do.
    assert "Nothing to be done" in execute(["snakemake", "--cores", "2"], place).stderr


def test_spark(alone, place):
    pytest.importorskip("pyspark")
    parquet = pytest.importorskip("pyarrow.parquet")
    (place / "recipe.py").write_text(recipe("Spark", "python"))
    variables = {"PYSPARK_SUBMIT_ARGS": "--master local[2] pyspark-shell", "PYSPARK_PYTHON": sys.executable}
    execute([sys.executable, "recipe.py"], place, **variables)
    rows = parquet.read_table(place / "records").to_pylist()
    assert len(rows) == COUNT
    assert {row["key"] + ".json": row["record"].encode() + b"\n" for row in rows} == results(alone / "results")

"""Makes the archive of a release: the program, shell completions, man pages, licences.

    python packaging/archive.py target/release/abbe --target x86_64-unknown-linux-musl --out dist
    python packaging/archive.py target/release/abbe --run target/release/abbe --target x86_64-pc-windows-msvc --out dist

The program prints its own completions and help. `--run` names a build that runs here, if the one to pack is for another
system. The man pages follow from the help, so that they state the same.
"""

import argparse
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
COMPLETIONS = {"bash": "abbe.bash", "zsh": "_abbe", "fish": "abbe.fish", "elvish": "abbe.elv", "powershell": "_abbe.ps1"}
FILES = ["README.md", "CHANGELOG.md", "CITATION.cff", "LICENSE-APACHE", "LICENSE-MIT"]


def printed(program, *arguments):
    done = subprocess.run([program, *arguments], capture_output=True, text=True, encoding="utf-8", check=True)
    return done.stdout


def roff(line):
    """A line of plain text as roff prints it unchanged."""
    line = line.replace("\\", "\\e").replace("-", "\\-").replace("'", "\\(aq").replace("`", "\\(ga").replace("^", "\\(ha").replace("~", "\\(ti")
    return "\\&" + line if line.startswith(".") else line


def man_page(name, version, help_text):
    """The man page of a help: its first paragraph, its usage, and its sections as they are printed."""
    description, _, rest = help_text.partition("\n\nUsage: ")
    usage, _, rest = rest.partition("\n\n")
    one_line = " ".join(description.split())
    lines = [
        f'.TH "{name.upper()}" 1 "" "abbe {version}" "Abbe"',
        ".SH NAME",
        f"{roff(name)} \\- {roff(one_line)}",
        ".SH SYNOPSIS",
        ".nf",
        roff(usage.strip()),
        ".fi",
    ]
    # A section begins with a line at the margin that ends in a colon.
    for part in re.split(r"\n(?=\S[^\n]*:\n)", "\n" + rest.rstrip()):
        if not part.strip():
            continue
        title, _, body = part.strip("\n").partition("\n")
        if not title.endswith(":"):
            title, body = "DESCRIPTION:", part.strip("\n")
        lines += [f'.SH "{roff(title[:-1].upper())}"', ".nf", *map(roff, body.rstrip().splitlines()), ".fi"]
    if "-" not in name:
        lines += [".SH SEE ALSO", "Each command has a page: \\fBabbe\\-fit\\fR(1), \\fBabbe\\-trace\\fR(1), \\fBabbe\\-plan\\fR(1), and so on."]
    else:
        lines += [".SH SEE ALSO", "\\fBabbe\\fR(1)"]
    return "\n".join(lines) + "\n"


def commands(help_text):
    """The commands that a help lists before its options."""
    listed, _, _ = help_text.partition("\nOptions:")
    return [name for name in re.findall(r"^  ([a-z]+) {2,}\S", listed, re.MULTILINE) if name != "help"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path, help="the program to pack")
    parser.add_argument("--run", type=Path, help="a build of the same program that runs here")
    parser.add_argument("--target", required=True, help="the target triple, for the name of the archive")
    parser.add_argument("--out", type=Path, required=True, help="the folder of the archive")
    options = parser.parse_args()
    run = (options.run or options.program).resolve()
    version = printed(run, "--version").split()[1]
    name = f"abbe-{version}-{options.target}"
    options.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / name
        (folder / "completions").mkdir(parents=True)
        (folder / "man").mkdir()
        shutil.copy2(options.program, folder)
        for file in FILES:
            shutil.copy2(ROOT / file, folder)
        for shell, file in COMPLETIONS.items():
            (folder / "completions" / file).write_text(printed(run, "completions", shell), encoding="utf-8")
        helps = {"abbe": printed(run, "--help")}
        helps.update({f"abbe-{command}": printed(run, command, "--help") for command in commands(helps["abbe"])})
        for page, text in helps.items():
            (folder / "man" / f"{page}.1").write_text(man_page(page, version, text), encoding="utf-8")
        kind = "zip" if "windows" in options.target else "gztar"
        print(shutil.make_archive(str(options.out / name), kind, place, name))


if __name__ == "__main__":
    main()

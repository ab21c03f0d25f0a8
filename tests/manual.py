"""Checks the manual, `docs/` and README.md, and writes the tables of measured figures.

    python tests/manual.py                    links and headings, opening of each page, generated tables, number of words
    python tests/manual.py --write            writes the tables of `docs/development/figures.toml` into their pages
    python tests/manual.py --site docs/book   also the links of the site that `mdbook build docs` has written
    python tests/manual.py --words            the words of each page

Words by hand are the words of `wc -w` that have a letter or a digit, without code blocks, and without the pages and blocks
that are generated.
"""

import argparse
import re
import sys
import tomllib
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
MAX_WORDS = 40_000
MAX_LINES_OF_README = 120
# Pages that a program writes. Each says so in its first lines.
GENERATED = [
    "docs/reference/json.md", "docs/reference/keys.md", "docs/python/reference.md", "docs/validation/public-data.md",
]
FIRST_LINES = 8
# Pages without a command: an index, and an overview for maintainers.
WITHOUT_COMMAND = ["docs/README.md", "docs/SUMMARY.md", "docs/development/architecture.md", "docs/development/adding.md"]

FENCE = re.compile(r"^([ \t]*)(`{3,})[^\n]*\n.*?^\1\2[ \t]*$", re.DOTALL | re.MULTILINE)
GENERATED_BLOCK = re.compile(r"^<!-- (generated|speeds)\b.*?^<!-- /\1 -->$", re.DOTALL | re.MULTILINE)
BLOCK_OF_RECORD = re.compile(r"^<!-- generated: ([\w-]+) -->\n.*?^<!-- /generated -->$", re.DOTALL | re.MULTILINE)
RECORD = DOCS / "development" / "figures.toml"
LINK = re.compile(r"!?\[[^\]]*\]\(\s*([^)\s]+)\s*\)|<img[^>]*\ssrc=\"([^\"]+)\"")


def name(page):
    return page.relative_to(ROOT).as_posix()


def without_code(text):
    return FENCE.sub("", text)


def pages():
    return sorted(DOCS.rglob("*.md"))


def words(page):
    """Words of a page that are written by hand."""
    if name(page) in GENERATED or page.name == "SUMMARY.md":
        return 0
    text = without_code(GENERATED_BLOCK.sub("", page.read_text(encoding="utf-8")))
    return sum(1 for word in text.split() if re.search(r"\w", word))


def printed(record, key):
    """The table of a key of the record, or the list of what misses its target."""
    if key == "missed":
        return "\n".join(f"- {miss}" for table in record.values() for miss in table.get("missed", []))
    if key == "crates":
        columns, rows = ["crate", "purpose", "replacement"], crates()
        return table(columns, rows)
    if key == "families":
        return table(["family", "effects in the tables below"], families())
    columns, rows = record[key]["columns"], record[key]["rows"]
    wrong = [row for row in rows if len(row) != len(columns)]
    if wrong:
        raise SystemExit(f"{name(RECORD)}: {key}: {len(columns)} columns, and not so many cells: {wrong[0]}")
    return table(columns, rows)


def crates():
    """Name, purpose and replacement of each crate, from the comment behind it in a manifest."""
    comment = re.compile(r"^([\w-]+) = .*# (.+); otherwise: (.+)$", re.MULTILINE)
    manifests = [ROOT / "Cargo.toml", *sorted(ROOT.glob("*/Cargo.toml"))]
    found = [line for manifest in manifests for line in comment.findall(manifest.read_text(encoding="utf-8"))]
    return sorted([f"`{crate}`", purpose, replacement] for crate, purpose, replacement in found)


def families():
    """The families of the library of the search, and the effects that show them, from the comments behind their names."""
    library = ROOT / "trace" / "src" / "candidates" / "library" / "library.toml"
    found = re.findall(r'^name = "(.+)" # shown as (.+)$', library.read_text(encoding="utf-8"), re.MULTILINE)
    return [[family, ", ".join(f"`{effect}`" for effect in effects.split(", "))] for family, effects in found]


def table(columns, rows):
    line = lambda cells: "| " + " | ".join(cells) + " |"
    return "\n".join([line(columns), "|" + "---|" * len(columns), *map(line, rows)])


def with_record(page, record):
    """The text of a page with the tables that the record has now."""
    block = lambda found: f"<!-- generated: {found[1]} -->\n{printed(record, found[1])}\n<!-- /generated -->"
    return BLOCK_OF_RECORD.sub(block, page.read_text(encoding="utf-8"))


def faults_of_record(record):
    text = "".join(page.read_text(encoding="utf-8") for page in pages())
    for key, table in record.items():
        if text.count(f"<!-- generated: {key} -->") != 1:
            yield f"{name(RECORD)}: {key} is not in exactly one page"
        if ("missed" in table) != any("**" in cell for row in table["rows"] for cell in row):
            yield f"{name(RECORD)}: {key}: `missed` states why a figure in ** ** misses its target"
    for page in pages():
        if with_record(page, record) != page.read_text(encoding="utf-8"):
            yield f"{name(page)}: differs from the record; run `python tests/manual.py --write`"


def anchors(page):
    """The anchors of the headings of a page, as GitHub and mdBook make them."""
    found = {}
    for heading in re.findall(r"^#+ (.+)$", without_code(page.read_text(encoding="utf-8")), re.MULTILINE):
        text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").strip().lower()
        slug = re.sub(r"\s", "-", re.sub(r"[^\w\s-]", "", text))
        found[slug] = found.get(slug, -1) + 1
    return {slug if n == 0 else f"{slug}-{n}" for slug, last in found.items() for n in range(last + 1)}


def faults_of_links(page):
    text = re.sub(r"`[^`\n]+`", "", without_code(page.read_text(encoding="utf-8")))
    for link in (a or b for a, b in LINK.findall(text)):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / unquote(path)).resolve() if path else page
        if not target.exists():
            yield f"{name(page)}: {link} does not exist"
        elif anchor and target.suffix == ".md" and anchor not in anchors(target):
            yield f"{name(page)}: {link}: no heading of {name(target)} has this anchor"


def faults_of_tables(page):
    """Each table has a header with a line below it, and as many cells in every row."""
    table = []
    for number, line in enumerate([*page.read_text(encoding="utf-8").splitlines(), ""], 1):
        line = line.strip()
        if line.startswith("|"):
            table.append(line)
            continue
        if table and not (len(table) > 1 and re.fullmatch(r"[|:\- ]+", table[1])):
            yield f"{name(page)}:{number - len(table)}: a table without a header"
        elif len({len(re.split(r"(?<!\\)\|", re.sub(r"`[^`]*`", "", row))) for row in table}) > 1:
            yield f"{name(page)}:{number - len(table)}: rows with different numbers of cells"
        table = []


def faults_of_opening(page):
    """A generated page says so in its first lines; any other page opens with what the reader can do, and the command."""
    lines = page.read_text(encoding="utf-8").splitlines()
    if name(page) in GENERATED:
        if not re.search(r"generate|writes this page", "\n".join(lines[:FIRST_LINES]), re.IGNORECASE):
            yield f"{name(page)}: its first {FIRST_LINES} lines do not say that it is generated"
        return
    if page.name in ("SUMMARY.md",) or name(page) == "docs/README.md":
        return
    opening = "\n".join(lines).split("\n## ")[0]
    if "After this page you can" not in opening:
        yield f'{name(page)}: says before its first section what the reader can do: "After this page you can …"'
    if name(page) not in WITHOUT_COMMAND and "```" not in opening:
        yield f"{name(page)}: has no command before its first section"


def faults_of_summary():
    listed = re.findall(r"\]\(([^)]+\.md)\)", (DOCS / "SUMMARY.md").read_text(encoding="utf-8"))
    for page in pages():
        path = page.relative_to(DOCS).as_posix()
        if path != "SUMMARY.md" and listed.count(path) != 1:
            yield f"docs/SUMMARY.md: lists {path} {listed.count(path)} times, so that the site lacks it or has it twice"


class Site(HTMLParser):
    """The links and the anchors of a page of the site."""

    def __init__(self, page):
        super().__init__()
        self.links, self.ids = [], set()
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.ids.update(value for key in ("id", "name") if (value := attributes.get(key)))
        self.links += [value for key in ("href", "src") if (value := attributes.get(key)) and tag != "base"]


def faults_of_site(folder):
    site = {page: Site(page) for page in sorted(folder.rglob("*.html")) if page.name not in ("404.html", "toc.html")}
    if not site:
        yield f"{folder}: no page; run `mdbook build docs`"
    for page, content in site.items():
        if page.name == "print.html":
            continue
        for link in content.links:
            if re.match(r"[a-z]+:|//", link):
                continue
            path, _, anchor = link.partition("#")
            target = (page.parent / unquote(path)).resolve() if path else page
            if not target.exists():
                yield f"{page.relative_to(folder)}: {link} does not exist in the site"
            elif anchor and target in site and unquote(anchor) not in site[target].ids:
                yield f"{page.relative_to(folder)}: {link} has no such anchor in the site"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--site", type=Path, help="the folder that mdbook has written")
    parser.add_argument("--words", action="store_true", help="print the words of each page")
    parser.add_argument("--write", action="store_true", help="write the tables of measured figures")
    options = parser.parse_args()
    record = tomllib.loads(RECORD.read_text(encoding="utf-8"))
    if options.write:
        for page in pages():
            page.write_text(with_record(page, record), encoding="utf-8")
    counts = {page: words(page) for page in pages()}
    if options.words:
        for page, count in counts.items():
            print(f"{count:6} {name(page)}")
    faults = [fault for page in [*pages(), ROOT / "README.md"] for fault in faults_of_links(page)]
    faults += [fault for page in pages() for fault in (*faults_of_opening(page), *faults_of_tables(page))]
    faults += faults_of_summary()
    faults += faults_of_record(record)
    if options.site:
        faults += faults_of_site(options.site.resolve())
    total = sum(counts.values())
    if total > MAX_WORDS:
        faults.append(f"docs: {total} words by hand, more than {MAX_WORDS}")
    lines = len((ROOT / "README.md").read_text(encoding="utf-8").splitlines())
    if lines > MAX_LINES_OF_README:
        faults.append(f"README.md: {lines} lines, more than {MAX_LINES_OF_README}")
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"{len(counts)} pages, {total} words by hand, {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())

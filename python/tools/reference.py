"""Writes `docs/python/reference.md` from the signatures and docstrings of the package, without importing it.

    python tools/reference.py [--check]

`--check` compares instead, and fails on a difference.
"""

import ast
import re
import sys
from pathlib import Path

PACKAGE = Path(__file__).parent.parent / "src" / "abbe"
TARGET = Path(__file__).parent.parent.parent / "docs" / "python" / "reference.md"

HEAD = """# Reference of the Python module

*Reader: the researcher and the engineer who call Abbe from Python. `python/tools/reference.py` writes this page from
the docstrings.*

Results have the keys of the [JSON output](../reference/json.md) as attributes: `fit.rms_um`,
`trace.effects[0].aliases[0].component`. `to_dict()` returns the JSON document.

"""


def definitions(package: Path) -> dict[str, ast.AST]:
    """The public classes and functions of a package by name."""
    found: dict[str, ast.AST] = {}
    for file in [*sorted(package.glob("_*.py")), *package.glob("_abbe.pyi")]:
        for node in ast.parse(file.read_text(encoding="utf-8")).body:
            if isinstance(node, (ast.ClassDef, ast.FunctionDef)) and not node.name.startswith("_"):
                found.setdefault(node.name, node)
    return found


def exported(package: Path) -> list[str]:
    """The names in `__all__` of a package."""
    tree = ast.parse((package / "__init__.py").read_text(encoding="utf-8"))
    (names,) = (node.value for node in tree.body if isinstance(node, ast.Assign))
    known = definitions(package)
    return [name for name in ast.literal_eval(names) if name in known]


def markdown(docstring: str | None) -> str:
    """A docstring in NumPy style as Markdown."""
    lines, section, code = [], "", False
    for line in (docstring or "").splitlines():
        if re.fullmatch(r"-{3,}", line):
            section = lines.pop()
            lines += [f"**{section}**", ""]
            continue
        example = section == "Examples" and bool(re.match(r">>>|\.\.\. |\S", line)) and (code or line.startswith(">>>"))
        if example and not code:
            lines.append("```pycon")
        if code and not line.strip():
            lines.append("```")
            code = False
        code = code or example
        entry = re.fullmatch(r"(\*{0,2}[a-z_][\w, ]*?)(?: : (.*))?", line)
        if section in ("Parameters", "Attributes") and entry:
            kind = f" ({entry[2]})" if entry[2] else ""
            lines.append(f"- `{entry[1]}`{kind}:")
        elif section in ("Returns", "Raises") and line and not line.startswith(" "):
            lines.append(f"- {line}:")
        elif section in ("Parameters", "Attributes", "Returns", "Raises") and line.startswith("    "):
            lines.append("  " + line[4:])
        else:
            lines.append(line)
    if code:
        lines.append("```")
    text = re.sub(r":\w+:`~?([^`]+)`", r"`\1`", "\n".join(lines))
    return re.sub(r"(?<!`)``(?!`)", "`", text).strip() + "\n"


def signature(node: ast.FunctionDef, owner: str) -> str:
    """A heading of a function or a property."""
    name = f"{owner}.{node.name}" if owner else node.name
    decorators = [ast.unparse(decorator) for decorator in node.decorator_list]
    returns = f" -> {ast.unparse(node.returns)}" if node.returns else ""
    if "property" in decorators:
        return f"`{name}{returns.replace(' -> ', ': ')}`"
    arguments = ast.unparse(node.args)
    arguments = re.sub(r"^(self|cls)(, |$)", "", arguments)
    return f"`{name}({arguments}){returns}`"


def is_record(node: ast.ClassDef) -> bool:
    """Whether the fields of a class are its documentation."""
    decorators = [ast.unparse(decorator) for decorator in node.decorator_list]
    return "NamedTuple" in map(ast.unparse, node.bases) or any(name.startswith("dataclass") for name in decorators)


def documented_class(owner: str, name: str, node: ast.ClassDef, known: dict[str, ast.AST]) -> str:
    """The section of a class, with what it inherits from the package."""
    text = f"## {owner}{name}\n\n" + markdown(ast.get_docstring(node)) + "\n"
    bases = [known[base.id] for base in node.bases if isinstance(base, ast.Name) and base.id in known]
    members = [member for part in [node, *bases] for member in getattr(part, "body", [])]
    for place, member in enumerate(members):
        following = members[place + 1] if place + 1 < len(members) else None
        if isinstance(member, ast.FunctionDef) and not member.name.startswith("_"):
            if docstring := ast.get_docstring(member):
                text += f"### {signature(member, name)}\n\n{markdown(docstring)}\n"
        elif isinstance(member, ast.AnnAssign) and isinstance(following, ast.Expr) and is_record(node):
            described = ast.literal_eval(following.value)
            text += f"- `{ast.unparse(member)}`: {markdown(described)}"
    return text.rstrip() + "\n\n"


def main() -> None:
    text = HEAD
    for package, owner in [(PACKAGE, ""), (PACKAGE / "fleet", "fleet.")]:
        known = definitions(package)
        for name in exported(package):
            node = known[name]
            if isinstance(node, ast.ClassDef):
                text += documented_class(owner, name, node, known)
            else:
                text += f"## {signature(node, owner.rstrip('.'))}\n\n{markdown(ast.get_docstring(node))}\n"
    text = text.rstrip() + "\n"
    if "--check" not in sys.argv[1:]:
        TARGET.parent.mkdir(exist_ok=True)
        TARGET.write_text(text, encoding="utf-8")
    elif TARGET.read_text(encoding="utf-8") != text:
        raise SystemExit(f"{TARGET.name} differs from the docstrings: run python/tools/reference.py")


if __name__ == "__main__":
    main()

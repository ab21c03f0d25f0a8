"""Writes `src/abbe/results.py`, the classes of results, from the JSON schemas of the command.

    python tools/results.py ABBE [--check]

ABBE is the command. `--check` compares instead, and fails on a difference.
"""

import json
import keyword
import subprocess
import sys
import textwrap
from pathlib import Path

ROOT = {
    "fit": "FitResult",
    "trace": "TraceResult",
    "plan": "PlanAnalysis",
    "validate": "ValidationResult",
    "compare": "ComparisonResult",
}
"""The class of each command's result."""

DOCUMENT = {"schema_version", "tool_version", "command", "session", "inputs", "seed", "options"}
"""Keys of the document around a result."""

TARGET = Path(__file__).parent.parent / "src" / "abbe" / "results.py"

ARRAYS = {"Covariance": "matrix", "NullSpace": "vectors", "Correlation": "matrix"}
"""Objects that are matrices, with the key of the matrix."""


def schemas(command: str) -> dict[str, dict]:
    """The schemas of all objects by the names of their classes, nested ones first."""
    found: dict[str, dict] = {}
    for subject, root in ROOT.items():
        printed = subprocess.run([command, "schema", subject], check=True, capture_output=True, text=True)
        schema = json.loads(printed.stdout)
        for name, definition in schema.pop("$defs", {}).items():
            if name not in ("SessionFile", "InputFile") and "properties" in definition:
                if found.setdefault(name, definition) != definition:
                    raise SystemExit(f"two objects are called {name}")
            elif "properties" not in definition:
                SIMPLE[name] = definition
        schema["properties"] = {key: of for key, of in schema["properties"].items() if key not in DOCUMENT}
        found[root] = schema
    return found


SIMPLE: dict[str, dict] = {}
"""Definitions that are no objects with fixed keys: words and combinations."""


def reference(schema: dict) -> str | None:
    """The class that a schema refers to."""
    name = schema.get("$ref", "").rpartition("/")[2]
    return name if name and name not in SIMPLE else None


def nested(schema: dict) -> str | None:
    """The class of an object or of the items of a list."""
    options = [schema, schema.get("items", {}), *schema.get("anyOf", [])]
    return next((name for name in map(reference, options) if name), None)


def annotation(schema: dict) -> str:
    """The type of a key."""
    if name := reference(schema):
        return name
    if "$ref" in schema:
        return annotation(SIMPLE[schema["$ref"].rpartition("/")[2]])
    if "anyOf" in schema or "oneOf" in schema:
        options = dict.fromkeys(map(annotation, schema.get("anyOf") or schema["oneOf"]))
        return " | ".join(options)
    kind = schema.get("type", "string" if "const" in schema or "enum" in schema else None)
    if isinstance(kind, list):
        return " | ".join(annotation({**schema, "type": one}) for one in kind)
    if kind == "array":
        if "prefixItems" in schema:
            return f"tuple[{', '.join(map(annotation, schema['prefixItems']))}]"
        return f"tuple[{annotation(schema.get('items', {}))}, ...]"
    if kind == "object":
        values = schema.get("additionalProperties")
        return f"dict[str, {annotation(values)}]" if isinstance(values, dict) else "dict[str, Any]"
    words = {"number": "float", "integer": "int", "string": "str", "boolean": "bool", "null": "None"}
    return words.get(kind or "", "Any")


def ordered(found: dict[str, dict]) -> list[str]:
    """The names, each after those it refers to."""
    order: list[str] = []

    def place(name: str) -> None:
        if name in order:
            return
        for key in found[name]["properties"].values():
            if (inner := nested(key)) and inner != name:
                place(inner)
        order.append(name)

    for name in sorted(found):
        place(name)
    return order


def documented(text: str, indent: str) -> str:
    """A docstring."""
    text = text.strip().replace("\\", "\\\\")
    single = f'{indent}"""{text}"""'
    if "\n" not in text and len(single) <= 120:
        return single
    lines = textwrap.wrap(" ".join(text.split()), 120 - len(indent) - 3)
    return f'{indent}"""' + f"\n{indent}".join(lines) + f'\n{indent}"""'


def written(name: str, schema: dict) -> str:
    """The class of an object."""
    lines = [f"class {name}(Record):", documented(schema.get("description", name), "    "), ""]
    links = {key: inner for key, of in schema["properties"].items() if (inner := nested(of))}
    if links:
        entries = "".join(f'        "{key}": {inner},\n' for key, inner in links.items())
        lines.append(f"    _nested: ClassVar[dict[str, type[Record]]] = {{\n{entries}    }}\n")
    if name in ARRAYS:
        lines.append(f'    _array: ClassVar[str | None] = "{ARRAYS[name]}"\n')
    required = set(schema.get("required", []))
    for key, of in schema["properties"].items():
        kind = annotation(of)
        default = ""
        if key not in required:
            empty = {"tuple": "()", "str": '""', "bool": "False"}
            default = empty.get(kind.partition("[")[0], "None")
            if default == "None" and not kind.endswith("None"):
                kind += " | None"
            default = f" = {default}"
        lines.append(f"    {key}{'_' * keyword.iskeyword(key)}: {kind}{default}")
        if description := of.get("description"):
            lines.append(documented(description, "    "))
    return "\n".join(lines) + "\n"


def main() -> None:
    command, *options = sys.argv[1:]
    found = schemas(command)
    text = '"""The results of the command, with their keys as attributes. Written by `tools/results.py`."""\n\n'
    text += "from __future__ import annotations\n\nfrom typing import Any, ClassVar\n\nfrom ._record import Record\n"
    for name in ordered(found):
        text += "\n\n" + written(name, found[name])
    text = text if "Any]" in text or ": Any" in text else text.replace("Any, ClassVar", "ClassVar")
    if "--check" in options:
        if TARGET.read_text(encoding="utf-8") != text:
            raise SystemExit(f"{TARGET.name} differs from the schemas: run tools/results.py {command}")
    else:
        TARGET.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()

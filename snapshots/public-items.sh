#!/usr/bin/env bash
# Compares the public items of the library crates with snapshots/public-items.txt. `--update` writes that file.
# Run `cargo doc --workspace --no-deps` first: the list is taken from its pages `all.html`.
set -euo pipefail
cd "$(dirname "$0")/.."
list=snapshots/public-items.txt
found="$(mktemp)"
trap 'rm -f "$found"' EXIT
for crate in abbe abbe_apply abbe_codegen abbe_files abbe_identify abbe_model abbe_plan abbe_trace; do
    grep -o '<li><a href="[^"]*">' "${CARGO_TARGET_DIR:-target}/doc/$crate/all.html" |
        sed -E "s|<li><a href=\"(.*)\">|\1|; s|^(.*/)?([a-z]+)\.([A-Za-z0-9_]+)\.html|\1\3 \2|; s|/|::|g; s|^|$crate::|"
done | LC_ALL=C sort >"$found"
if [[ "${1:-}" == --update ]]; then
    cp "$found" "$list"
elif ! diff -u "$list" "$found"; then
    echo "public items changed: if that is intended, run snapshots/public-items.sh --update" >&2
    exit 1
fi

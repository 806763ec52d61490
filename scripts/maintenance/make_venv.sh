#!/bin/sh
# Makes a virtual environment with this package (editable) and its developer tools; does nothing if it is up to date.
# usage: sh scripts/maintenance/make_venv.sh FOLDER [PYTHON]
# Plain sh, since it runs before any Python is known to work. Errors are one sentence.
set -eu

cd "$(dirname "$0")/../.."
venv=$1
asked=${2:-}
stamp=$venv/installed-from

fail() {
    echo "$1" >&2
    exit 1
}

# Prints the version, e.g. 3.12, of an interpreter that runs.
version() {
    "$1" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null
}

# The stamp holds the checkout's place, since a copied or moved environment would still point to the old one.
up_to_date() {
    [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$PWD" ] && [ ! pyproject.toml -nt "$stamp" ] && version "$venv/bin/python" >/dev/null
}

same_version() {
    [ -z "$asked" ] || [ "$(find_python 2>/dev/null | cut -d " " -f 1)" = "$(version "$venv/bin/python" || true)" ]
}

find_python() {
    sh scripts/maintenance/pythons.sh first "$asked"
}

if up_to_date && same_version; then
    exit 0
fi
if ! { same_version && [ "$(cat "$stamp" 2>/dev/null)" = "$PWD" ] && version "$venv/bin/python" >/dev/null; }; then
    found=$(find_python)
    refused=${asked:+"PYTHON=$asked cannot be used"}
    [ -n "$found" ] || fail "${refused:-No Python was found that can be used}; install Python 3.11 or newer, or name one: make PYTHON=/path/to/python"
    python=${found#* }
    "$python" -m venv --clear "$venv" || fail "$python could not make the virtual environment $venv; remove it, or name another with 'make VENV=FOLDER'."
fi
echo "Installing into $venv with Python $(version "$venv/bin/python"); Drake is large, this takes a few minutes the first time."
"$venv/bin/python" -m pip install --quiet --disable-pip-version-check --editable '.[dev]' ||
    fail "Installing the dependencies failed, see pip's message above; is there a network connection?"
echo "$PWD" >"$stamp"

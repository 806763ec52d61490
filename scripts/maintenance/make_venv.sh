#!/bin/sh
# Makes a virtual environment with this package (editable) and its developer tools; does nothing if it is up to date.
# usage: sh scripts/maintenance/make_venv.sh FOLDER [PYTHON]
# Plain sh, since it runs before any Python is known to work. Errors are one sentence.
set -eu

cd "$(dirname "$0")/../.."
venv=$1
asked=${2:-}
stamp=$venv/installed-from
needs="drake_starnav needs Python 3.11, 3.12 or 3.13 (or newer, untested)"

fail() {
    echo "$1" >&2
    exit 1
}

# Prints the version, e.g. 3.12, of an interpreter that runs (a launcher without its Python does not).
version() {
    "$1" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null
}

new_enough() {
    "$1" -c 'import sys; sys.exit(sys.version_info[:2] < (3, 11))' 2>/dev/null
}

can_make_venv() {
    "$1" -c 'import ensurepip, venv' 2>/dev/null
}

# Every executable of a name on PATH, not only the first, for that one may be a launcher that does not work.
executables() {
    (
        IFS=:
        for folder in $PATH; do
            if [ -x "$folder/$1" ]; then echo "$folder/$1"; fi
        done
    )
}

# Sets $python to the best interpreter there is, or fails with what was wrong with those that there are.
choose_python() {
    if [ -n "$asked" ]; then
        found=$(version "$asked") || fail "PYTHON=$asked does not run; $needs."
        new_enough "$asked" || fail "PYTHON=$asked is Python $found; $needs."
        can_make_venv "$asked" || fail "PYTHON=$asked has no venv or ensurepip module; on Debian and Ubuntu: apt-get install python$found-venv."
        python=$asked
        return 0
    fi
    old="" bare=""
    for name in python3.13 python3.12 python3.11 python3 python; do
        for python in $(executables $name); do
            found=$(version "$python") || continue
            if ! new_enough "$python"; then
                old="$python is Python $found"
            elif ! can_make_venv "$python"; then
                bare="$python has no venv or ensurepip module; on Debian and Ubuntu: apt-get install python$found-venv"
            else
                return 0
            fi
        done
    done
    [ -z "$bare" ] || fail "$bare."
    [ -z "$old" ] || fail "$needs, and $old; install one, or name one with 'make PYTHON=/path/to/python'."
    fail "$needs, and none was found; install one, or name one with 'make PYTHON=/path/to/python'."
}

# The stamp holds the checkout's place, since a copied or moved environment would still point to the old one.
up_to_date() {
    [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$PWD" ] && [ ! pyproject.toml -nt "$stamp" ] && version "$venv/bin/python" >/dev/null
}

same_version() {
    [ -z "$asked" ] || [ "$(version "$asked" || true)" = "$(version "$venv/bin/python" || true)" ]
}

if up_to_date && same_version; then
    exit 0
fi
choose_python
echo "Installing into $venv with Python $found; Drake is large, this takes a few minutes the first time."
if ! { new_enough "$venv/bin/python" && same_version && [ "$(cat "$stamp" 2>/dev/null)" = "$PWD" ]; }; then
    "$python" -m venv --clear "$venv" || fail "$python could not make the virtual environment $venv; remove it, or name another with 'make VENV=FOLDER'."
fi
"$venv/bin/python" -m pip install --quiet --disable-pip-version-check --editable '.[dev]' ||
    fail "Installing the dependencies failed, see pip's message above; is there a network connection?"
echo "$PWD" >"$stamp"
echo "Compiling what trials need, half a minute; later runs find it compiled."
"$venv/bin/python" -m drake_starnav simulate room --quiet --set simulation.timeout=8 >/dev/null 2>&1 || true

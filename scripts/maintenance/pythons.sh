#!/bin/sh
# Prints the Pythons that can make an environment for this package, a line `3.13 /path/to/python3.13` for each version:
# those that are tested, newest first, then what `python3` and `python` start.
# usage: sh scripts/maintenance/pythons.sh [first [PYTHON]]
# `first` prints no more than one, PYTHON, a name or a path, looks at no other. What is passed over is named on standard
# error.
# Looks into the folders of PATH, then into those of pyenv and of the variable PLACES, which has one a line.
# Plain sh, since it runs before any Python is known to work.
set -eu
cd "$(dirname "$0")/../.."

IFS='
'
tested=$(sed -n 's/.*Programming Language :: Python :: \(3\.[0-9]*\)".*/\1/p' pyproject.toml | sort -t. -k2nr)
oldest=$(echo "$tested" | tail -n 1)
pyenv=${PYENV_ROOT:-$(pyenv root 2>/dev/null || echo "$HOME/.pyenv")}
places=${PLACES-"/usr/local/bin
/usr/bin
/opt/homebrew/bin
/opt/local/bin
/Library/Frameworks/Python.framework/Versions/*/bin
$HOME/.local/bin
$HOME/.local/share/uv/python/*/bin"}

# Every executable of a name, not only the first, for that one may be a launcher without its Python.
executables() {
    for folder in $(echo "$PATH" | tr : '\n') "$pyenv"/versions/*/bin $places; do
        if [ -x "$folder/$1" ]; then (cd "$folder" && echo "$(pwd -P)/$1"); fi
    done | awk '!seen[$0]++'
}

candidates() {
    case ${2:-} in
    */*) echo "$2" ;;
    ?*) executables "$2" ;;
    *) for name in $(echo "$tested" | sed 's/^/python/') python3 python; do executables "$name"; done ;;
    esac
}

enough() {
    case $1 in 3.*) [ "${1#3.}" -ge "${oldest#3.}" ] ;; *) false ;; esac
}

printed=" "
for python in $(candidates "$@"); do
    if ! version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null); then
        echo "Passed over $python: it does not start." >&2
    elif ! enough "$version"; then
        [ "$printed" = " " ] || continue  # of use only to who has no other
        echo "Passed over $python: it is Python $version." >&2
    elif [ "${printed#* "$version" }" != "$printed" ]; then
        continue
    elif ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
        echo "Passed over $python: it lacks venv or ensurepip (Debian, Ubuntu: apt-get install python$version-venv)." >&2
    else
        echo "$version $python"
        if [ "${1:-}" = first ]; then exit 0; fi
        printed="$printed$version "
    fi
done

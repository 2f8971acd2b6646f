#!/bin/sh
# Make .venv if it is not there or out of date.  Silent, and quick, when there is nothing to do.
cd "$(dirname "$0")/.." || exit 1

if "${PYTHON:-.venv/bin/python}" -I -S .ci/setup.py --check >/dev/null 2>&1; then
    exit 0
fi

set -- python3.14 python3.13 python3.12 python3.11 python3
if [ -n "$PYTHON" ]; then
    set -- "$PYTHON"
fi
for python; do
    # ensurepip is asked for because Debian ships it apart, and no venv can be made without it
    if "$python" -I -c 'import sys, ensurepip; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1; then
        exec "$python" -I .ci/setup.py
    fi
done
echo "set-up: needs Python 3.11 or newer with its venv module, and found none under the names $*;" \
    "install one (on Debian and Ubuntu: python3 and python3-venv) or name yours: make PYTHON=/path/to/python" >&2
exit 1

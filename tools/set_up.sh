#!/bin/sh
# The environment that the Makefile's targets work in: sh tools/set_up.sh PYTHON VENV LOCK OUT
#
# Says in one line what is wrong with the Python that was chosen; set_up.py does the rest with it.

python=$1
shift

fail() {
    printf 'set-up: %s\n' "$1" >&2
    exit 1
}

# Pythons on the path that are new enough, as words to choose by.
others() {
    found=
    for minor in 19 18 17 16 15 14 13 12 11; do
        if "python3.$minor" -c '' 2>/dev/null; then
            found="$found PYTHON=python3.$minor"
        fi
    done
    if [ -n "$found" ]; then
        printf 'found here:%s' "$found"
    else
        printf 'none is on the path; on Debian and Ubuntu: sudo apt install python3 python3-venv'
    fi
}

told=$("$python" -c '
import platform, sys
print("%s %d.%d.%d" % ((platform.python_implementation(),) + tuple(sys.version_info[:3])))
sys.exit(0 if sys.version_info >= (3, 11) and platform.python_implementation() == "CPython" else 3)
' 2>/dev/null)
case $? in
0) ;;
3) fail "$python is $told, and dmpcli needs CPython 3.11 or newer: name one as make ... PYTHON=...; $(others)" ;;
*) fail "$python does not run: name CPython 3.11 or newer as make ... PYTHON=...; $(others)" ;;
esac

exec "$python" "$(dirname "$0")/set_up.py" "$@"

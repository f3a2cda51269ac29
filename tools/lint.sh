#!/bin/sh
# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
#
# Run all linters, with the Python given; fail if any of them does.
set -u
python=$1
cd "$(dirname "$0")/.." || exit 1

# They share two cores: at once, they take half the time.
check() {
    name=$1
    shift
    if output=$("$@" 2>&1); then
        echo "$name: ok"
    else
        printf '%s\n' "$output" | grep -v -e '^checking ' -e '^Checked files:' -e '^\* '
        echo "$name: failed"
        return 1
    fi
}

# Not the whole folder: environments and builds may lie in it.
sources=$(find setup.py phase_traj_ros test launch benchmarks tools -name '*.py' 2>/dev/null)
check ruff "$python" -m ruff check . & linters=$!
check mypy "$python" -m mypy & linters="$linters $!"
check ament_flake8 "$python" -m ament_flake8.main $sources & linters="$linters $!"
check ament_pep257 "$python" -m ament_pep257.main $sources & linters="$linters $!"

status=0
for each in $linters; do
    wait "$each" || status=1
done
[ $status = 0 ] || echo 'error: a linter failed' >&2
exit $status

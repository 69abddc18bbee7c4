#!/usr/bin/env bash
# Runs a command under Oclgrind and fails on anything that it reports: oclgrind.sh OCLGRIND COMMAND...
set -euo pipefail
oclgrind=$1
shift
log=$(mktemp)

export BTFIELD_DEVICE=Oclgrind BTFIELD_CACHE_DIR
BTFIELD_CACHE_DIR=$(mktemp -d)
trap 'rm -rf "$log" "$BTFIELD_CACHE_DIR"' EXIT

# Optimised kernels, and functions that are put in the place of their calls, hold LLVM intrinsics that Oclgrind 21.10 does not
# know. Uninitialised values are not reported: the lanes that pad a spectrum are undefined on purpose.
"$oclgrind" --log "$log" --build-options "-cl-opt-disable -DBTFIELD_CALLS" --data-races --max-errors 20 "$@"
if [[ -s $log ]]; then
    echo "Oclgrind reports:" >&2
    cat "$log" >&2
    exit 1
fi
echo "Oclgrind reports nothing."

#!/usr/bin/env bash
# fuzz.sh PROGRAM FOLDER [TARGET...] [--runs N] [--seconds S] [--seed X]: feeds each target (all of them unless named)
# changed bytes, N times or for S seconds (60 unless told; with both, what ends first), as many targets at once as there
# are processors. FOLDER keeps, from run to run, what was found to lead to new ways through the code. A seed makes the same
# changes each time, as long as FOLDER is empty.
set -euo pipefail

program=$1 folder=$2
shift 2
targets=() limits=() seed=()
while (($#)); do
    case $1 in
    --runs | --seconds | --seed)
        [[ ${2-} =~ ^[1-9][0-9]*$ ]] || {
            echo "$1 wants a whole number above 0" >&2
            exit 2
        }
        case $1 in
        --runs) limits+=("-runs=$2") ;;
        --seconds) limits+=("-max_total_time=$2") ;;
        --seed) seed=(-seed="$2") ;;
        esac
        shift 2
        ;;
    *)
        targets+=("$1")
        shift
        ;;
    esac
done
((${#limits[@]})) || limits=(-max_total_time=60)
mapfile -t known < <("$program" --list)
((${#targets[@]})) || targets=("${known[@]}")
for target in "${targets[@]}"; do
    [[ " ${known[*]} " == *" $target "* ]] || {
        echo "no target '$target'; there are ${known[*]}" >&2
        exit 2
    }
done

# One target, and a line about it.
one() {
    local target=$1 own=$folder/$1 log=$folder/$1/log rc=0
    mkdir -p "$own/corpus"
    rm -rf "$own/seeds"
    { "$program" "$target" --seeds "$own/seeds" &&
        "$program" "$target" "${limits[@]}" "${seed[@]}" -max_len=8192 -timeout=20 -rss_limit_mb=4096 -print_final_stats=1 \
            -artifact_prefix="$own/finding-" "$own/corpus" "$own/seeds"; } >"$log" 2>&1 || rc=$?
    awk -v target="$target" -v rc=$rc '
        /^stat::number_of_executed_units:/ { runs = $2 }
        /^stat::average_exec_per_sec:/ { speed = $2 }
        / cov: / { for (i = 1; i < NF; ++i) if ($i == "cov:") ways = $(i + 1) }
        END { printf "%-14s %10d runs %7d per second %6d ways  %s\n", target, runs, speed, ways,
                     rc == 0 ? "no finding" : "A FINDING" }' "$log"
    if ((rc)); then
        grep -av '^#[0-9].* cov: ' "$log" | tail -60 >&2
        echo "To see it again: $program $target FILE, with what $own/finding-... holds" >&2
    fi
    return $rc
}

status=0 running=0
for target in "${targets[@]}"; do
    if ((running == $(nproc))); then
        wait -n || status=1
        ((running -= 1)) || true
    fi
    one "$target" &
    ((running += 1))
done
while ((running)); do
    wait -n || status=1
    ((running -= 1)) || true
done
exit $status

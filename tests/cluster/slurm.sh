#!/usr/bin/env bash
# Starts a SLURM of this machine alone, shares a quick reproduction through it, kills one task, and
# compares the merged results with those of one command. Exit code 77 where SLURM cannot be run.
#   slurm.sh BATWING FOLDER [SHARDS]
# Needs root, slurmctld, slurmd, munged and mungekey. FOLDER is emptied. WHOLE names results of
# `reproduce --quick` with their cache in `cache`, if there are such already.
set -euo pipefail
batwing=$(realpath "$1")
folder=$(realpath -m "$2")
shards=${3:-8}

source "$(dirname "$0")/private_slurm.sh"

# Waits until no task of job $1 is left.
ended() {
    while squeue -h -j "$1" 2>/dev/null | grep -q .; do
        sleep 0.5
    done
}

# The process of shard $1 in this folder, if there is one.
process_of() {
    for pid in $(pgrep -f -- "--shard $1/$shards"); do
        [ "$(readlink "/proc/$pid/cwd")" = "$folder" ] && echo "$pid" && return
    done
    return 0
}

cd "$folder"
begin=$SECONDS
whole=$(realpath -m "${WHOLE:-whole}")
if [ -z "${WHOLE:-}" ]; then
    "$batwing" reproduce --quick --threads "$cpus" --quiet --out "$whole" --cache "$whole/cache"
    echo "one command with $cpus threads: $((SECONDS - begin)) s"
fi

begin=$SECONDS
# A requeued task would hide what the merge has to find.
"$batwing" submit --slurm --shards "$shards" --sbatch=--no-requeue --go --json -- \
    reproduce --quick --out shared --cache shared/cache >submitted.json
array=$(python3 -c 'import json; print(json.load(open("submitted.json"))["array_and_merge"][0])')
merge=$(python3 -c 'import json; print(json.load(open("submitted.json"))["array_and_merge"][1])')
if [ "${KILL:-yes}" = yes ]; then
    # The last task has begun: it is killed outright.
    victim=$((shards - 1))
    waited=$SECONDS
    until pid=$(process_of "$victim") && [ -n "$pid" ]; do
        if [ $((SECONDS - waited)) -gt 600 ]; then
            echo "expected task $victim of the array to run within 600 s, got none" >&2
            exit 1
        fi
        sleep 0.05
    done
    kill -KILL "$pid"
    ended "$array"
    ended "$merge"
    said=$(cat shared/slurm/merge_*.log)
    echo "$said"
    case $said in
    *"sbatch --array=$victim shared/slurm/shards.sh"*) ;;
    *)
        echo "the merge does not name the dead shard" >&2
        exit 1
        ;;
    esac
    again=$(sbatch --parsable --array="$victim" shared/slurm/shards.sh)
    ended "$again"
    "$batwing" merge shared --quiet
else
    ended "$array"
    echo "$shards shards: $((SECONDS - begin)) s"
    ended "$merge"
    echo "with the merge: $((SECONDS - begin)) s"
fi
rm -r shared/slurm
diff -r "$whole" shared
echo "$shards shards through SLURM leave the bytes of one command"

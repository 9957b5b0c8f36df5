#!/usr/bin/env bash
# Starts a SLURM of this machine alone and two workers of Dask in it, shares tables of eight rings
# among them by the script of the guide, and compares the merged results with those of one command.
# Exit code 77 where SLURM cannot be run.
#   dask_slurm.sh BATWING FOLDER PYTHON
# PYTHON has dask-jobqueue. Needs root, slurmctld, slurmd, munged and mungekey. FOLDER is emptied.
set -euo pipefail
batwing=$(realpath "$1")
folder=$(realpath -m "$2")
python=$(realpath -s "$3")
guide=$(realpath "$(dirname "$0")/../../docs/guide/dask_shards.py")
source "$(dirname "$0")/private_slurm.sh"

cp "$(dirname "$guide")/../../data/designs/d1.toml" "$folder"
cd "$folder"
command=(bsdf d1.toml --rings 5,15,25,35,45,55,65,75 --tolerance 0.05)
"$batwing" "${command[@]}" --threads "$cpus" --quiet --out whole/out --cache whole/cache
begin=$SECONDS
cat >workers.py <<'EOF'
import signal
import sys

from dask_jobqueue import SLURMCluster

# Ends the workers too.
signal.signal(signal.SIGTERM, lambda *_: sys.exit())

with SLURMCluster(cores=1, memory="1GB", walltime="00:10:00", interface="lo") as cluster:
    cluster.scale(2)
    print(cluster.scheduler_address, flush=True)
    signal.pause()
EOF
"$python" workers.py >scheduler.txt 2>workers.log &
workers=$!
started+=("$workers")
for _ in $(seq 300); do
    [ -s scheduler.txt ] && break
    sleep 0.1
done
"$python" "$guide" --scheduler "$(cat scheduler.txt)" --batwing "$batwing" --shards 8 -- \
    "${command[@]}" --out shared/out --cache shared/cache
kill "$workers"
wait "$workers" || true
echo "8 shards and their merge: $((SECONDS - begin)) s"
diff -r whole shared
echo "two workers of Dask through SLURM leave the bytes of one command"

#!/usr/bin/env bash
# Starts a SLURM of this machine alone, shares a quick reproduction through it, kills one task, and
# compares the merged results with those of one command. Exit code 77 where SLURM cannot be run.
#   slurm.sh BATWING FOLDER [SHARDS]
# Needs root, slurmctld, slurmd, munged and mungekey. FOLDER is emptied.
set -euo pipefail
batwing=$(realpath "$1")
folder=$(realpath -m "$2")
shards=${3:-8}

unable() {
    echo "$1" >&2
    exit 77
}
[ "$(id -u)" -eq 0 ] || unable "SLURM without systemd is started as root"
for program in munged mungekey slurmctld slurmd sbatch; do
    command -v "$program" >/dev/null || unable "needs $program (Debian: slurm-wlm, munge)"
done

rm -rf "$folder"
mkdir -p "$folder"/{spool,state,munge}
export SLURM_CONF="$folder/slurm.conf"
host=$(hostname -s)
cpus=$(nproc)
# Ports of this process, so that another SLURM of this machine is left alone.
port=$((20000 + $$ % 20000))
cat >"$SLURM_CONF" <<EOF
ClusterName=batwing
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
SlurmdPort=$((port + 1))
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$folder/munge/socket
CryptoType=crypto/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
SchedulerParameters=sched_interval=1,batch_sched_delay=0,sched_min_interval=10000,bf_interval=1
MinJobAge=3600
KillWait=5
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
NodeName=$host NodeAddr=127.0.0.1 CPUs=$cpus Sockets=1 CoresPerSocket=$cpus ThreadsPerCore=1 State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
EOF

started=()
stop() {
    for process in "${started[@]}"; do
        kill "$process" 2>/dev/null || true
    done
    wait
}
trap stop EXIT
mungekey -c -k "$folder/munge/key"
munged --foreground --force --key-file="$folder/munge/key" --socket="$folder/munge/socket" \
    --pid-file="$folder/munge/pid" --seed-file="$folder/munge/seed" 2>"$folder/munged.log" &
started+=($!)
for _ in $(seq 100); do
    [ -S "$folder/munge/socket" ] && break
    sleep 0.1
done
slurmctld -D >"$folder/controller.log" 2>&1 &
started+=($!)
slurmd -D >"$folder/node.log" 2>&1 &
started+=($!)
for _ in $(seq 300); do
    sinfo -h -o %T 2>/dev/null | grep -q idle && break
    sleep 0.1
done
sinfo -h -o %T | grep -q idle || unable "SLURM does not start here ($folder/slurmctld.log)"
echo "SLURM answers after $SECONDS s"

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
"$batwing" reproduce --quick --seed 9 --threads "$cpus" --quiet --out whole/out --cache whole/cache
echo "one command with $cpus threads: $((SECONDS - begin)) s"

begin=$SECONDS
# A requeued task would hide what the merge has to find.
"$batwing" submit --slurm --shards "$shards" --sbatch=--no-requeue --go --json -- \
    reproduce --quick --seed 9 --out shared/out --cache shared/cache >submitted.json
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
    said=$(cat shared/out/slurm/merge_*.log)
    echo "$said"
    case $said in
    *"sbatch --array=$victim shared/out/slurm/shards.sh"*) ;;
    *)
        echo "the merge does not name the dead shard" >&2
        exit 1
        ;;
    esac
    again=$(sbatch --parsable --array="$victim" shared/out/slurm/shards.sh)
    ended "$again"
    "$batwing" merge shared/out --quiet
else
    ended "$array"
    echo "$shards shards: $((SECONDS - begin)) s"
    ended "$merge"
    echo "with the merge: $((SECONDS - begin)) s"
fi
rm -r shared/out/slurm
diff -r whole shared
echo "$shards shards through SLURM leave the bytes of one command"

# Starts a SLURM of this machine alone in $folder, which is emptied; it ends with the script that
# sources this file. Exit code 77 where SLURM cannot be run.
# Needs root, slurmctld, slurmd, munged and mungekey.
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
megabytes=$(awk '/MemTotal/ { print int($2 / 1100) }' /proc/meminfo)
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
NodeName=$host NodeAddr=127.0.0.1 CPUs=$cpus Sockets=1 CoresPerSocket=$cpus ThreadsPerCore=1 RealMemory=$megabytes State=UNKNOWN
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

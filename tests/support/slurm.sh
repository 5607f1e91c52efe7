# slurm.sh: Slurm on three hosts of hosts.sh, whose scripts source this file: `slurm` starts the controller on host 1, and
# nodes on hosts 2 and 3. `jobs` waits until no job is left; `batch` submits.

slurm() {
    local k tool
    for tool in slurmctld slurmd munged sbatch; do
        command -v $tool >/dev/null || skip "there is no $tool here (on Debian: apt-get install slurm-wlm)"
    done
    mkdir -p "$folder/slurm/state"
    head -c 128 /dev/urandom >"$folder/slurm/munge.key"
    chmod 600 "$folder/slurm/munge.key"
    # gpu: as many as the job scripts request, null devices; cred_expire: how long a requeued job waits, s
    echo "ClusterName=hosts
SlurmctldHost=host1
SlurmUser=root
AuthInfo=cred_expire=5
StateSaveLocation=$folder/slurm/state
SlurmdSpoolDir=$folder/slurm/%n
SlurmctldPidFile=/run/slurmctld.pid
SlurmdPidFile=/run/slurmd.pid
SlurmctldLogFile=$folder/slurm/slurmctld.log
SlurmdLogFile=$folder/slurm/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
MpiDefault=none
KillWait=20
SlurmdParameters=config_overrides
GresTypes=gpu
NodeName=host[2-3] CPUs=8 Gres=gpu:8 State=UNKNOWN
PartitionName=main Nodes=ALL Default=YES" >"$folder/slurm/slurm.conf"
    # pmix does not share /tmp with other hosts
    echo "PMIxCliTmpDirBase=/run" >"$folder/slurm/mpi.conf"
    for k in {0..7}; do mknod "$folder/slurm/gpu$k" c 1 3; done
    echo "NodeName=host[2-3] Name=gpu File=$folder/slurm/gpu[0-7]" >"$folder/slurm/gres.conf"
    for k in 1 2 3; do
        boot $k
        on $k mount --bind "$folder/slurm" /etc/slurm
        on $k mkdir /run/munge
        on $k munged --force --key-file="$folder/slurm/munge.key" --seed-file=/run/munge/seed \
            --log-file="$folder/slurm/munge$k.log" 2>>"$folder/slurm/munge.log"
        on $k "$([ $k -eq 1 ] && echo slurmctld || echo slurmd)"
    done
    until [ "$(on 1 sinfo -h -t idle -o %D)" = 2 ]; do sleep 0.5; done
}

# batch SCRIPT [OPTIONS]: submits a job script, in FOLDER; prints the number of the job.
batch() {
    local script=$1
    shift
    on 1 env -C "$folder" PATH="$folder/bin:$PATH" OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 \
        sbatch --parsable "$@" "$script"
}

jobs_end() {
    while [ -n "$(on 1 squeue -h)" ]; do sleep 1; done
}

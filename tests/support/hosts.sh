#!/usr/bin/env bash
# hosts.sh FOLDER TEXT: runs TEXT, a bash script that makes hosts on this machine by the functions below. Each has an
# address, a name, processes, an sshd, a home, a /dev/shm and a /mnt of its own, and shares the other folders. All is in
# namespaces, which end with this process, however it ends; so nothing but FOLDER is left. Exits with 77 and the reason
# where that is impossible. FOLDER/K/home is the home of host K, from 1; `limax` is the executable.
set -euo pipefail

skip() {
    echo "skipped: $*" >&2
    exit 77
}

# The first process of host $1: the kernel ends the host with it.
host() {
    hostname "host$1"
    mount --bind "$folder/$1/home" /root
    mount --bind "$folder/hosts" /etc/hosts
    mount -t tmpfs tmpfs /dev/shm
    mount -t tmpfs tmpfs /run
    mount -t tmpfs tmpfs /mnt
    mkdir /run/sshd
    ip link set lo up
    until ip address add "10.77.0.$1/24" dev eth0 2>/dev/null; do sleep 0.02; done
    ip link set eth0 up
    exec /usr/sbin/sshd -D -f "$folder/$1/sshd_config" -E "$folder/$1/sshd.log"
}

# boot K [OFFSET]: starts host K; its clock differs by OFFSET, as faketime takes it: +1h.
boot() {
    local k=$1 words="\"TMPDIR=$folder/$1/tmp\" LIMAX_THREADS=1" name
    for name in LD_LIBRARY_PATH LIMAX_HOME; do [ -z "${!name:-}" ] || words+=" \"$name=${!name}\""; done
    if [ -n "${2:-}" ]; then
        name=$(echo /usr/lib/*/faketime/libfaketimeMT.so.1)
        [ -f "$name" ] || skip "there is no libfaketime here (on Debian: apt-get install libfaketime)"
        words+=" LD_PRELOAD=$name FAKETIME=$2 FAKETIME_DONT_FAKE_MONOTONIC=1"
    fi
    mkdir -p "$folder/$k/home/.ssh" "$folder/$k/tmp"
    cp "$folder/key" "$folder/known_hosts" "$folder/$k/home/.ssh"
    echo "IdentityFile ~/.ssh/key
UserKnownHostsFile ~/.ssh/known_hosts" >"$folder/$k/home/.ssh/config"
    echo "HostKey $folder/host_key
AuthorizedKeysFile $folder/key.pub
StrictModes no
PasswordAuthentication no
PidFile none
SetEnv $words" >"$folder/$k/sshd_config"
    unshare --net --mount --uts --ipc --pid --fork --kill-child --mount-proc bash "$0" host "$folder" "$k" 2>/dev/null &
    until first[k]=$(cat "/proc/$!/task/$!/children") && [ -n "${first[k]}" ]; do sleep 0.02; done
    first[k]=${first[k]% }
    until ip link add "port$k" master switch type veth peer name eth0 address "02:00:00:00:00:0$k" \
        netns "${first[k]}" 2>/dev/null; do
        kill -0 $!
        sleep 0.02
    done
    ip link set "port$k" up
    until (: >"/dev/tcp/10.77.0.$k/22") 2>/dev/null; do
        kill -0 $!
        sleep 0.02
    done
}

# on K COMMAND...: runs it in a session of host K, in its home.
on() {
    local k=$1
    shift
    nsenter -t "${first[k]}" -a env -C /root ssh -n "host$k" "$(printf '%q ' "$@")"
}

# ranks K... ARGUMENTS: limax with a rank on each of these hosts; mpirun is on host 1.
ranks() {
    local list="" count=0
    while [[ ${1:-} =~ ^[1-9]$ ]]; do
        list+=,host$1
        count=$((count + 1))
        shift
    done
    on 1 mpirun --allow-run-as-root -n $count --host "${list#,}" --map-by node --oversubscribe \
        --mca btl tcp,self --mca oob tcp --bind-to none --mca oob_tcp_keepalive_time 2 \
        --mca oob_tcp_keepalive_intvl 1 --mca oob_tcp_keepalive_probes 4 "$limax" "$@"
}

# cut K, join K: the switch drops all packets of host K, or forwards them again.
cut() { bridge link set dev "port$1" state 0; }
join() { bridge link set dev "port$1" state 3; }

# share: /mnt of all hosts is a folder that host 1 exports by NFS, with locks, which only mounts of it see.
share() {
    local k
    [ -x /usr/bin/ganesha.nfsd ] || skip "there is no NFS server here (on Debian: apt-get install nfs-ganesha-vfs nfs-common)"
    modprobe nfsv4 2>/dev/null || grep -qw nfs4 /proc/filesystems || skip "this kernel cannot mount NFS"
    echo "NFS_CORE_PARAM { Protocols = 4; Enable_NLM = false; Enable_RQUOTA = false; }
NFSv4 { Graceless = true; Lease_Lifetime = 30; RecoveryRoot = $folder/nfs-state; }
EXPORT { Export_Id = 1; Path = /run/export; Pseudo = /mnt; Access_Type = RW; Squash = None; SecType = sys; FSAL { Name = VFS; } }" \
        >"$folder/ganesha.conf"
    mkdir -p "$folder/nfs-state"
    on 1 mkdir /run/export
    on 1 ganesha.nfsd -f "$folder/ganesha.conf" -L "$folder/ganesha.log" -p "$folder/ganesha.pid"
    for k in "${!first[@]}"; do
        # timeo: the kernel does not wait long for the server once all hosts have ended
        until on "$k" mount -t nfs4 -o timeo=50,retrans=1 host1:/mnt /mnt 2>>"$folder/mount.log"; do
            sleep 0.5
        done
    done
}

# lose K: it loses its power. No packet says so to others.
lose() {
    cut "$1"
    kill -KILL "${first[$1]}"
}

if [ "$1" = host ]; then
    folder=$2
    host "$3"
elif [ "$1" = inside ]; then
    shift
    folder=$1 first=()
    trap 'exit 1' TERM
    ip link add switch type bridge
    ip address add 10.77.0.254/24 dev switch
    ip link set switch up
    ssh-keygen -q -t ed25519 -N '' -f "$folder/key"
    ssh-keygen -q -t ed25519 -N '' -f "$folder/host_key"
    echo "host* $(cat "$folder/host_key.pub")" >"$folder/known_hosts"
    echo "127.0.0.1 localhost" >"$folder/hosts"
    for k in {1..9}; do echo "10.77.0.$k host$k"; done >>"$folder/hosts"
    eval "$2"
else
    [ "$(id -u)" -eq 0 ] || skip "only root may make hosts"
    for tool in ip bridge ssh ssh-keygen /usr/sbin/sshd mpirun; do
        command -v $tool >/dev/null || skip "there is no $tool here (on Debian: apt-get install iproute2 openssh-server)"
    done
    unshare --net --mount --uts --ipc --pid --fork --mount-proc true 2>/dev/null || skip "namespaces are not allowed here"
    setpriv --pdeathsig KILL unshare --net --mount --pid --fork --kill-child --mount-proc bash "$0" inside "$@" &
    trap 'kill -KILL $! 2>/dev/null || :' EXIT
    trap 'exit 1' INT TERM
    wait $!
fi

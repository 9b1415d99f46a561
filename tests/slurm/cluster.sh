#!/usr/bin/env bash
# A Slurm cluster of virtual nodes on 127.0.0.1, all of it below one folder, for tests:
#   cluster.sh start FOLDER NODES      cluster.sh stop FOLDER
#   cluster.sh node FOLDER NODE        starts the slurmd of one
#   cluster.sh die FOLDER NODE         as if it were switched off
#   cluster.sh controller FOLDER       kills the controller and starts it again
# Only processes whose ids stand in the folder, and what they started, are ended. Debian's Slurm, as root.
set -eu
what=$1 folder=$2
export SLURM_CONF=$folder/slurm.conf

alive() { # a zombie that nobody has waited for is gone
  [ -e "/proc/$1/stat" ] && ! grep -q '^State:[[:space:]]*Z' "/proc/$1/status" 2>/dev/null
}

end() { # end PIDFILE...: TERM to all, KILL after 8 s
  local file pid
  for file; do [ ! -s "$file" ] || kill "$(cat "$file")" 2>/dev/null || true; done
  for file; do
    [ -s "$file" ] || continue
    pid=$(cat "$file" 2>/dev/null) || continue
    for _ in $(seq 80); do alive "$pid" || break; sleep 0.1; done
    ! alive "$pid" || kill -9 "$pid" 2>/dev/null || true
    rm -f "$file"
  done
}

below() { # a process and all that it started
  local child
  echo "$1"
  for child in $(cat /proc/"$1"/task/*/children 2>/dev/null); do below "$child"; done
}

steps() { # steps LOG: the slurmstepds that hold a file open whose name begins so, with all below them
  local process
  for process in /proc/[0-9]*; do
    [ "$(readlink "$process/exe" 2>/dev/null)" = "$(readlink -f "$(command -v slurmstepd-wlm)")" ] || continue
    ! ls -l "$process/fd" 2>/dev/null | grep -qF -- "-> $1" || below "${process#/proc/}"
  done
}

node() {
  mkdir -p "$folder/spool/$1"
  slurmd-wlm -N "$1" -f "$SLURM_CONF" -d "$(command -v slurmstepd-wlm)" 2>>"$folder/start.err"
}

write_conf() { # write_conf NODES PORT
  local host i
  host=$(hostname -s)
  cat >"$SLURM_CONF" <<CONF
ClusterName=lodestone
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$2
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$folder/munge/sock,cred_expire=5
CredType=cred/munge
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool/%n
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/%n.pid
SlurmctldLogFile=$folder/log/slurmctld.log
SlurmdLogFile=$folder/log/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SchedulerParameters=sched_interval=2,bf_interval=2,batch_sched_delay=0
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SlurmdParameters=config_overrides
ReturnToService=2
SlurmctldTimeout=10
SlurmdTimeout=10
KillWait=2
MessageTimeout=5
TCPTimeout=2
MinJobAge=3600
PropagateResourceLimits=NONE
PropagatePrioProcess=1
CONF
  for i in $(seq "$1"); do
    echo "NodeName=n$i NodeHostname=$host NodeAddr=127.0.0.1 Port=$(($2 + i)) CPUs=1 RealMemory=4000"
  done >>"$SLURM_CONF"
  echo "PartitionName=bake Nodes=ALL Default=YES MaxTime=INFINITE State=UP" >>"$SLURM_CONF"
}

start() { # start NODES
  mkdir -p "$folder"/{state,log,spool,munge}
  chmod 755 "$folder" "$folder/munge" # munged refuses a socket in a folder that others cannot enter
  (umask 077; head -c 1024 /dev/urandom >"$folder/munge/key")
  munged --key-file="$folder/munge/key" --socket="$folder/munge/sock" --pid-file="$folder/munge/pid" \
    --log-file="$folder/munge/log" --seed-file="$folder/munge/seed" --num-threads=2
  write_conf "$1" $((20000 + $$ % 400 * 25))
  : >"$folder/cgroup.conf" # nothing of cgroups is used
  slurmctld-wlm -f "$SLURM_CONF" 2>>"$folder/start.err"
  local i
  for i in $(seq "$1"); do node "n$i"; done
  for _ in $(seq 200); do
    [ "$(sinfo -h -N -t idle -o %N 2>/dev/null | wc -l)" != "$1" ] || return 0
    sleep 0.1
  done
  echo "nodes are not idle after 20 s" >&2
  sinfo -N -l >&2
  return 1
}

die() { # die NODE: with all that runs there; its spool goes, as where a node boots anew
  local all
  all=$(cat "$folder/$1.pid")
  rm -f "$folder/$1.pid"
  kill -9 "$all" 2>/dev/null || true
  all=$(steps "$folder/log/$1.log")
  [ -z "$all" ] || kill -9 $all 2>/dev/null || true
  rm -rf "$folder/spool/$1"
}

controller() {
  local pid
  pid=$(cat "$folder/slurmctld.pid")
  kill -9 "$pid"
  while alive "$pid"; do sleep 0.1; done
  rm -f "$folder/slurmctld.pid"
  slurmctld-wlm -f "$SLURM_CONF" 2>>"$folder/start.err"
}

stop() {
  [ -s "$SLURM_CONF" ] || return 0
  scancel -u root 2>/dev/null || true
  for _ in $(seq 30); do [ -n "$(squeue -h 2>/dev/null)" ] || break; sleep 0.1; done
  end "$folder"/slurmctld.pid "$folder"/n*.pid
  end "$folder/munge/pid"
  local left
  left=$(steps "$folder/log/") # jobs that have outlived their slurmd
  [ -z "$left" ] || kill -9 $left 2>/dev/null || true
}

shift 2
"$what" "$@"

#!/usr/bin/env bash
#SBATCH --job-name=etc-engine
#SBATCH --nodes=1
#SBATCH --ntasks-per-node=32
#SBATCH --cpus-per-task=1
#SBATCH --time=04:00:00
#SBATCH --signal=TERM@120
#SBATCH --requeue
#SBATCH --open-mode=append
# A study as a Slurm job:  sbatch [--nodes=N] jobs/slurm.sh studies/NAME/study.toml out.nc
#
# Two minutes before the time limit every rank gets SIGTERM, keeps what is finished and ends with status 75;
# the job then queues itself again and continues. A node that fails, or a preemption, does the same.
set -uo pipefail

study=${1:?usage: sbatch jobs/slurm.sh STUDY.toml OUTPUT.nc}
output=${2:?usage: sbatch jobs/slurm.sh STUDY.toml OUTPUT.nc}
read -r -a launcher <<<"${ETC_LAUNCHER:-srun --kill-on-bad-exit=1}"

"${launcher[@]}" etc-engine sweep "$study" -o "$output" --resume
status=$?

if [ "$status" -eq 75 ] && [ "${SLURM_RESTART_COUNT:-0}" -lt "${ETC_MAX_RESTARTS:-50}" ]; then
    echo "stopped early: queueing job $SLURM_JOB_ID again"
    scontrol requeue "$SLURM_JOB_ID" && exit 0
fi
exit "$status"

#!/usr/bin/env bash
#SBATCH --job-name=etc-engine
#SBATCH --ntasks=32
#SBATCH --cpus-per-task=1
#SBATCH --time=04:00:00
#SBATCH --signal=TERM@120
#SBATCH --requeue
#SBATCH --open-mode=append
# A study as a Slurm job:  sbatch [--ntasks=RANKS] jobs/slurm.sh studies/NAME/study.toml out.nc
#
# Two minutes before the time limit every rank gets SIGTERM, keeps what is finished and ends with status 75. The
# job then queues itself again and continues; so it does when ranks were killed. Slurm itself queues it again after
# the failure of a node and after a preemption.
#
# A third argument names a file for the exit status of the sweep, for a program that waits for the job.
#
# In a job array (sbatch --array=1-8 ...) each job computes its part of the units: see jobs/slurm_array.sh.
set -uo pipefail

study=${1:?usage: sbatch jobs/slurm.sh STUDY.toml OUTPUT.nc}
output=${2:?usage: sbatch jobs/slurm.sh STUDY.toml OUTPUT.nc}
restart=${SLURM_RESTART_COUNT:-0}
ended=${3:-}
if [ -n "$ended" ]; then
    rm -f "$ended"
    trap 'echo $? >"$ended.new" && mv "$ended.new" "$ended"' EXIT
fi
read -r -a launcher <<<"${ETC_LAUNCHER:-srun --kill-on-bad-exit=1}"
part=()
folder=$output.shards
if [ -n "${SLURM_ARRAY_TASK_COUNT:-}" ]; then
    number=$(((SLURM_ARRAY_TASK_ID - SLURM_ARRAY_TASK_MIN) / ${SLURM_ARRAY_TASK_STEP:-1} + 1))
    part=(--part "$number/$SLURM_ARRAY_TASK_COUNT")
    folder=$output.part-$number-of-$SLURM_ARRAY_TASK_COUNT.shards
fi

# Killed ranks leave shared memory that is named after job and step, and MPI_Init of the same step then fails on that
# node. A requeued job would count its steps from 0 again: use up the numbers of the earlier starts.
for ((step = 0; step < restart; step++)); do
    srun --nodes=1 --ntasks=1 true
done

runs() { find "$folder" -name '*.run' 2>/dev/null | wc -l; }
before=$(runs)

"${launcher[@]}" etc-engine sweep "$study" -o "$output" --resume "${part[@]}"
status=$?

case $status in
75) why="stopped early" ;;
9 | 15 | 12[89] | 1[3-9][0-9]) why="ranks were killed (status $status)" ;; # 128 + signal; mpiexec: the signal alone
*) exit "$status" ;;
esac
most=${ETC_MAX_RESTARTS:-50}
if [ "$status" -ne 75 ] && [ "$(runs)" -eq "$before" ] && [ "$most" -gt 5 ]; then
    most=5 # they did not come as far as beginning: MPI cannot start, say
fi
if [ "$restart" -lt "$most" ]; then
    echo "$why: queueing job $SLURM_JOB_ID again"
    scontrol requeue "$SLURM_JOB_ID" && exit 0
fi
exit "$status"

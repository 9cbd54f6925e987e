#!/usr/bin/env bash
#PBS -N etc-engine
#PBS -l select=1:ncpus=32:mpiprocs=32
#PBS -l walltime=04:00:00
#PBS -r y
#PBS -j oe
# A study as a PBS job:  qsub -v STUDY=studies/NAME/study.toml,OUTPUT=out.nc jobs/pbs.sh
#
# PBS leaves a job a few seconds at its time limit, so the ranks get SIGTERM from here, two minutes earlier
# (ETC_SECONDS, to be set with another walltime). They keep what is finished and end with status 75; the
# script then submits itself again and continues.
set -uo pipefail

cd "${PBS_O_WORKDIR:-.}" || exit 2
study=${STUDY:?usage: qsub -v STUDY=STUDY.toml,OUTPUT=OUTPUT.nc jobs/pbs.sh}
output=${OUTPUT:?usage: qsub -v STUDY=STUDY.toml,OUTPUT=OUTPUT.nc jobs/pbs.sh}
seconds=${ETC_SECONDS:-$((4 * 3600 - 120))}
restart=${ETC_RESTART:-0}
read -r -a launcher <<<"${ETC_LAUNCHER:-mpiexec}"

timeout --signal=TERM --kill-after=100 --preserve-status "$seconds" \
    "${launcher[@]}" etc-engine sweep "$study" -o "$output" --resume
status=$?

if [ "$status" -eq 75 ] && [ "$restart" -lt "${ETC_MAX_RESTARTS:-50}" ]; then
    echo "stopped early: submitting again"
    qsub -v "STUDY=$study,OUTPUT=$output,ETC_SECONDS=$seconds,ETC_RESTART=$((restart + 1))" \
        "${ETC_SCRIPT:-jobs/pbs.sh}" && exit 0
fi
exit "$status"

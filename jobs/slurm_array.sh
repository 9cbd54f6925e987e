#!/usr/bin/env bash
# A study as an array of Slurm jobs that start whenever there is room, and one job that joins what they have computed:
#
#   jobs/slurm_array.sh studies/NAME/study.toml out.nc JOBS [options of sbatch, such as --ntasks=8 --time=1:00:00]
#
# Each job computes every JOBS-th unit, that is its range of realizations and densities. The joining job is an ordinary
# run of the study: it takes up the units of all parts, computes what is missing, and writes out.nc.
set -euo pipefail

study=${1:?usage: jobs/slurm_array.sh STUDY.toml OUTPUT.nc JOBS [OPTIONS]}
output=${2:?usage: jobs/slurm_array.sh STUDY.toml OUTPUT.nc JOBS [OPTIONS]}
jobs=${3:?usage: jobs/slurm_array.sh STUDY.toml OUTPUT.nc JOBS [OPTIONS]}
shift 3
script=$(dirname "$0")/slurm.sh

array=$(sbatch --parsable --array="1-$jobs" "$@" "$script" "$study" "$output")
join=$(sbatch --parsable --dependency="afterany:${array%%;*}" "$@" "$script" "$study" "$output")
echo "jobs ${array%%;*} (array of $jobs) and ${join%%;*} (joins them)"

#!/usr/bin/env bash
# A study on this machine, one rank a core:  jobs/local.sh studies/NAME/study.toml out.nc [RANKS]
#
# Run it again to continue after an interruption.
set -euo pipefail

study=${1:?usage: jobs/local.sh STUDY.toml OUTPUT.nc [RANKS]}
output=${2:?usage: jobs/local.sh STUDY.toml OUTPUT.nc [RANKS]}
ranks=${3:-$(getconf _NPROCESSORS_ONLN)}
read -r -a launcher <<<"${ETC_LAUNCHER:-mpirun -n $ranks}"

exec "${launcher[@]}" etc-engine sweep "$study" -o "$output" --resume

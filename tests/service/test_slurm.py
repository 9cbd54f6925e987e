"""The launcher of Slurm with a queue that stands in for the real one of ``tests/cluster``, for machines without it."""

from __future__ import annotations

import os
import sqlite3
import sys
from pathlib import Path

import pytest
from serving import STUDY, Service, renamed, until

from etc_engine.service import client
from etc_engine.sweep.result_file import open_dataset

SLOW_ENGINE = Path(__file__).with_name("slow_engine.py")
SBATCH = """echo "sbatch $*" >> "$SITE/calls"
[ -e "$SITE/closed" ] && { echo 'sbatch: error: QOSMaxSubmitJobPerUserLimit' >&2; exit 1; }
n=$(( $(cat "$SITE/last" 2>/dev/null || echo 100) + 1 )); echo $n > "$SITE/last"
while case "$1" in --*) true;; *) false;; esac; do
    case "$1" in --job-name=*) name=${1#*=};; --output=*) out=${1#*=};; --chdir=*) dir=${1#*=};; esac
    shift
done
run() {
    cd "$dir" || exit
    SLURM_JOB_ID=$n setsid bash "$@" >> "$out" 2>&1 &
    echo "$! $name $dir" > "$SITE/job.$n"
    wait $!
    rm -f "$SITE/job.$n"
}
run "$@" >/dev/null 2>&1 &
echo "$n;cluster"
"""
SQUEUE = """for word; do case "$word" in --jobs=*) job=${word#*=};; --name=*) name=${word#*=};; esac; done
[ -e "$SITE/down" ] && { echo 'slurm_load_jobs error: Unable to contact slurm controller' >&2; exit 1; }
if [ -n "$job" ]; then
    [ -e "$SITE/held.$job" ] && echo "PENDING $(cat "$SITE/held.$job")" && exit
    [ -e "$SITE/job.$job" ] && echo RUNNING None && exit
    echo 'slurm_load_jobs error: Invalid job id specified' >&2; exit 1
fi
for file in "$SITE"/job.*; do
    [ -e "$file" ] && read -r pid found dir < "$file" && [ "$found" = "$name" ] && echo "${file##*.} $dir"
done
exit 0
"""
SCANCEL = """echo "scancel $*" >> "$SITE/calls"
read -r pid rest < "$SITE/job.$1" && kill -- "-$pid"
rm -f "$SITE/held.$1" "$SITE/job.$1"
"""


@pytest.fixture
def site(tmp_path):
    """A cluster of one machine: its commands first on the PATH."""
    programs = tmp_path / "bin"
    programs.mkdir()
    engine = f'exec {sys.executable} {SLOW_ENGINE} "$@"\n'
    launcher = 'while [ "$1" != etc-engine ]; do shift; done\nshift\nexec etc-engine "$@"\n'
    commands = {"sbatch": SBATCH, "squeue": SQUEUE, "scancel": SCANCEL, "srun": launcher, "scontrol": "exit 1\n"}
    for name, text in {**commands, "etc-engine": engine}.items():
        (programs / name).write_text("#!/bin/bash\n" + text)
        (programs / name).chmod(0o755)
    return tmp_path


def cluster(site: Path, seconds: str = "0") -> Service:
    environment = {"SITE": str(site), "PATH": f"{site / 'bin'}:{os.environ['PATH']}", "ETC_TEST_SECONDS": seconds}
    environment["ETC_LAUNCHER"] = f"env PATH={environment['PATH']} srun"
    options = {"launcher": "slurm", "ranks": 3, "sbatch": ["--partition=short"], "squeue_seconds": 0.2}
    return Service(site / "data", options, environment)


def calls(site: Path, name: str) -> list[str]:
    return [line for line in (site / "calls").read_text().splitlines() if line.startswith(name)]


def test_a_study_goes_through_sbatch_with_the_script_of_jobs(site):
    with cluster(site) as service:
        study = client.submit(service.server, STUDY)["id"]
        ended = client.wait(service.server, study, interval=0.1)
        assert (ended["state"], ended["done"]) == ("done", 6), ended
        folder = service.data / "studies" / study
    assert (folder / "slurm.sh").read_bytes() == (Path(__file__).parents[2] / "jobs" / "slurm.sh").read_bytes()
    (call,) = calls(site, "sbatch")
    for word in (
        "--parsable",
        "--ntasks=3",
        f"--job-name=etc-engine-{study}",
        f"--chdir={folder}",
        "--partition=short",
    ):
        assert word in call.split()
    assert call.endswith(f"{folder}/slurm.sh {folder}/study.toml {folder}/result.nc {folder}/status")
    assert open_dataset(folder / "result.nc").sizes["realization"] == 3


def test_a_job_outlives_the_service_and_is_found_by_its_name(site):
    service = cluster(site, "0.7")
    with service:
        study = client.submit(service.server, STUDY)["id"]
        until(lambda: client.status(service.server, study)["done"] >= 1)
    base = sqlite3.connect(service.data / "queue.sqlite")
    base.execute("UPDATE studies SET batch = ''")  # as if it had been killed before it could note the number
    base.commit()
    base.close()
    with service:
        assert client.wait(service.server, study, interval=0.1)["state"] == "done"
    assert len(calls(site, "sbatch")) == 1


def test_a_silent_controller_is_waited_for_and_a_refusal_is_told(site):
    with cluster(site, "0.6") as service:
        study = client.submit(service.server, STUDY)["id"]
        until((site / "calls").exists)  # "running" comes before sbatch, which an absent controller prevents
        (site / "down").touch()
        until((service.data / "studies" / study / "result.nc").exists)
        assert client.status(service.server, study)["state"] == "running"
        (site / "down").unlink()
        assert client.wait(service.server, study, interval=0.1)["state"] == "done"
        (site / "closed").touch()
        refused = client.submit(service.server, renamed("refused"))["id"]
        ended = client.wait(service.server, refused, interval=0.1)
        assert ended["state"] == "failed"
        assert "QOSMaxSubmitJobPerUserLimit" in ended["reason"]


def test_a_job_that_slurm_holds_is_cancelled_and_submitted_again(site):
    """A node that still knows the job cannot launch it: Slurm holds it, and it would wait for ever."""
    (site / "held.101").write_text("launch failed requeued held")
    with cluster(site) as service:
        study = client.submit(service.server, STUDY)["id"]
        ended = client.wait(service.server, study, interval=0.1)
        assert (ended["state"], ended["done"]) == ("done", 6), ended
    assert calls(site, "scancel") == ["scancel 101"]


def test_a_study_whose_jobs_are_all_held_fails_with_the_reason(site):
    for job in range(101, 110):
        (site / f"held.{job}").write_text("launch failed requeued held")
    (site / "bin" / "etc-engine").write_text("#!/bin/sh\nsleep 1000\n")
    with cluster(site) as service:
        study = client.submit(service.server, STUDY)["id"]
        ended = client.wait(service.server, study, interval=0.1)
    assert (ended["state"], ended["reason"]) == ("failed", "Slurm holds its job: launch failed requeued held"), ended
    assert len(calls(site, "sbatch")) == 3


def test_a_job_that_its_user_holds_is_left_alone(site):
    (site / "held.101").write_text("JobHeldUser")
    with cluster(site, "0.3") as service:
        study = client.submit(service.server, STUDY)["id"]
        until((service.data / "studies" / study / "result.nc").exists)
        assert client.status(service.server, study)["state"] == "running"
        (site / "held.101").unlink()
        assert client.wait(service.server, study, interval=0.1)["state"] == "done"
    assert len(calls(site, "sbatch")) == 1


@pytest.mark.parametrize(("status", "starts"), [(2, 1), (1, 3)])
def test_only_what_is_refused_is_not_tried_again(site, status, starts):
    """Status 2 is the fault of the study; of another one nobody knows."""
    (site / "bin" / "etc-engine").write_text(f"#!/bin/sh\necho 'etc-engine: no such bed'\nexit {status}\n")
    with cluster(site) as service:
        study = client.submit(service.server, STUDY)["id"]
        ended = client.wait(service.server, study, interval=0.1)
        assert (ended["state"], ended["reason"]) == ("failed", "no such bed"), ended
    assert len(calls(site, "sbatch")) == starts

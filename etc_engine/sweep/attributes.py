"""Global attributes of the result of a sweep: where it comes from and how to make it again."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from etc_engine.durable.provenance import Run, engine_version, now, versions
from etc_engine.study.sweep import Study


def global_attributes(study: Study, text: str, runs: Sequence[Run], hosts: Sequence[str]) -> dict[str, Any]:
    """Global attributes of the result of a sweep."""
    ended = now()
    return {
        "Conventions": "CF-1.11",
        "title": f"{study.name}: effective thermal conductivity over random realizations",
        "source": f"etc_engine {engine_version()}, engine {study.conduction.engine}",
        "history": f"{ended} {runs[-1].command}",
        "study": text,
        "study_resolved": json.dumps(study.resolved()),
        "study_digest": study.digest(),
        "seed": np.int64(study.seed),
        "confidence_level": study.statistics.confidence,
        "versions": json.dumps(versions()),
        "commit": runs[-1].commit,
        "command": runs[-1].command,
        "hosts": ", ".join(sorted(set(hosts))),
        "runs": json.dumps([asdict(run) for run in runs]),
        "started": runs[0].started,
        "ended": ended,
    }

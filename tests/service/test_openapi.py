"""The OpenAPI description, and a stranger (schemathesis) who tries everything that it allows and forbids."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib.util import find_spec

import pytest
from serving import STUDY, ask

from etc_engine.service import client

CHECKS = "not_a_server_error,content_type_conformance,response_schema_conformance"
EXAMPLES = int(os.environ.get("ETC_FUZZ", "0"))
"""With ETC_FUZZ=60 the stranger takes his time: more phases, so many examples of each operation."""
RUNS = {
    "everything": ["--exclude-path", "/api/solve", "--max-examples", str(EXAMPLES or 8)],
    "solve": ["--include-path", "/api/solve", "--max-examples", str(EXAMPLES or 3)],
}
PHASES = ["--phases", "coverage,fuzzing,stateful" if EXAMPLES else "fuzzing"]


def test_every_operation_is_described(service):
    description = json.loads(ask(f"{service.url}/openapi.json")[2])
    operations = [operation for path in description["paths"].values() for operation in path.values()]
    assert len(operations) == 18
    for operation in operations:
        assert operation["description"]
        refusals = {status for status in operation["responses"] if status.startswith("4")}
        assert {"401", "403", "404", "413", "422"} <= refusals
        for status in refusals:
            schema = operation["responses"][status]["content"]["application/json"]["schema"]
            assert schema == {"$ref": "#/components/schemas/Problem"}


def test_the_examples_are_good(service):
    """The same study twice, and a solve with its option."""
    description = json.loads(ask(f"{service.url}/openapi.json")[2])
    paths = description["paths"]
    study = paths["/api/studies"]["post"]["requestBody"]["content"]
    solve = paths["/api/solve"]["post"]
    checked = [
        ask(f"{service.url}/api/studies/check", "POST", body, content_type=kind)
        for kind, body in (
            ("application/toml", study["application/toml"]["example"].encode()),
            ("application/json", json.dumps(study["application/json"]["example"]).encode()),
        )
    ]
    assert [status for status, _, _ in checked] == [200, 200]
    assert len({json.loads(body)["id"] for _, _, body in checked}) == 1
    box = next(item for item in solve["parameters"] if item["name"] == "box")["schema"]["examples"][0]
    particles = solve["requestBody"]["content"]["text/csv"]["example"].encode()
    assert client.solve(service.server, particles, box=box)["percolates"]


@pytest.mark.slow
@pytest.mark.skipif(find_spec("schemathesis") is None, reason="needs schemathesis, which .ci/run installs")
@pytest.mark.parametrize("run", RUNS)
def test_no_request_makes_the_service_stumble(service, tmp_path, run):
    study = client.submit(service.server, STUDY)["id"]
    client.wait(service.server, study, interval=0.05)
    (tmp_path / "schemathesis.toml").write_text(f'[parameters]\n"path.study" = ["{study}", "0123456789abcdef", "x"]\n')
    line = [sys.executable, "-m", "schemathesis.cli", "--config-file", str(tmp_path / "schemathesis.toml"), "run"]
    line += [f"{service.url}/openapi.json", "--checks", CHECKS, "--no-color", *RUNS[run], *PHASES]
    done = subprocess.run(
        line, capture_output=True, text=True, check=False, cwd=tmp_path, timeout=280 if not EXAMPLES else None
    )
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]
    assert "Test cases:" in done.stdout
    print(done.stdout[-1500:])
    assert "Traceback" not in service.said()

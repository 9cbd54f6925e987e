from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

pytest.importorskip("fastapi", reason="the service needs the extra 'service'")
pytest.importorskip("uvicorn", reason="the service needs the extra 'service'")


@pytest.fixture(scope="session")
def service(tmp_path_factory):
    """A service whose units take no time, shared by the tests."""
    from serving import Service

    with Service(tmp_path_factory.mktemp("service") / "data", slow=True) as running:
        yield running

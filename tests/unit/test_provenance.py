"""The commit of an installation from a local clone, as pip records it in direct_url.json."""

from __future__ import annotations

import json
import shutil
import subprocess
from types import SimpleNamespace

import pytest

from etc_engine.durable import provenance


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """A clone with one commit, and an installation of it; returns the clone and its commit."""
    clone, site = tmp_path / "a clone", tmp_path / "site"
    (clone / "etc_engine" / "durable").mkdir(parents=True)
    (clone / "etc_engine" / "durable" / "provenance.py").write_text("one\n")
    git = ["git", "-C", clone, "-c", "user.name=a", "-c", "user.email=a@b"]
    for words in (["init", "-q"], ["add", "."], ["commit", "-q", "-m", "one"]):
        subprocess.run([*git, *words], check=True)
    commit = subprocess.run([*git, "rev-parse", "HEAD"], check=True, capture_output=True, text=True).stdout.strip()
    shutil.copytree(clone / "etc_engine", site / "etc_engine")
    address = json.dumps({"url": clone.as_uri(), "dir_info": {}})
    monkeypatch.setattr(provenance, "__file__", str(site / "etc_engine" / "durable" / "provenance.py"))
    monkeypatch.setattr(provenance, "distribution", lambda _: SimpleNamespace(read_text=lambda _: address))
    return clone, commit


def test_an_installation_from_a_clone_has_the_commit_of_the_clone(installed):
    clone, commit = installed
    assert provenance.engine_commit() == commit
    (clone / "notes.txt").write_text("two")
    subprocess.run(["git", "-C", clone, "add", "."], check=True)
    assert provenance.engine_commit() == f"{commit}-dirty"


def test_a_clone_that_has_changed_since_is_not_named(installed):
    clone, _ = installed
    (clone / "etc_engine" / "durable" / "provenance.py").write_text("two\n")
    assert provenance.engine_commit() == f"unknown ({clone} has changed since it was installed)"
    shutil.rmtree(clone)
    assert provenance.engine_commit() == "unknown"


def test_an_installation_from_an_address_has_its_commit(installed, monkeypatch):
    text = json.dumps({"url": "https://host/etc_engine.git", "vcs_info": {"vcs": "git", "commit_id": "abc"}})
    monkeypatch.setattr(provenance, "distribution", lambda _: SimpleNamespace(read_text=lambda _: text))
    assert provenance.engine_commit() == "abc"

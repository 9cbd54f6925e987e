"""``keys``: the table of study keys, and the study errors that point to it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from etc_engine.errors import StudyError
from etc_engine.study.files import validated
from etc_engine.study.reference import KINDS, key_rows

ROOT = Path(__file__).parents[2]


def test_every_key_of_the_guide_is_printed(etc_engine):
    text = (ROOT / "studies" / "README.md").read_text()
    table = text[text.index("## Study files") : text.index("**A transient**")]
    guide = set(re.findall(r"^\| `([a-z]+\.[a-z_]+)`", table, re.M))
    made = {row["key"] for row in json.loads(etc_engine("keys", "--json").stdout)["keys"]}
    of_files = {row["key"] for row in json.loads(etc_engine("keys", "--study", "files", "--json").stdout)["keys"]}
    assert guide <= made | of_files
    assert len(guide) > 50


def test_a_section_shows_unit_default_and_words(etc_engine):
    shown = etc_engine("keys", "contacts").stdout
    assert "contacts.contact_angle" in shown
    assert re.search(r"contacts\.contact_angle +contact half-angle: .*\[degree\]", shown)
    assert "packing.box" not in shown
    assert re.search(r"statistics\.confidence .*\(default 0\.95\)", etc_engine("keys", "statistics").stdout)
    assert "time.steps" in etc_engine("keys", "time", "--study", "transient").stdout


@pytest.mark.parametrize(
    ("words", "message"),
    [(("contact",), "did you mean 'contacts'?"), (("contacts", "--study", "x"), "there are: sweep, files, transient")],
)
def test_unknown_words_are_refused(etc_engine, words, message):
    done = etc_engine("keys", *words)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert message in done.stderr


@pytest.mark.parametrize("kind", KINDS)
def test_an_error_names_a_command_that_works(etc_engine, kind):
    section = {"meshless": "output"}.get(kind, "conduction")
    with pytest.raises(StudyError) as caught:
        validated({"schema": 2, section: {"nonsense": 1}}, KINDS[kind])
    found = re.search(rf"see: etc-engine (keys {section}.*)", str(caught.value))
    assert found, caught.value
    done = etc_engine(*found[1].split())
    assert done.returncode == 0
    assert all(row.key in done.stdout for row in key_rows(kind, section))

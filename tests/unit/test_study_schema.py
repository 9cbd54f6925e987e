"""The JSON schema of a study: complete, documented, and enough for a form."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from etc_engine.study.file_packings import FilesTable
from etc_engine.study.meaning import MEANING
from etc_engine.study.quantities import QUANTITIES, value_of
from etc_engine.study.sweep import EXAMPLE, Study, study_schema

ROOT = Path(__file__).parents[2]
NODE = shutil.which("node")


def places() -> set[str]:
    schema = study_schema()
    found = set()
    for table, node in schema["properties"].items():
        if "$ref" in node:
            keys = schema["$defs"][node["$ref"].rpartition("/")[2]].get("properties", {})
            found |= {f"{table}.{key}" for key in keys}
    return found


def test_every_quantity_is_a_key_and_every_meaning_is_of_a_key():
    assert {row.place for row in QUANTITIES.values() if row.table.count(".") == 0} <= places()
    assert set(MEANING) <= places()
    study = Study.model_validate(EXAMPLE)
    assert value_of(study, QUANTITIES["density"]) == (0.64, 0.70, 0.76)


def test_every_key_has_a_line_in_the_reference():
    text = (ROOT / "studies" / "README.md").read_text()
    table = text[text.index("## Study files") : text.index("**A transient**")]
    listed = set(re.findall(r"^\| `([a-z]+\.[a-z_]+)`", table, re.M))
    listed |= {f"conduction.{word}" for word in re.findall(r"^\| `conduction\.solver`, `(\w+)`", table, re.M)}
    of_files = {"particles.types", *(f"packing.{key}" for key in FilesTable.model_fields)}
    assert places() <= listed
    assert listed - places() <= of_files


def test_the_defaults_of_the_reference_are_those_of_the_schema():
    text = (ROOT / "studies" / "README.md").read_text()
    schema = study_schema()
    rows = re.findall(r"^\| `([a-z]+)\.([a-z_]+)` \| [^|]* \| ([^|]*) \|", text, re.M)
    checked = 0
    for table, key, default in rows:
        node = schema["$defs"][schema["properties"][table]["$ref"].rpartition("/")[2]]["properties"].get(key)
        if node is None:  # of packings in files
            continue
        word = default.strip().strip("`")
        if re.fullmatch(r"[\d.e-]+", word):
            assert float(word) == node["default"], (table, key)
            checked += 1
        elif word in ("needed", "none"):
            assert node.get("default") is None, (table, key)
            checked += 1
    assert checked > 15


@pytest.mark.skipif(NODE is None, reason="needs node to run the page's script")
def test_the_form_of_the_page_is_made_from_the_schema(tmp_path):
    (tmp_path / "schema.json").write_text(json.dumps(study_schema()))
    script = f"""
const form = require({json.dumps(str(ROOT / "etc_engine/service/page/form.js"))});
const schema = require({json.dumps(str(tmp_path / "schema.json"))});
const tables = form.tablesOf(schema), values = form.startOf(schema, tables);
const first = form.studyOf(schema, tables, values);
Object.assign(values, {{"packing.method": "lubachevsky-stillinger", "packing.count": "12", "packing.periodic": "xy",
  "packing.radii": "equal", "packing.density": "0.2",
  "conduction.engine": "voxel", "conduction.method": "laminate, binary",
  "particles.conductivity": "2, 10", "pores.conductivity": "1", "conduction.resolution": "40",
  "models.names": "maxwell"}});
const second = form.studyOf(schema, tables, values);
console.log(JSON.stringify([first, second, form.tomlOf(second)]));
"""
    done = subprocess.run([NODE, "-e", script], capture_output=True, text=True, check=True)
    first, second, text = json.loads(done.stdout)
    assert Study.model_validate(first) == Study.model_validate(EXAMPLE)
    study = Study.model_validate(second)
    assert study.axes == {"particle_conductivity": (2.0, 10.0)}
    assert study.methods == ("laminate", "binary")
    assert "contacts" not in second
    assert '[conduction]\nengine = "voxel"' in text

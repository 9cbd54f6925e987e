"""The queue and the admission of studies, without a server."""

from __future__ import annotations

import os
import sqlite3
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from etc_engine.errors import InputError, OutputError, StudyError
from etc_engine.service.admission import apply, expected_particles, field_of, study_id, toml_of
from etc_engine.service.processes import ProcessIdentity
from etc_engine.service.queue import Queue
from etc_engine.service.settings import Limits
from etc_engine.study.sweep import parse_study

STUDY = """schema = 2
name = "queued"
seed = 271828
[packing]
radii = "uniform:0.03:0.06"
box = [1.0, 1.0]
density = [0.55, 0.60]
[statistics]
realizations = 3
"""


@pytest.fixture
def queue(tmp_path):
    opened = Queue(tmp_path / "queue.sqlite", limit=3)
    yield opened
    opened.close()


def test_studies_leave_the_queue_in_the_order_they_came(queue):
    for name in ("a", "b", "c"):
        assert queue.submit(name, name, 4, 4)[1]
    assert queue.submit("b", "other name", 4, 4) == (queue.require("b"), False)
    with pytest.raises(InputError, match="3 studies are waiting"):
        queue.submit("d", "d", 4, 4)
    assert queue.first_waiting().id == "a"
    assert queue.first_waiting(frozenset({"a"})).id == "b"
    queue.begin("a")
    assert queue.first_waiting().id == "b"
    queue.cancel("b")
    queue.resume("b")
    assert queue.first_waiting().id == "c"  # what was taken out comes back at the end
    assert [entry.id for entry in queue.entries()] == ["c", "b", "a"]
    assert [entry.id for entry in queue.entries("queued", limit=1, offset=1)] == ["b"]


@pytest.mark.parametrize(
    "text",
    ["a{} = 1", "[a{}]", "x = {{ a{} = 1 }}", "'q'{} = 1", 'a = """\\""""\nb{} = 1'],
    ids=("key", "table", "inline", "quoted", "string"),
)
@pytest.mark.parametrize("part", [".a", " . a", ".'a b'", '."a"'])
def test_keys_of_many_parts_are_refused_before_they_are_parsed(text, part):
    """The parser needs 18 s and 4 GB for 32 000 parts."""
    with pytest.raises(StudyError, match="has a key of more than 8 parts"):
        apply(text.format(part * 10_000), Limits())


@pytest.mark.parametrize("text", ["name = 'a{}'", 'name = "a{}"', "# a{}", "name = '''\na{}'''", 'name = """\na{}"""'])
def test_dots_in_words_and_comments_are_no_parts_of_keys(text):
    with pytest.raises(StudyError) as caught:
        apply(text.format(".a" * 50), Limits())
    assert "parts" not in str(caught.value)


def test_a_long_key_is_cut_in_the_error():
    with pytest.raises(StudyError, match="unknown key") as caught:
        apply("[packing]\n" + "radi" * 16_000 + " = 1", Limits())
    assert len(str(caught.value)) < 400


def test_memory_is_told_in_the_unit_of_the_option():
    with pytest.raises(StudyError, match=r"this service allows 8192 MB$"):
        apply(STUDY.replace("box = [1.0, 1.0]", "box = [100000.0, 1.0]"), replace(Limits(), particles=10**9))


def test_progress_is_what_decides_about_another_attempt(queue):
    queue.submit("a", "a", 4, 4)
    for attempt in (1, 2):
        queue.begin("a")
        assert queue.require("a").attempts == attempt
        queue.put_back("a", "killed")
    queue.begin("a")
    queue.set_done("a", 2)
    assert queue.require("a").attempts == 0
    queue.set_done("a", 2)
    queue.put_back("a", "killed")
    assert (queue.require("a").state, queue.require("a").reason) == ("queued", "killed")


def test_only_what_makes_sense_is_done(queue):
    queue.submit("a", "a", 4, 4)
    assert not queue.resume("a")
    queue.begin("a")
    assert not queue.remove("a")
    assert queue.cancel("a")
    assert queue.require("a").cancelling
    queue.finish("a", 4, 1)
    assert not queue.cancel("a")
    assert (queue.require("a").state, queue.require("a").cancelling) == ("done", False)
    assert queue.remove("a")
    assert queue.get("a") is None


def test_the_queue_is_on_the_disk(queue, tmp_path):
    queue.submit("a", "a", 4, 4)
    second = Queue(tmp_path / "queue.sqlite")
    assert second.require("a").planned == 4
    second.close()
    (tmp_path / "queue.sqlite-wal").unlink(missing_ok=True)
    (tmp_path / "broken.sqlite").write_bytes(b"x" * 5000)
    with pytest.raises(OutputError, match="not a database"):
        Queue(tmp_path / "broken.sqlite")
    with pytest.raises(OutputError, match="unable to open"):
        Queue(tmp_path / "none" / "queue.sqlite")


def test_a_full_database_keeps_what_it_has(tmp_path):
    queue = Queue(tmp_path / "queue.sqlite")
    queue.submit("a", "a", 4, 4)
    queue._base.execute("PRAGMA max_page_count = 1")
    pages = queue._base.execute("PRAGMA page_count").fetchone()[0]
    queue._base.execute(f"PRAGMA max_page_count = {pages}")
    with pytest.raises(sqlite3.OperationalError, match="full"):
        queue.submit("b", "b" * 200_000, 4, 4)
    assert [entry.id for entry in queue.entries()] == ["a"]
    queue.close()


def test_the_same_study_has_the_same_identity_and_no_other():
    study = parse_study(STUDY)
    table = tomllib.loads(STUDY)
    again = parse_study(toml_of(dict(reversed(table.items()))) + "\n# a comment")
    assert study_id(study) == study_id(again)
    others = [("271828", "271829"), ("0.60", "0.61"), ("queued", "renamed"), ("realizations = 3", "realizations = 4")]
    found = {study_id(parse_study(STUDY.replace(*other))) for other in others}
    assert len(found | {study_id(study)}) == 5


def test_limits_are_met_before_anything_runs():
    found = apply(STUDY, Limits())
    assert (found.units, found.most, found.cells) == (6, 6, 6)
    for field, value in (("units", 5), ("cells", 5), ("particles", 50)):
        with pytest.raises(StudyError, match=f"this service allows {value}"):
            apply(STUDY, replace(Limits(), **{field: value}))
    with pytest.raises(
        StudyError, match=r"packing\.box: takes about 250 MB of memory per rank, this service allows 200"
    ):
        apply(STUDY, replace(Limits(), memory_bytes=200_000_000))
    adaptive = STUDY + "relative_ci = 0.01\nmax_realizations = 50\n"
    assert (apply(adaptive, Limits()).units, apply(adaptive, Limits()).most) == (6, 100)


def test_voxels_and_lattices_are_counted_too():
    composite = STUDY.replace("[packing]", '[packing]\nmethod = "lubachevsky-stillinger"\nperiodic = "xy"')
    composite = composite.replace("[0.55, 0.60]", "[0.3]").replace("uniform:0.03:0.06", "equal:0.05")
    composite += "[particles]\nconductivity = [2.0, 10.0]\n[pores]\nconductivity = 1.0\n"
    composite += '[conduction]\nengine = "voxel"\nresolution = {}\n'
    assert apply(composite.format(64), Limits()).cells == 6
    with pytest.raises(StudyError, match=r"conduction: takes about \d+ MB") as caught:
        apply(composite.format(10_000), Limits())
    assert field_of(str(caught.value)) == "conduction"


def test_expected_particles_are_box_over_particle():
    text = STUDY.replace("uniform:0.03:0.06", "equal:0.1").replace("[1.0, 1.0]", "[2.0, 3.0]")
    assert expected_particles(parse_study(text)) == pytest.approx(6.0 * 0.6 / (np.pi * 0.01), rel=1e-12)
    counted = text.replace("[packing]", '[packing]\nmethod = "random-sequential"\ncount = 77')
    assert expected_particles(parse_study(counted.replace("equal:0.1", "equal"))) == 77


@pytest.mark.parametrize(
    ("line", "field"),
    [
        ("study: seed: missing, expected a whole number", "seed"),
        ("study: packing.radius: unknown key, did you mean 'radii'? allowed: method, radii", "packing.radius"),
        ("study: packing.box: engine 'dtem' works in 2D, found (1.0, 1.0, 1.0)", "packing.box"),
        ("study: models: names: there is no model named 'x'; there are: a", "models.names"),
        ("study: conduction: method: found 'x', allowed with dtem: chord", "conduction.method"),
        ("study: contacts: rule = 'bonded' needs contact_angle, a list of half-angles in degrees", "contacts"),
        ("study: conduction.resolution: found 1, allowed: a whole number of at least 4", "conduction.resolution"),
        ("study: expected a JSON object, found list", ""),
    ],
)
def test_the_field_of_a_message(line, field):
    assert field_of(line) == field


texts = st.text(st.characters(exclude_categories=("Cs",)), max_size=8)
scalars = st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.floats(allow_nan=False) | texts
values = st.recursive(
    scalars, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(texts, inner, max_size=3), max_leaves=8
)


@given(st.dictionaries(texts, values, max_size=4))
def test_json_becomes_toml_with_the_same_values(study):
    assert tomllib.loads(toml_of(study)) == study


@given(st.dictionaries(st.text(max_size=5), values | st.none() | st.text(max_size=5), max_size=4))
def test_any_json_is_a_study_or_refused(study):
    with pytest.raises(StudyError):
        apply(toml_of(study), Limits())


@given(st.text(max_size=60), st.integers(0, len(STUDY)))
def test_any_text_is_a_study_or_refused(text, place):
    try:
        found = apply(STUDY[:place] + text + STUDY[place:], Limits())
    except StudyError as error:
        assert str(error).startswith("study: ")
    else:
        assert found.units >= 1


def test_a_process_is_known_by_more_than_its_number():
    me = ProcessIdentity.of(os.getpid())
    assert me.alive
    assert not replace(me, start="1").alive
    assert not replace(me, boot="another").alive
    assert not ProcessIdentity.of(2**22 + 1).alive

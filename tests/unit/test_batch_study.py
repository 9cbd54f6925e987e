"""The study file: defaults, conversion, and one clear line for every mistake."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from etc_engine.errors import StudyError
from etc_engine.study.sweep import parse_study, read_study

STUDY = """
schema = 2
name = "small"
seed = 20261
[packing]
radii = "uniform:0.01:0.02"
box = [1.0, 1.0]
density = [0.75, 0.65]
[contacts]
rule = "bonded"
contact_angle = [10.0, 2.5]
[statistics]
realizations = 3
"""


def test_defaults_and_order():
    study = parse_study(STUDY)
    assert study.densities == (0.65, 0.75)
    assert study.axes == {"contact_angle": (2.5, 10.0)}
    assert study.methods == ("chord",)
    assert study.statistics.cap == 3
    assert study.statistics.confidence == 0.95
    assert study.packing.method == "advancing-front"


def test_conversion_to_a_realization():
    spec = parse_study(STUDY).realization_spec(0.65)
    assert spec.packing.density == 0.65
    assert spec.packing.box.lengths == (1.0, 1.0)
    assert spec.rule == "bonded"
    assert spec.axes == {"contact_angle": (math.radians(2.5), math.radians(10.0))}
    assert spec.values["particle_conductivity"] == 1.0
    assert spec.shape == (2, 1)
    assert [one.method for one in spec.conduction] == ["chord"]


def test_one_number_stands_for_a_list_of_one():
    assert parse_study(STUDY.replace("[0.75, 0.65]", "0.7")).densities == (0.7,)


def test_without_density_the_packer_decides():
    assert parse_study(STUDY.replace("density = [0.75, 0.65]", "")).densities == (None,)


@pytest.mark.parametrize(
    ("found", "replacement", "words"),
    [
        ("radii =", "radi =", ("packing.radi", "unknown key", "did you mean 'radii'", "box")),
        ("[statistics]", "[statistic]", ("statistic", "did you mean 'statistics'")),
        ("[0.75, 0.65]", "[0.75, -0.65]", ("packing.density[1]", "found -0.65", "positive")),
        ("[0.75, 0.65]", "[]", ("packing.density", "found []", "allowed")),
        ("[0.75, 0.65]", "[0.75, 0.75]", ("packing.density", "0.75 is listed twice")),
        ("[0.75, 0.65]", "[1.2]", ("packing.density", "found 1.2", "below 1", "bonded")),
        ("[0.75, 0.65]", "['high']", ("packing.density[0]", "found 'high'")),
        ("[0.75, 0.65]", "[nan]", ("packing.density[0]", "found nan")),
        ("[10.0, 2.5]", "[0.0]", ("contacts.contact_angle[0]", "found 0.0", "from 1e-6 to 90")),
        ("[10.0, 2.5]", "[90]", ("contacts.contact_angle[0]", "found 90", "from 1e-6 to 90")),
        ("contact_angle = [10.0, 2.5]", "", ("contacts", "bonded", "contact_angle")),
        ('"bonded"', '"overlap"', ("contacts", "contact_angle", "overlap")),
        ('"bonded"', '"glued"', ("contacts.rule", "found 'glued'", "overlap, bonded, radius, coordination")),
        ("[statistics]", '[conduction]\nmethod = "cord"\n[statistics]', ("method", "found 'cord'", "chord")),
        (
            "[statistics]",
            '[conduction]\nangle_curve = "some"\n[statistics]',
            ("conduction.angle_curve", "found 'some'", "reduced or full"),
        ),
        ("[statistics]", "[conduction]\nmethod = 5\n[statistics]", ("conduction.method", "found 5")),
        ("[statistics]", "[conduction]\nmethod = 'pipe'\n[statistics]", ("found 'pipe'", "write engine = 'pipe'")),
        ("[statistics]", "[conduction]\nengine = ['dtem']\n[statistics]", ("conduction.engine: found ['dtem']",)),
        (
            "[statistics]",
            '[conduction]\npipe_resistance = "chord"\n[statistics]',
            ("conduction.pipe_resistance: unknown key", "write engine = 'pipe' with method = 'chord' or 'uniform'"),
        ),
        ("[statistics]", '[conduction]\nengine = "fem"\n[statistics]', ("conduction.engine", "found 'fem'", "dtem")),
        ("realizations = 3", "realizations = 0", ("statistics.realizations", "found 0", "at least 1")),
        ("realizations = 3", "realizations = 2.5", ("statistics.realizations", "found 2.5")),
        ("realizations = 3", "realizations = true", ("statistics.realizations", "found True")),
        ("realizations = 3", "", ("statistics.realizations", "missing")),
        ("realizations = 3", "realizations = 3\nmax_realizations = 9", ("max_realizations", "relative_ci")),
        (
            "realizations = 3",
            "realizations = 3\nrelative_ci = 0.1\nmax_realizations = 2",
            ("max_realizations = 2", "realizations = 3"),
        ),
        ("realizations = 3", "realizations = 1\nrelative_ci = 0.1", ("realizations = 1", "at least 2")),
        ("seed = 20261", "seed = -1", ("seed", "found -1", "from 0")),
        ("schema = 2", "schema = 3", ("schema", "found 3", "allowed: 2")),
        ("box = [1.0, 1.0]", "box = [1.0]", ("packing.box", "two or three")),
        ("box =", 'periodic = "xq"\nbox =', ("periodic", "'xq'")),
        ("uniform:0.01:0.02", "triangle:0.01", ("packing", "radii", "triangle:0.01")),
        ("box =", "growth_rate = 0.1\nbox =", ("packing", "growth_rate", "advancing-front")),
        ("box =", "count = 100\nbox =", ("packing", "count", "advancing-front")),
        ("uniform:0.01:0.02", "equal", ("packing", "radii", "equal:0.01")),
        ("[statistics]", '[models]\nnames = ["maxwel"]\n[statistics]', ("models", "maxwel", "did you mean maxwell")),
        *(
            ("[statistics]", f'[models]\nnames = ["{name}"]\n[statistics]', ("models.names", repr(name), *words))
            for name, words in {
                "kunii_smith": ("holds in 3D", "packing.box = [1.0, 1.0]"),
                "hasselman_johnson": ("needs radius (inclusion radius), interface_conductance", "remove it"),
                "lewis_nielsen": ("needs k1 (conductivity of the matrix) in (0, inf), found 0",),
            }.items()
        ),
        (
            '[contacts]\nrule = "bonded"\ncontact_angle = [10.0, 2.5]\n',
            '[models]\nnames = ["contact_mean_field"]\n[pores]\nconductivity = 0.1\n[conduction]\nengine = "voxel"\n'
            "resolution = 400\n",
            ("models.names", "'contact_mean_field' needs a network of contacts, which engine 'voxel' lacks"),
        ),
        ("schema = 2", "schema = = 2", ("not valid TOML", "line 2")),
    ],
)
def test_mistakes_are_one_line_with_key_found_and_allowed(found, replacement, words):
    assert found in STUDY
    with pytest.raises(StudyError) as raised:
        parse_study(STUDY.replace(found, replacement), "study.toml")
    message = str(raised.value)
    assert message.startswith("study.toml: ")
    assert "\n" not in message
    for word in words:
        assert word in message, message


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(StudyError, match=r"none\.toml: cannot be read"):
        read_study(tmp_path / "none.toml")


def test_a_file_that_is_not_text_is_named(tmp_path):
    path = tmp_path / "image.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(StudyError, match="not text"):
        read_study(path)


def test_digest_sees_what_decides_the_numbers_and_nothing_else():
    base = parse_study(STUDY).digest()
    same = [
        "# a remark\n" + STUDY,
        STUDY.replace("[0.75, 0.65]", "[0.65, 0.75]"),
        STUDY.replace('"small"', '"large"'),
        STUDY.replace("[statistics]", '[models]\nnames = ["maxwell"]\n[statistics]'),
        STUDY.replace("box =", 'method = "advancing-front"\nbox ='),
    ]
    other = [
        STUDY.replace("20261", "20262"),
        STUDY.replace("2.5]", "2.6]"),
        STUDY.replace("realizations = 3", "realizations = 4"),
        STUDY.replace("0.02", "0.021"),
    ]
    assert {parse_study(text).digest() for text in same} == {base}
    assert len({base, *(parse_study(text).digest() for text in other)}) == 1 + len(other)


@settings(max_examples=60, deadline=None)
@given(st.text(max_size=80), st.integers(0, len(STUDY)))
def test_no_text_gives_anything_but_a_study_or_one_line(noise, place):
    text = STUDY[:place] + noise + STUDY[place:]
    try:
        parse_study(text)
    except StudyError as error:
        assert "\n" not in str(error)


@pytest.mark.parametrize("name", ["", "a\nb", "\x1b[31mred", "a\x00b", "n" * 81])
def test_a_name_is_short_and_printable(name):
    with pytest.raises(StudyError, match=r"name: found .* allowed: 1 to 80 printable characters"):
        parse_study(STUDY.replace(STUDY[STUDY.index("name = ") :].splitlines()[0], f"name = {json.dumps(name)}"))


@pytest.mark.parametrize("text", ["a = " + "9" * 6000, "a = " + "[" * 3000])
def test_what_the_toml_reader_cannot_hold_is_refused(text):
    with pytest.raises(StudyError, match="is not valid TOML"):
        parse_study(text)


def test_true_is_no_number_of_a_schema():
    with pytest.raises(StudyError, match="schema: found true, allowed: 2"):
        parse_study(STUDY.replace("schema = 2", "schema = true"))

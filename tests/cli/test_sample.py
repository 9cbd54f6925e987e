"""The sample that a file makes: its digits, its dimension and its box."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

BED = Path(__file__).parents[1] / "data" / "gravity_bed.dump"
OWN = 0.04283289190282452  # pinned: k_xx of the settled bed with all digits, in its box of 0.3 m x 0.6 m


def settled(path: Path, form: str, *, scaled: bool = False) -> Path:
    """The last frame of the bed, printed anew."""
    lines = BED.read_text().splitlines()
    lines = lines[max(k for k, line in enumerate(lines) if line == "ITEM: TIMESTEP") :]
    edges = [tuple(map(float, line.split())) for line in lines[5:8]]
    head = lines[:9]
    if scaled:
        head[8] = head[8].replace(" x y z", " xs ys zs")
    rows = []
    for line in lines[9:]:
        words = line.split()
        numbers = [float(word) for word in words[2:6]]
        if scaled:
            numbers[:3] = [(x - low) / (high - low) for x, (low, high) in zip(numbers[:3], edges, strict=True)]
        rows.append(" ".join([*words[:2], *(form % number for number in numbers)]))
    path.write_text("\n".join([*head, *rows, ""]))
    return path


def solved(done) -> dict:
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize(
    ("form", "scaled", "wrong"),
    [("%.17g", False, False), ("%g", False, True), ("%g", True, True), ("%.5f", False, True)],
)
def test_a_number_that_depends_on_the_printed_digits_says_so(etc_engine, tmp_path, form, scaled, wrong):
    done = etc_engine("solve", settled(tmp_path / "bed.dump", form, scaled=scaled), "--json")
    found = solved(done)["conductivity"]
    assert (abs(found / OWN - 1.0) > 0.05) == wrong
    assert ("too few digits" in done.stderr) == wrong
    if wrong:
        assert "dump_modify ID format float %.17g" in done.stderr
        assert "--bond-gap" in done.stderr


def test_digits_of_csv_count_too_and_a_bond_gap_beyond_them_decides(etc_engine, tmp_path):
    lines = settled(tmp_path / "bed.dump", "%g").read_text().splitlines()[9:]
    rows = [",".join([*line.split()[2:4], line.split()[5]]) for line in lines]
    path = tmp_path / "bed.csv"
    path.write_text("\n".join(["x,y,radius", *rows]))
    words = ("--box", "0.3,0.6", "--periodic", "x", "--json")
    done = etc_engine("solve", path, *words)
    assert "too few digits" in done.stderr
    assert "write more digits" in done.stderr
    exact = etc_engine(
        "solve", settled(tmp_path / "exact.dump", "%.17g"), "--contact-angle", 5, "--bond-gap", 2e-3, "--json"
    )
    done = etc_engine("solve", path, *words, "--contact-angle", 5, "--bond-gap", 2e-3)
    assert solved(done)["contacts"] == solved(exact)["contacts"]
    assert solved(done)["conductivity"] == pytest.approx(solved(exact)["conductivity"], rel=1e-4)


def test_numbers_that_are_meant_as_they_stand_are_no_doubt(etc_engine, tmp_path):
    """A square lattice of touching disks, written by hand."""
    path = tmp_path / "lattice.csv"
    path.write_text("x,y,radius\n0.25,0.25,0.25\n0.75,0.25,0.25\n0.25,0.75,0.25\n0.75,0.75,0.25\n")
    done = etc_engine("solve", path, "--box", "1,1", "--periodic", "xy", "--contact-angle", 5)
    assert done.stderr == ""


SPHERE = """ITEM: TIMESTEP
0
ITEM: NUMBER OF ATOMS
1
ITEM: BOX BOUNDS pp pp pp
0 1
0 1
0 1
ITEM: ATOMS id type x y z radius
1 1 0.5 0.5 0.5 0.35
"""


def test_one_sphere_in_a_3d_dump_is_a_sphere(etc_engine, tmp_path):
    (tmp_path / "a.dump").write_text(SPHERE)
    (tmp_path / "a.csv").write_text("x,y,z,radius\n0.5,0.5,0.5,0.35\n")
    (tmp_path / "disk.csv").write_text("x,y,radius\n0.5,0.5,0.35\n")
    words = ("--matrix", 0.2, "--inclusion", 30, "--resolution", 24, "--json")
    dump = etc_engine("homogenize", tmp_path / "a.dump", *words)
    tensor = solved(dump)["conductivity_tensor"]
    assert "taken for spheres (--dimension 2 for disks)" in dump.stderr
    assert (
        tensor == solved(etc_engine("homogenize", tmp_path / "a.csv", "--box", "1,1,1", *words))["conductivity_tensor"]
    )
    assert tensor[0][0] == pytest.approx(0.3295, rel=5e-3)  # simple cubic array, by the same engine at 64 voxels
    disk = etc_engine("homogenize", tmp_path / "a.dump", "--dimension", 2, *words)
    plane = solved(etc_engine("homogenize", tmp_path / "disk.csv", "--box", "1,1", *words))
    assert solved(disk)["conductivity_tensor"] == plane["conductivity_tensor"]
    assert plane["conductivity_tensor"][0][0] == pytest.approx(0.4485, rel=5e-3)


def test_free_space_above_a_bed_is_named_and_cropped(etc_engine):
    """Across the bed, free space above dilutes: k times the height of the box is the same for any crop."""
    whole = etc_engine("solve", BED, "--json")
    record = solved(whole)
    assert record["conductivity"] == pytest.approx(OWN, rel=1e-9)
    assert "the box is larger than the sample: between the wall y = 0.6" in whole.stderr
    height = record["fill_height"]
    assert 0.05 < height < 0.55
    cropped = etc_engine("solve", BED, "--crop", f",0:{height * 1.0001}", "--json")
    assert "larger than the sample" not in cropped.stderr
    assert solved(cropped)["conductivity"] == pytest.approx(OWN * 0.6 / (height * 1.0001), rel=1e-9)
    assert solved(cropped)["density"] == pytest.approx(record["density"] * 0.6 / (height * 1.0001), rel=1e-9)
    boxed = etc_engine("solve", BED, "--box", f"0.3,{height * 1.0001}", "--json")
    assert solved(boxed)["conductivity"] == solved(cropped)["conductivity"]


CHAIN = """ITEM: TIMESTEP
0
ITEM: NUMBER OF ATOMS
2
ITEM: BOX BOUNDS {flags} pp
{x}
{y}
-0.5 0.5
ITEM: ATOMS id type x y z radius
1 1 0.45 0.5 0 0.5
2 1 1.35 0.5 0 0.5
"""


@pytest.fixture
def chain(tmp_path):
    def write(x: str, flags: str = "ff ff", y: str = "0 1") -> Path:
        path = tmp_path / "chain.dump"
        path.write_text(CHAIN.format(x=x, y=y, flags=flags))
        return path

    return write


def test_walls_through_the_outermost_centres_are_named(etc_engine, chain):
    """A box wrapped around the centres of two disks gives a conductivity above that of the disks."""
    right = solved(etc_engine("solve", chain("0 1.8"), "--json"))["conductivity"]
    assert right < 1.0
    wrapped = chain("0.46 1.34", flags="ss ff")
    done = etc_engine("solve", wrapped, "--json")
    assert done.returncode == 2 or "walls go through 2 particles" in done.stderr
    boxed = etc_engine("solve", wrapped, "--box", "0:1.8,0:1", "--json")
    assert solved(boxed)["conductivity"] == right
    assert "walls go through" not in boxed.stderr
    extended = etc_engine("solve", wrapped, "--crop", "0:1.8,", "--json")
    assert solved(extended)["conductivity"] == right


def test_a_box_wider_than_the_walls_is_named(etc_engine, chain):
    right = solved(etc_engine("solve", chain("0 1.8"), "--json"))["conductivity"]
    wide = chain("-0.2 2.0")
    done = etc_engine("solve", wide, "--json")
    assert solved(done)["conductivity"] == 0.0
    assert done.stderr.count("nothing touches the driven wall x = ") == 2
    assert solved(etc_engine("solve", wide, "--crop", "0:1.8,:", "--json"))["conductivity"] == right


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--crop", "0:1"), "a crop of a 2D box needs 2 ranges"),
        (("--crop", "1:0,:"), "must go from low to high"),
        (("--crop", "a:b,:"), "--crop takes ranges low:high"),
        (("--crop", "-1:1,:"), "goes beyond the periodic box"),
        (("--crop", ",0.59:0.6"), "no centre lies in the crop"),
        (("--box", "1:0,0:1"), "must go from low to high"),
        (("--box", "x,y"), "--box takes edge lengths"),
        (("--box", "1,1,1", "--dimension", "2"), "does not fit dimension 2"),
        (("--periodic", "z"), "periodic axes 'z'"),
    ],
)
def test_samples_that_cannot_be_are_refused(etc_engine, options, words):
    done = etc_engine("solve", BED, *options)
    assert done.returncode == 2
    assert words in done.stderr
    assert done.stderr.count("\n") == 1


def test_conductivities_by_type(etc_engine):
    plain = solved(etc_engine("solve", BED, "--json"))["conductivity"]
    same = solved(etc_engine("solve", BED, "--types", "1=1,2=1", "--json"))["conductivity"]
    twice = solved(etc_engine("solve", BED, "--types", "1=2,2=2", "--json"))["conductivity"]
    mixed = solved(etc_engine("solve", BED, "--types", "1=1,2=2", "--json"))["conductivity"]
    assert same == plain
    assert twice == pytest.approx(2.0 * plain, rel=1e-9)
    assert plain < mixed < twice
    for words, said in (
        (("--types", "1=1"), "the conductivity of 2 is missing"),
        (("--types", "1:1"), "TYPE=CONDUCTIVITY"),
        (("--types", "1=1,2=1", "--conductivity", 2), "leave --conductivity out"),
    ):
        assert said in etc_engine("solve", BED, *words).stderr

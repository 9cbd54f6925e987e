"""Contact dumps: who touches whom, with which force, through which area."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.errors import InputError
from etc_engine.particle_files.contact_dumps import contact_rows, read_contacts
from etc_engine.particle_files.formats import read_table
from etc_engine.particle_files.sample import Sample

BOUNDS = "ITEM: BOX BOUNDS pp ff ff\n-1 1\n0 1\n0 1\n"
PARTICLES = (
    f"ITEM: TIMESTEP\n7\nITEM: NUMBER OF ATOMS\n3\n{BOUNDS}ITEM: ATOMS id type x y z radius f_Temp[0]\n"
    "30 1 0.8 0.5 0.5 0.21 300\n10 1 -0.8 0.5 0.5 0.21 310\n20 2 0.4 0.5 0.5 0.2 320\n"
)
ROWS = (
    "0.8 0.5 0.5 0.4 0.5 0.5 30 20 0 3 0 4 0.001 2.5 \n"  # with a blank at the end, as LIGGGHTS writes
    "0.8 0.5 0.5 -0.8 0.5 0.5 30 10 1 0 0 2 0.002 -1.5 \n"
)
COLUMNS = " ".join(f"c_fc[{k + 1}]" for k in range(14))
CONTACTS = f"ITEM: TIMESTEP\n7\nITEM: NUMBER OF ENTRIES\n2\n{BOUNDS}ITEM: ENTRIES {COLUMNS} \n{ROWS}"


@pytest.fixture
def files(tmp_path):
    def write(contacts: str = CONTACTS, particles: str = PARTICLES):
        (tmp_path / "p.dump").write_text(particles)
        (tmp_path / "c.dump").write_text(contacts)
        return tmp_path / "p.dump", tmp_path / "c.dump"

    return write


def test_columns_without_names_have_the_usual_order(files):
    particles, path = files()
    contacts = read_contacts(path)
    assert contacts.ids.tolist() == [[30, 20], [30, 10]]
    assert contacts.column("contactArea").tolist() == [0.001, 0.002]
    assert contacts.column("heatFlux").tolist() == [2.5, -1.5]
    assert np.linalg.norm(contacts.column("force"), axis=1).tolist() == [5.0, 2.0]
    table = read_table(particles)
    rows = contact_rows(table, contacts)
    assert table.ids[rows].tolist() == [[30, 20], [30, 10]]
    with pytest.raises(InputError, match=r"has no delta: it has pos, force, contactArea, heatFlux"):
        contacts.column("delta")


def test_words_name_other_columns(files):
    rows = "30 20 0 3 0 4 1 2 3 4 0.01\n30 10 1 0 0 2 1 2 3 4 0.02\n"
    names = " ".join(f"c_fc[{k + 1}]" for k in range(11))
    _, path = files(CONTACTS.replace(COLUMNS, names).replace(ROWS, rows))
    with pytest.raises(InputError, match=r"11 columns, 'pos id force contactArea heatFlux' makes 14"):
        read_contacts(path)
    contacts = read_contacts(path, words=("id", "force", "history:4", "delta"))
    assert contacts.column("delta").tolist() == [0.01, 0.02]
    with pytest.raises(InputError, match="knows the words"):
        read_contacts(path, words=("id", "colour"))


def test_columns_with_names_of_their_own(files):
    rows = "1 30 20 0.001 5\n2 30 10 0.002 2\n"
    _, path = files(CONTACTS.replace(COLUMNS, "index id1 id2 area force").replace(ROWS, rows))
    contacts = read_contacts(path)
    assert contacts.column("contactArea").tolist() == [0.001, 0.002]
    assert contacts.column("force").tolist() == [5.0, 2.0]


def test_contacts_of_particles_that_were_cropped_away_are_left_out(files):
    particles, path = files()
    table = read_table(particles, sample=Sample(crop=((0.0, 1.0), (0.0, 1.0), (0.0, 1.0))))
    rows = contact_rows(table, read_contacts(path))
    assert (rows >= 0).all(axis=1).tolist() == [True, False]


@pytest.mark.parametrize(
    ("contacts", "particles", "words"),
    [
        (CONTACTS.replace("0.8 0.5 0.5 0.4", "0.8 0.5 0.5 0.3"), PARTICLES, "give the frame of the same time step"),
        (CONTACTS.replace("30 20 0", "31 21 0").replace("30 10 1", "31 11 1"), PARTICLES, "names no contact"),
        (CONTACTS, PARTICLES.replace("30 1", "10 1"), "the id 10 belongs to several"),
        (CONTACTS, PARTICLES.replace("ATOMS id", "ATOMS mol"), "the particles have no ids"),
        (CONTACTS.replace("30 20 0", "30.5 20 0"), PARTICLES, "ids of particles must be whole numbers"),
        (CONTACTS.replace("ENTRIES\n2", "ENTRIES\n3"), PARTICLES, "3 entries are announced, 2 found"),
        (CONTACTS.replace("2.5 \n", "\n"), PARTICLES, "is not a table of numbers|expected 14 values"),
        (PARTICLES, PARTICLES, "is no dump of contacts"),
    ],
)
def test_contacts_refused_by_name(files, contacts, particles, words):
    first, second = files(contacts, particles)
    with pytest.raises(InputError, match=words):
        contact_rows(read_table(first), read_contacts(second))

"""Heat flows of another code's bed, by its own contact law and from its own temperatures.

``python studies/spheres_accuracy/peer_flows.py ATOMS CONTACTS --conductivity K`` reads a LIGGGHTS dump of particles
with their temperatures, and a dump of their contacts (``compute pair/gran/local``: positions, ids, force, contact area,
heat flow). The pipe law ``root-area`` gives every contact the conductance 4 k_1 k_2/(k_1 + k_2) sqrt(A). Prints how
its heat flows correlate with those of the dump, and by how much they differ.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from etc_engine.laws.sphere import chord_resistance, root_area_resistance
from etc_engine.particle_files.contact_dumps import contact_rows, read_contacts
from etc_engine.particle_files.dumps import read_dump


def main() -> None:
    """Read, compute, compare."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("atoms", type=Path)
    parser.add_argument("contacts", type=Path)
    parser.add_argument("--conductivity", type=float, required=True, help="of the particles [W/(m K)]")
    given = parser.parse_args()
    table, contacts = read_dump(given.atoms), read_contacts(given.contacts)
    if table.temperature is None:
        raise SystemExit(f"{given.atoms} has no temperatures")
    rows = contact_rows(table, contacts)
    known = (rows >= 0).all(axis=1)
    rows, area, theirs = rows[known], contacts.column("contactArea")[known], contacts.column("heatFlux")[known]
    radii = table.packing.radii[rows]
    alpha = np.arcsin(np.sqrt(area / np.pi)[:, None] / radii)
    drops = np.diff(table.temperature[rows], axis=1)[:, 0]
    print(f"{known.sum()} contacts, heat flow into the first particle of each [W]")
    for name, law in (("root-area", root_area_resistance), ("chord", chord_resistance)):
        ours = drops / (law(alpha) / (given.conductivity * radii)).sum(axis=1)
        misfit = np.linalg.norm(ours - theirs) / np.linalg.norm(theirs)
        ratio = np.median(ours[theirs != 0.0] / theirs[theirs != 0.0])
        correlation = np.corrcoef(ours, theirs)[0, 1]
        print(f"{name:10s} correlation {correlation:.9f}  misfit {misfit:.2e}  median ratio {ratio:.6f}")


if __name__ == "__main__":
    main()

"""The options with which ``solve`` takes contacts from the contact dump of a DEM code."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from etc_engine.errors import InputError

if TYPE_CHECKING:
    from etc_engine.medium.network import ContactNetwork
    from etc_engine.particle_files.table import ParticleTable

OPTIONS = (
    click.option(
        "--contacts",
        type=click.Path(path_type=Path),
        help="Contact dump (ITEM: ENTRIES) of the same time step. Its contacts replace overlaps.",
    ),
    click.option(
        "--contact-width",
        type=click.Choice(("area", "force")),
        help="Width of the contacts of the dump. By default area where the dump has one.",
    ),
    click.option(
        "--contact-columns",
        help="Columns of the dump, by the names of compute pair/gran/local: 'pos id force contactArea heatFlux'.",
    ),
)


@dataclass(frozen=True)
class ContactWords:
    """The words of the options."""

    contacts: Path | None = None
    contact_width: str | None = None
    contact_columns: str | None = None

    def network(
        self, table: ParticleTable, frame: int | None, youngs_modulus: float | None, poisson_ratio: float | None
    ) -> ContactNetwork | None:
        """Contacts of the dump; None where none is given. The elastic constants are needed by widths from forces.

        Raises
        ------
        InputError, GeometryError
        """
        from etc_engine.laws.contact import Elastic
        from etc_engine.medium.given_contacts import given_contacts, reach_of_contacts
        from etc_engine.particle_files.contact_dumps import contact_rows, read_contacts

        if self.contacts is None:
            unused = [name for name in ("contact_width", "contact_columns") if getattr(self, name)]
            if unused:
                raise InputError(f"--{unused[0].replace('_', '-')} is only valid with --contacts")
            return None
        words = () if self.contact_columns is None else tuple(self.contact_columns.replace(",", " ").split())
        found = read_contacts(self.contacts, -1 if frame is None else frame, words)
        width = self.contact_width or ("area" if "contactArea" in found.columns else "force")
        rows = contact_rows(table, found)
        known = (rows >= 0).all(axis=1)
        if width == "area":
            values = {"area": found.column("contactArea")[known]}
        else:
            word = "force_normal" if "force_normal" in found.columns else "force"
            values = {"force": found.column(word)[known]}
        material = None
        if youngs_modulus is not None and poisson_ratio is not None:
            material = Elastic(youngs_modulus, poisson_ratio)
        reach = reach_of_contacts(table.packing, rows[known], **values, material=material)
        own = ", as the run made it with its own stiffness" if width == "area" else ""
        said = f"{int(known.sum())} contacts from {self.contacts}, their widths from the {width}{own}"
        click.echo(f"etc-engine: note: {said}; contacts with walls are overlaps", err=True)
        return given_contacts(table.packing, rows[known], reach)


def contact_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options, as one argument ``dumped``."""

    @wraps(command)
    def gathered(**given: Any) -> Any:
        own = {name: given.pop(name) for name in ContactWords.__dataclass_fields__}
        return command(dumped=ContactWords(**own), **given)

    for option in reversed(OPTIONS):
        gathered = option(gathered)
    return gathered

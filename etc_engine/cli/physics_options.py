"""Options of contacts from load, gas and radiation, and the medium they describe."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from etc_engine.medium.conditions import Conditions
    from etc_engine.medium.medium import Medium, Pores
    from etc_engine.medium.network import ContactNetwork
    from etc_engine.packing.particles import ParticlePacking

OPTIONS = (
    click.option(
        "--rule",
        help="Contact rule: overlap, bonded, radius, coordination, hertz or load. By default the other options decide.",
    ),
    click.option("--contact-radius", type=float, help="Radius of bonded contacts [m], instead of --contact-angle."),
    click.option(
        "--coordination",
        type=float,
        help="Mean coordination number that the closest pairs make. With --rule coordination or load.",
    ),
    click.option("--youngs-modulus", type=float, help="Young's modulus of the particles [Pa]."),
    click.option("--poisson-ratio", type=float, help="Poisson's ratio of the particles."),
    click.option(
        "--simulated-modulus", type=float, help="Young's modulus that the DEM run used [Pa]. With --rule hertz."
    ),
    click.option("--load", type=float, help="Mean stress carried by the contacts [Pa]. With --rule load."),
    click.option(
        "--area-resistance",
        type=float,
        help="Resistance of a unit of contact area, walls included [m2 K/W]. Method exact resolves it for disks.",
    ),
    click.option("--roughness", help="Height [m], slope and hardness [Pa] of rough contacts: 1e-6,0.1,4e9."),
    click.option("--material", help="Solid by name, see etc-engine materials. Needs --temperature."),
    click.option("--gas", help="Gas in the pores by name, see etc-engine materials."),
    click.option("--pressure", type=float, help="Pressure of the gas [Pa]. 0 is vacuum."),
    click.option("--temperature", type=float, help="Temperature of properties and radiation [K]."),
    click.option("--accommodation", type=float, help="Thermal accommodation coefficient of the surfaces, up to 1."),
    click.option(
        "--emissivity",
        type=float,
        help="Emissivity of the particles. Facing surfaces of neighbours radiate. Rays past neighbours are left out.",
    ),
    click.option(
        "--wall-temperatures",
        help="Temperatures of the walls at the low and the far end [K], such as 900:600. Properties follow "
        "the local temperature, along every walled axis asked for.",
    ),
)


@dataclass(frozen=True)
class PhysicsWords:
    """What the options say of contacts, solid and pores."""

    rule: str | None = None
    contact_radius: float | None = None
    coordination: float | None = None
    youngs_modulus: float | None = None
    poisson_ratio: float | None = None
    simulated_modulus: float | None = None
    load: float | None = None
    area_resistance: float | None = None
    roughness: str | None = None
    material: str | None = None
    gas: str | None = None
    pressure: float | None = None
    temperature: float | None = None
    accommodation: float | None = None
    emissivity: float | None = None
    wall_temperatures: str | None = None

    @property
    def walls(self) -> tuple[float, float] | None:
        """Temperatures of the walls at the low and the far end [K].

        Raises
        ------
        InputError
        """
        if self.wall_temperatures is None:
            return None
        from etc_engine.errors import InputError

        try:
            low, high = (float(word) for word in self.wall_temperatures.split(":"))
        except ValueError:
            raise InputError(
                f"--wall-temperatures takes two temperatures [K], such as 900:600: found {self.wall_temperatures!r}"
            ) from None
        return low, high

    @property
    def reference(self) -> float | None:
        """The temperature asked for; without one the mean of the walls."""
        if self.temperature is not None or self.walls is None:
            return self.temperature
        return 0.5 * sum(self.walls)

    @property
    def conditions(self) -> Conditions:
        """Gas, temperature, pressure and radiation.

        Raises
        ------
        InputError
        """
        from etc_engine.medium.conditions import Conditions

        given = self.gas, self.pressure, self.accommodation, self._atomic_mass(), self.emissivity
        return Conditions(self.reference, *given)

    def between_walls(self, medium: Medium, axes: tuple[int, ...]) -> dict[str, Any]:
        """Record of the conduction between the walls at the local temperature; empty without their temperatures.

        Parameters
        ----------
        medium : Medium
        axes : tuple of int
            Load axes; those without walls are left out. ``heat_flow`` is along the first one.

        Raises
        ------
        InputError
            If nothing follows the temperature, or no axis has walls.
        """
        if self.walls is None:
            return {}
        from dataclasses import replace

        import numpy as np

        from etc_engine.box import AXES
        from etc_engine.engines.dtem.between_walls import conductivity_between_walls
        from etc_engine.errors import InputError
        from etc_engine.materials import find_solid
        from etc_engine.medium.local import LocalProperties, solid_law

        if self.material is None and self.gas is None and not self.emissivity:
            raise InputError(
                "--wall-temperatures need --material, --gas or --emissivity: nothing else depends on the temperature"
            )
        every = np.ones(medium.packing.count, dtype=np.bool_)
        named = () if self.material is None else ((every, find_solid(self.material).conductivity),)
        solid = solid_law(medium.conductivity, named)
        local = LocalProperties(medium.packing, self.conditions, solid, medium.pores.conductivity, self.walls)
        result, by_axis = conductivity_between_walls(replace(medium, local=local), axes=axes)
        first = by_axis[min(by_axis)]
        return {
            "conductivity_between_walls": first.conductivity,
            "conductivity_between_walls_per_axis": {AXES[axis]: one.conductivity for axis, one in by_axis.items()},
            "heat_flow": first.heat_flow,
            "heat_imbalance": result.heat_imbalance,
            "nonlinear_iterations": result.picard_iterations,
        }

    @property
    def contact_rule(self) -> str | None:
        """The rule asked for; ``radius`` or ``load`` if only a contact radius or a load is given."""
        if self.rule is not None:
            return self.rule
        return "radius" if self.contact_radius is not None else "load" if self.load is not None else None

    def rule_for(self, half_angle: float | None) -> str:
        """The rule asked for, by default bonds where they have a half-angle and overlaps where they have none."""
        return self.contact_rule or ("overlap" if half_angle is None else "bonded")

    def network(self, packing: ParticlePacking, half_angle: float | None, bond_gap: float) -> ContactNetwork:
        """Contacts by the rule asked for.

        Raises
        ------
        InputError
            If the rule is unknown, or an option that it needs is missing, or one has no effect with it.
        """
        from etc_engine.errors import InputError
        from etc_engine.medium.rules import find_rule

        word = self.rule_for(half_angle)
        rule = find_rule(word)
        values = {
            "contact_angle": half_angle,
            "contact_radius": self.contact_radius,
            "coordination": self.coordination,
            "youngs_modulus": self.youngs_modulus,
            "poisson_ratio": self.poisson_ratio,
            "simulated_modulus": self.simulated_modulus,
            "load": self.load,
        }
        given = {name: value for name, value in values.items() if value is not None}
        used = set(rule.keys) | ({"youngs_modulus", "poisson_ratio"} if self.roughness else set())
        for name in given:
            if name not in used:
                raise InputError(f"{_option(name)} has no effect with the contact rule {word}")
        if rule.takes_gap:
            given["bond_gap"] = bond_gap
        elastic = ("youngs_modulus", "poisson_ratio") if self.simulated_modulus is not None else ()
        for name in (*rule.needs, *elastic):
            if name not in given:
                raise InputError(f"the contact rule {word} also needs {_option(name)}")
        return rule.contacts(packing, **{rule.keys[name]: value for name, value in given.items() if name in rule.keys})

    def refuse_two_resistances(self, contact_resistance: float) -> None:
        """Refuse two options that both say what a contact resists.

        Raises
        ------
        InputError
        """
        from etc_engine.errors import InputError

        resist = {
            "--contact-resistance": contact_resistance > 0.0,
            "--area-resistance": self.area_resistance is not None,
            "--roughness": self.roughness is not None,
        }
        given = [option for option, word in resist.items() if word]
        if len(given) > 1:
            raise InputError(f"{given[0]} and {given[1]} both resist at contacts: leave one of them out")

    def roughened(self, network: ContactNetwork, conductivity: Any, pores: Pores) -> ContactNetwork:
        """The contacts with the area resistance asked for, or that of rough surfaces.

        Raises
        ------
        InputError
            If the words cannot be read, or the elastic constants are missing.
        """
        if self.roughness is None:
            return network if self.area_resistance is None else network.with_area_resistance(self.area_resistance)
        import numpy as np

        from etc_engine.errors import InputError
        from etc_engine.laws.roughness import Roughness
        from etc_engine.medium.loaded import Stiffness, with_roughness

        try:
            height, slope, hardness = (float(word) for word in self.roughness.split(","))
        except ValueError:
            raise InputError(
                f"--roughness takes height, slope and hardness, such as 1e-6,0.1,4e9: found {self.roughness!r}"
            ) from None
        if self.youngs_modulus is None or self.poisson_ratio is None:
            raise InputError("--roughness also needs --youngs-modulus and --poisson-ratio: they give the pressures")
        kappa = np.broadcast_to(np.asarray(conductivity, dtype=np.float64), (network.packing.count,))
        stiffness = Stiffness(self.youngs_modulus, self.poisson_ratio)
        gas = (pores.conductivity, pores.jump_length)
        return with_roughness(network, Roughness(height, slope, hardness=hardness), stiffness, kappa, gas)

    def pores(self, packing: ParticlePacking, conductivity: float) -> Pores:
        """The pores at the temperature and pressure asked for.

        Raises
        ------
        InputError
            If a gas comes beside a conductivity, or something that it needs is missing.
        """
        from etc_engine.errors import InputError
        from etc_engine.medium.conditions import pores_at

        if self.gas is not None and conductivity > 0.0:
            raise InputError("--gas and --pore-conductivity both say what fills the pores: leave one of them out")
        return pores_at(self.conditions, packing, conductivity)

    def solid(self) -> float | None:
        """Conductivity of the material named, at the temperature asked for; None without a name.

        Raises
        ------
        InputError
        """
        if self.material is None:
            return None
        from etc_engine.errors import InputError
        from etc_engine.materials import find_solid

        if self.reference is None:
            raise InputError("--material needs --temperature: its conductivity depends on it")
        return float(find_solid(self.material).conductivity.at(self.reference))

    def _atomic_mass(self) -> float | None:
        from etc_engine.materials import find_solid

        return None if self.material is None else find_solid(self.material).atomic_mass

    @property
    def record(self) -> dict[str, Any]:
        """What was given, for the record of a result."""
        from dataclasses import asdict

        return {name: value for name, value in asdict(self).items() if value is not None and name != "rule"}


def physics_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options; the command gets them as one argument ``physics``."""

    @wraps(command)
    def gathered(*args: Any, **given: Any) -> Any:
        words = PhysicsWords(**{name: given.pop(name) for name in PhysicsWords.__dataclass_fields__})
        return command(*args, physics=words, **given)

    for option in reversed(OPTIONS):
        gathered = option(gathered)
    return gathered


def _option(name: str) -> str:
    return "--" + name.replace("_", "-")

"""Natural convection in the measured beds: Darcy-Rayleigh numbers: ``python convection.py``

Ra = g dT K L/(T nu alpha), K = d^2 e^3/(150 (1 - e)^2) (Carman and Kozeny), nu the kinematic viscosity of the gas and
alpha the conductivity of the bed over rho c of the gas. Convection in a layer heated from below starts at
4 pi^2 = 39.5. Heat transport by convection is small against conduction where Ra is about 1 or less.
"""

from __future__ import annotations

from etc_engine.materials import gas_state

GAS_CONSTANT = 8.314462618
CASES = {  # gas, T [K], d [m], porosity, conductivity of the bed [W/(m K)], dT [K], L [m]
    "steel in air, the whole drop": ("air", 309.65, 6.4e-3, 0.42, 0.55, 33.0, 0.105),
    "SANA in nitrogen, coldest": ("nitrogen", 411.0, 0.06, 0.41, 2.1, 100.0, 0.5),
    "SANA in nitrogen, 867 K": ("nitrogen", 867.0, 0.06, 0.41, 7.0, 100.0, 0.5),
    "SANA in helium, coldest": ("helium", 423.0, 0.06, 0.41, 4.0, 100.0, 0.5),
    "SANA in helium, hottest": ("helium", 1110.0, 0.06, 0.41, 13.3, 100.0, 0.5),
}

for title, (name, temperature, diameter, porosity, bed, drop, length) in CASES.items():
    gas = gas_state(name, temperature, 1e5)
    density = gas.pressure * gas.molar_mass / (GAS_CONSTANT * temperature)
    permeability = diameter**2 * porosity**3 / (150.0 * (1.0 - porosity) ** 2)
    viscosity, diffusivity = gas.viscosity / density, bed / (density * gas.heat_capacity)
    number = 9.81 * drop * permeability * length / (temperature * viscosity * diffusivity)
    print(f"{title}: Ra = {number:.2g} for {drop:g} K over {length:g} m")

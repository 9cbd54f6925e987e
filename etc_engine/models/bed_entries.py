"""The records of the models of packed beds and of networks."""

from __future__ import annotations

import math

from etc_engine.models import granular, heated_beds, networks
from etc_engine.models.model import (
    ANY_CONDUCTIVITY,
    FROM_ZERO,
    POSITIVE,
    UNIT,
    Input,
    Interval,
    Model,
)

W_MK = "W/(m K)"

FLUID = Input("k1", "conductivity of the fluid", W_MK, POSITIVE)
SOLID = Input("k2", "conductivity of the solid", W_MK, POSITIVE)
SOLID_FRACTION = Input("fraction", "solid fraction", "-", UNIT)
BED = (FLUID, SOLID, SOLID_FRACTION)

SPACING = Input("spacing", "centre distance over particle diameter (beta)", "-", POSITIVE)
SHAPE = Input("shape_factor", "C: 1.25 spheres, 1.4 broken particles, 2.5 cylinders", "-", POSITIVE)

DIAMETER = Input("diameter", "particle diameter", "m", POSITIVE)
TEMPERATURE = Input("temperature", "absolute temperature", "K", POSITIVE)
EMISSIVITY = Input("emissivity", "emissivity of the particles", "-", UNIT)
EMITTING = Input("emissivity", "emissivity of the particles", "-", Interval(0.0, 1.0, "high"))
POROUS = Input("fraction", "solid fraction", "-", Interval(0.0, 1.0, "none"))

GRANULAR = (
    Model(
        "zehner_schluender",
        "Zehner-Schlünder (Schluender)",
        granular.zehner_schluender,
        (3,),
        "estimate",
        (*BED, SHAPE),
        "point contacts, k2/k1 up to about 2000, no radiation",
        "k1 and k2 for the pure phases",
        "Zehner and Schlünder, Chem. Ing. Tech. 42, 933 (1970), 10.1002/cite.330421408",
    ),
    Model(
        "zbs_contact",
        "Zehner-Bauer-Schlünder (ZBS) with contact area",
        granular.zbs_contact,
        (3,),
        "estimate",
        (
            *BED,
            Input("contact_fraction", "flattening coefficient (0.0077 ceramic spheres)", "-", UNIT),
            SHAPE,
        ),
        "stagnant continuum gas, no radiation",
        "Zehner-Schlünder for contact_fraction = 0",
        "Bauer and Schlünder, Int. Chem. Eng. 18, 189 (1978)",
    ),
    Model(
        "kunii_smith",
        "Kunii-Smith",
        granular.kunii_smith,
        (3,),
        "estimate",
        (*BED, SPACING),
        "porosity 0.26 to 0.476 (film thickness constant outside), no radiation",
        "k1 for equal phases with spacing 1; k1 without solid",
        "Kunii and Smith, AIChE J. 6, 71 (1960), 10.1002/aic.690060115",
    ),
    Model(
        "yagi_kunii",
        "Yagi-Kunii (stagnant, no radiation)",
        granular.yagi_kunii,
        (3,),
        "estimate",
        (
            *BED,
            Input("film_thickness", "effective film thickness over diameter (0.034 spheres)", "-", POSITIVE),
            SPACING,
            Input("solid_length", "conduction length in the solid over diameter", "-", POSITIVE),
        ),
        "packed beds of solid fraction near 0.6; leaves out the open voids",
        "k1 beta f/film_thickness for superconducting particles",
        "Yagi and Kunii, AIChE J. 3, 373 (1957), equation 15, 10.1002/aic.690030317",
    ),
    Model(
        "krupiczka",
        "Krupiczka",
        granular.krupiczka,
        (3,),
        "estimate",
        (FLUID, SOLID, Input("fraction", "solid fraction", "-", Interval(0.0, 1.0, "low"))),
        "porosity 0.215 to 0.476, k2/k1 up to about 2000",
        "k1 for equal phases",
        "Krupiczka, Int. Chem. Eng. 7, 122 (1967)",
    ),
    Model(
        "woodside_messmer",
        "Woodside-Messmer (three resistors)",
        granular.woodside_messmer,
        (3,),
        "estimate",
        (*BED, Input("fluid_in_series", "fluid in series with the solid", "-", Interval(0.0, 1.0, "none"))),
        "unconsolidated sands; solid fraction up to 1 - fluid_in_series",
        "k1 for equal phases",
        "Woodside and Messmer, J. Appl. Phys. 32, 1688 (1961), 10.1063/1.1728419",
    ),
    Model(
        "hadley",
        "Hadley",
        granular.hadley,
        (3,),
        "estimate",
        (FLUID, SOLID, Input("fraction", "solid fraction", "-", Interval(0.42, 1.0))),
        "packed metal powders, porosity up to 0.58",
        "k1 for equal phases; k2 without pores",
        "Hadley, Int. J. Heat Mass Transfer 29, 909 (1986), 10.1016/0017-9310(86)90186-9",
    ),
    Model(
        "batchelor_obrien",
        "Batchelor-O'Brien",
        granular.batchelor_obrien,
        (3,),
        "estimate",
        (FLUID, SOLID),
        "random beds of touching spheres, solid fraction near 0.63, k2/k1 from about 1000, none below e^3",
        "grows as 4 ln(k2/k1)",
        "Batchelor and O'Brien, Proc. R. Soc. Lond. A 355, 313 (1977), 10.1098/rspa.1977.0100",
    ),
    Model(
        "zehner_bauer_schluender",
        "Zehner-Bauer-Schlünder (ZBS) with contact, rarefied gas and radiation",
        heated_beds.zehner_bauer_schluender,
        (3,),
        "estimate",
        (
            FLUID,
            SOLID,
            Input("fraction", "solid fraction", "-", Interval(0.0, 1.0, "low")),
            DIAMETER,
            TEMPERATURE,
            EMISSIVITY,
            Input("jump_length", "temperature jump length of one surface; inf in vacuum", "m", ANY_CONDUCTIVITY),
            Input("contact_fraction", "flattening coefficient (0.0077 ceramic spheres)", "-", UNIT),
            SHAPE,
        ),
        "stagnant gas of any pressure, k2/k1 up to about 2000",
        "ZBS with contact area without radiation in a continuum gas; Breitbach-Barthels in vacuum with emissivity 1",
        "Bauer and Schlünder, Int. Chem. Eng. 18, 189 (1978); VDI Heat Atlas (2010), D6.3",
    ),
    Model(
        "breitbach_barthels",
        "Breitbach-Barthels (radiation alone)",
        heated_beds.breitbach_barthels,
        (3,),
        "estimate",
        (SOLID, POROUS, DIAMETER, TEMPERATURE, EMITTING),
        "radiation of a pebble bed: gas and contacts are left out (k1 is not used)",
        "grows as T^3 for a solid of high conductivity",
        "Breitbach and Barthels, Nucl. Technol. 49, 392 (1980), 10.13182/NT80-A17687",
    ),
    Model(
        "kunii_smith_radiation",
        "Kunii-Smith with radiation",
        heated_beds.kunii_smith_radiation,
        (3,),
        "estimate",
        (FLUID, SOLID, POROUS, DIAMETER, TEMPERATURE, EMITTING, SPACING),
        "porosity 0.26 to 0.476 (film thickness constant outside), continuum gas",
        "Kunii-Smith at low temperature",
        "Kunii and Smith, AIChE J. 6, 71 (1960), 10.1002/aic.690060115",
    ),
    Model(
        "hsu_cubes",
        "Hsu-Cheng-Wong, touching cubes",
        heated_beds.hsu_cubes,
        (3,),
        "estimate",
        (*BED, Input("contact_width", "width of the contact plates over that of the cubes", "-", UNIT)),
        "packed beds with finite contact area",
        "k1 and k2 for the pure phases, k1 for equal phases",
        "Hsu, Cheng and Wong, J. Heat Transfer 117, 264 (1995), 10.1115/1.2822515",
    ),
    Model(
        "hsu_square_cylinders",
        "Hsu-Cheng-Wong, touching square cylinders",
        heated_beds.hsu_square_cylinders,
        (2,),
        "estimate",
        (*BED, Input("contact_width", "width of the contact plates over that of the cylinders", "-", UNIT)),
        "packed beds with finite contact area",
        "k1 and k2 for the pure phases, k1 for equal phases",
        "Hsu, Cheng and Wong, J. Heat Transfer 117, 264 (1995), 10.1115/1.2822515",
    ),
    Model(
        "hamilton_crosser",
        "Hamilton-Crosser",
        heated_beds.hamilton_crosser,
        (3,),
        "estimate",
        (*BED, Input("sphericity", "psi: 1 for spheres", "-", Interval(0.0, 1.0, "high"))),
        "dispersions of particles of any shape",
        "Maxwell's formula for spheres (sphericity 1)",
        "Hamilton and Crosser, Ind. Eng. Chem. Fundam. 1, 187 (1962), 10.1021/i160003a005",
    ),
)

NETWORKS = (
    Model(
        "contact_mean_field",
        "Contact mean field (affine temperature on the contact network)",
        networks.contact_mean_field,
        (2, 3),
        "estimate",
        (
            Input("fraction", "density: full particle measures over that of the box", "-", UNIT),
            Input("coordination", "mean coordination number", "-", FROM_ZERO),
            Input("conductance_distance2", "mean of C d^2 over contacts", "W m/K (2D), W m2/K (3D)", FROM_ZERO),
            Input("radius_moment", "mean of R^2 (2D) or R^3 (3D) over particles", "m2 (2D), m3 (3D)", POSITIVE),
        ),
        "an upper bound (half or third of the trace) of the periodic network of those conductances; pores insulate",
        "phi Z C/pi (2D), phi Z C/(2 pi R) (3D) for equal touching particles",
        "Batchelor and O'Brien, Proc. R. Soc. Lond. A 355, 313 (1977), 10.1098/rspa.1977.0100",
    ),
    Model(
        "kirkpatrick",
        "Kirkpatrick network effective medium",
        networks.kirkpatrick,
        (2, 3),
        "estimate",
        (
            Input("k1", "conductivity with all bonds of kind 1", W_MK, ANY_CONDUCTIVITY),
            Input("k2", "conductivity with all bonds of kind 2", W_MK, ANY_CONDUCTIVITY),
            Input("fraction", "number fraction of bonds of kind 2", "-", UNIT),
            Input("coordination", "coordination number z", "-", Interval(2.0, math.inf, "low")),
        ),
        "random bonds, away from the threshold",
        "percolates at f = 2/z; z = 2 is series, z = 2 dimension the symmetric effective medium",
        "Kirkpatrick, Rev. Mod. Phys. 45, 574 (1973), 10.1103/RevModPhys.45.574",
    ),
    Model(
        "percolation_power_law",
        "Percolation power law",
        networks.percolation_power_law,
        (2, 3),
        "estimate",
        (
            Input("k2", "conductivity of the conducting phase", W_MK, FROM_ZERO),
            Input("fraction", "fraction of the conducting phase", "-", UNIT),
            Input("threshold", "percolation threshold", "-", Interval(0.0, 1.0, "low")),
            Input("exponent", "t (left out: 1.30 in 2D, 2.0 in 3D)", "-", POSITIVE),
        ),
        "near the threshold of a conducting phase in an insulating one (k1 is not used)",
        "0 up to the threshold, k2 at f = 1",
        "Stauffer and Aharony, Introduction to Percolation Theory, 2nd ed. (1992)",
    ),
)

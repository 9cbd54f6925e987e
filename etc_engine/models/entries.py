"""The records of all models, family by family; those of beds and networks are in `bed_entries`."""

from __future__ import annotations

from etc_engine.models import (
    arrays,
    bounds,
    effective_media,
    filled_polymers,
    lattice_sums,
    statistical,
)
from etc_engine.models.bed_entries import GRANULAR, NETWORKS
from etc_engine.models.model import (
    ANY_CONDUCTIVITY,
    FROM_ZERO,
    POSITIVE,
    POSITIVE_OR_INFINITE,
    UNIT,
    Input,
    Interval,
    Model,
)

W_MK = "W/(m K)"

K1 = Input("k1", "conductivity of phase 1 (matrix, pores)", W_MK, ANY_CONDUCTIVITY)
K2 = Input("k2", "conductivity of phase 2 (inclusions, solid)", W_MK, ANY_CONDUCTIVITY)
FRACTION = Input("fraction", "volume fraction of phase 2", "-", UNIT)
PHASES = (K1, K2, FRACTION)

MATRIX = Input("k1", "conductivity of the matrix", W_MK, POSITIVE)
ZETA2 = Input("zeta2", "three-point parameter of phase 2 (left out: random hard disks or spheres)", "-", UNIT)


def _array_inputs(lattice: lattice_sums.Lattice) -> tuple[Input, ...]:
    below_touching = Interval(0.0, lattice.touching_fraction, "low")
    return K1, K2, Input("fraction", "fraction of the particles, below touching", "-", below_touching)


BOUNDS = (
    Model(
        "series",
        "Series (Wiener lower bound)",
        "series",
        bounds.series,
        (2, 3),
        "lower bound",
        PHASES,
        "any two-phase medium",
        "0 as soon as one phase insulates",
        "Wiener, Abh. Sächs. Ges. Wiss. 32, 507 (1912)",
    ),
    Model(
        "parallel",
        "Parallel (Wiener upper bound)",
        "parallel",
        bounds.parallel,
        (2, 3),
        "upper bound",
        PHASES,
        "any two-phase medium",
        "f k2 for insulating pores",
        "Wiener, Abh. Sächs. Ges. Wiss. 32, 507 (1912)",
    ),
    Model(
        "hashin_shtrikman_lower",
        "Hashin-Shtrikman lower bound",
        "Hashin-Shtrikman lower",
        bounds.hashin_shtrikman_lower,
        (2, 3),
        "lower bound",
        PHASES,
        "isotropic two-phase media; not networks of bonded contacts",
        "Maxwell for k2 >= k1; 0 as soon as one phase insulates",
        "Hashin and Shtrikman, J. Appl. Phys. 33, 3125 (1962), 10.1063/1.1728579",
    ),
    Model(
        "hashin_shtrikman_upper",
        "Hashin-Shtrikman upper bound",
        "Hashin-Shtrikman upper",
        bounds.hashin_shtrikman_upper,
        (2, 3),
        "upper bound",
        PHASES,
        "isotropic two-phase media; not networks of bonded contacts",
        "inverse Maxwell for k2 >= k1; k2 f/(2 - f) (2D), 2 k2 f/(3 - f) (3D) for insulating pores",
        "Hashin and Shtrikman, J. Appl. Phys. 33, 3125 (1962), 10.1063/1.1728579",
    ),
    Model(
        "three_point_lower",
        "Three-point lower bound",
        "three-point lower",
        statistical.three_point_lower,
        (2, 3),
        "lower bound",
        (*PHASES, ZETA2),
        "isotropic media of that zeta2; the default: equal hard disks or spheres at random",
        "Hashin-Shtrikman lower for zeta2 = 0 and k2 > k1, upper for zeta2 = 1",
        "Milton, Phys. Rev. Lett. 46, 542 (1981), 10.1103/PhysRevLett.46.542; zeta2 of spheres: Miller and "
        "Torquato, J. Appl. Phys. 68, 5486 (1990), 10.1063/1.347007",
    ),
    Model(
        "three_point_upper",
        "Three-point upper bound",
        "three-point upper",
        statistical.three_point_upper,
        (2, 3),
        "upper bound",
        (*PHASES, ZETA2),
        "isotropic media of that zeta2; the default: equal hard disks or spheres at random",
        "Hashin-Shtrikman lower for zeta2 = 0 and k2 > k1, upper for zeta2 = 1",
        "Milton, Phys. Rev. Lett. 46, 542 (1981), 10.1103/PhysRevLett.46.542; zeta2 of spheres: Miller and "
        "Torquato, J. Appl. Phys. 68, 5486 (1990), 10.1063/1.347007",
    ),
)

EFFECTIVE_MEDIA = (
    Model(
        "maxwell",
        "Maxwell",
        "Maxwell",
        effective_media.maxwell,
        (2, 3),
        "estimate",
        PHASES,
        "dilute or well separated inclusions; exact to first order in the fraction",
        "0 for an insulating matrix",
        "Maxwell, A Treatise on Electricity and Magnetism (1873), article 314",
    ),
    Model(
        "maxwell_inverse",
        "Inverse Maxwell (Maxwell-Eucken with pores as inclusions)",
        "inverse Maxwell",
        effective_media.maxwell_inverse,
        (2, 3),
        "estimate",
        PHASES,
        "well separated pores in a connected solid",
        "k2 f/(2 - f) (2D), 2 k2 f/(3 - f) (3D) for insulating pores",
        "Eucken, Forsch. Gebiete Ingenieurwes. B3, Forschungsheft 353 (1932)",
    ),
    Model(
        "effective_medium",
        "Effective medium (symmetric Bruggeman)",
        "Bruggeman, symmetric",
        effective_media.effective_medium,
        (2, 3),
        "estimate",
        PHASES,
        "media that treat both phases alike, away from the threshold",
        "percolates at f = 1/dimension: k2 (2f - 1) (2D), k2 (3f - 1)/2 (3D) for insulating pores",
        "Bruggeman, Ann. Phys. 416, 636 (1935), 10.1002/andp.19354160705; Landauer, J. Appl. Phys. 23, 779 "
        "(1952), 10.1063/1.1702301",
    ),
    Model(
        "differential",
        "Differential medium (asymmetric Bruggeman)",
        "Bruggeman, differential",
        effective_media.differential,
        (2, 3),
        "estimate",
        PHASES,
        "inclusions of very different sizes in a connected matrix",
        "k1/(1 - f)^dimension for superconducting inclusions; 0 for an insulating matrix",
        "Bruggeman, Ann. Phys. 416, 636 (1935), 10.1002/andp.19354160705",
    ),
    Model(
        "differential_inverse",
        "Inverse differential medium (pores as inclusions)",
        "Bruggeman, pores in solid",
        effective_media.differential_inverse,
        (2, 3),
        "estimate",
        PHASES,
        "pores of very different sizes in a connected solid",
        "Archie's k2 f^2 (2D), k2 f^1.5 (3D) for insulating pores",
        "Bruggeman, Ann. Phys. 416, 636 (1935), 10.1002/andp.19354160705",
    ),
    Model(
        "hasselman_johnson",
        "Hasselman-Johnson (interface resistance)",
        "Hasselman-Johnson",
        effective_media.hasselman_johnson,
        (2, 3),
        "estimate",
        (
            *PHASES,
            Input("radius", "inclusion radius", "m", POSITIVE_OR_INFINITE),
            Input("interface_conductance", "interface conductance per area", "W/(m2 K)", ANY_CONDUCTIVITY),
        ),
        "dilute or well separated inclusions of one size",
        "Maxwell for perfect interfaces, Maxwell with holes for insulating ones",
        "Hasselman and Johnson, J. Compos. Mater. 21, 508 (1987), 10.1177/002199838702100602",
    ),
    Model(
        "third_order",
        "Third-order approximation (Torquato)",
        "third order (Torquato)",
        statistical.third_order,
        (2, 3),
        "estimate",
        (*PHASES, ZETA2),
        "particles without large clusters, any contrast; default zeta2: random equal hard disks or spheres",
        "Maxwell for zeta2 = 0; 0 for an insulating matrix",
        "Torquato, J. Appl. Phys. 58, 3790 (1985), 10.1063/1.335593",
    ),
    Model(
        "lewis_nielsen",
        "Lewis-Nielsen",
        "Lewis-Nielsen",
        filled_polymers.lewis_nielsen,
        (2, 3),
        "estimate",
        (
            MATRIX,
            K2,
            FRACTION,
            Input("shape_factor", "A (left out: 0.5 in 2D, 1.5 in 3D)", "-", POSITIVE),
            Input("maximum_fraction", "phi_m (left out: 0.82 in 2D, 0.637 in 3D)", "-", Interval(0, 1, "high")),
        ),
        "filled polymers up to the maximum fraction; with A = 1.5 it breaks the lower Hashin-Shtrikman bound "
        "at small fractions",
        "Maxwell for A = dimension - 1 and phi_m = 1",
        "Lewis and Nielsen, J. Appl. Polym. Sci. 14, 1449 (1970), 10.1002/app.1970.070140604; Nielsen, Ind. "
        "Eng. Chem. Fundam. 13, 17 (1974), 10.1021/i160049a004",
    ),
    Model(
        "agari_uno",
        "Agari-Uno (geometric mean)",
        "Agari-Uno",
        filled_polymers.agari_uno,
        (2, 3),
        "estimate",
        (
            MATRIX,
            Input("k2", "conductivity of the filler", W_MK, POSITIVE),
            FRACTION,
            Input("matrix_factor", "C1, effect on the matrix", "-", POSITIVE),
            Input("chain_factor", "C2, ease of forming chains", "-", FROM_ZERO),
        ),
        "filled polymers, constants fitted to data in W/(m K)",
        "geometric mean for C1 = C2 = 1; C1 k1 at f = 0",
        "Agari and Uno, J. Appl. Polym. Sci. 32, 5705 (1986), 10.1002/app.1986.070320702",
    ),
    Model(
        "russell",
        "Russell (cubes)",
        "Russell",
        filled_polymers.russell,
        (3,),
        "estimate",
        (MATRIX, K2, FRACTION),
        "equal cubes in simple cubic order; pores of ceramics",
        "k1 (1 - f^(2/3))/(1 - f^(2/3) + f) for insulating cubes",
        "Russell, J. Am. Ceram. Soc. 18, 1 (1935), 10.1111/j.1151-2916.1935.tb19340.x",
    ),
)

PLANE_VALIDITY = (
    "non-touching equal disks in that order; converged to 1e-9 for any contrast up to 0.999 of the touching "
    "radius, beyond that to 1e-9 for contrasts up to 10"
)
SPACE_VALIDITY = (
    "non-touching equal spheres in that order; converged to 1e-8 for any contrast up to 0.99 of the touching "
    "radius; at 0.999 to 1e-6 for contrast 10 and 2e-3 for superconducting spheres"
)
PERRINS = "Perrins, McKenzie and McPhedran, Proc. R. Soc. Lond. A 369, 207 (1979), 10.1098/rspa.1979.0160"
MCKENZIE = "McKenzie, McPhedran and Derrick, Proc. R. Soc. Lond. A 362, 211 (1978), 10.1098/rspa.1978.0129"

ARRAYS = (
    Model(
        "square_array",
        "Square array of disks",
        "square array",
        arrays.square_array,
        (2,),
        "exact",
        _array_inputs(lattice_sums.SQUARE),
        PLANE_VALIDITY,
        "duality k(k1, k2) k(k2, k1) = k1 k2; touches at pi/4",
        PERRINS,
    ),
    Model(
        "hexagonal_array",
        "Hexagonal array of disks",
        "hexagonal array",
        arrays.hexagonal_array,
        (2,),
        "exact",
        _array_inputs(lattice_sums.HEXAGONAL),
        PLANE_VALIDITY,
        "duality k(k1, k2) k(k2, k1) = k1 k2; touches at pi/sqrt(12)",
        PERRINS,
    ),
    Model(
        "simple_cubic",
        "Simple cubic array of spheres",
        "simple cubic array",
        arrays.simple_cubic,
        (3,),
        "exact",
        _array_inputs(lattice_sums.SIMPLE_CUBIC),
        SPACE_VALIDITY,
        "departs from Maxwell at order f^(13/3); touches at pi/6",
        "McPhedran and McKenzie, Proc. R. Soc. Lond. A 359, 45 (1978), 10.1098/rspa.1978.0031",
    ),
    Model(
        "bcc",
        "Body-centred cubic array of spheres",
        "body-centred cubic",
        arrays.bcc,
        (3,),
        "exact",
        _array_inputs(lattice_sums.BCC),
        SPACE_VALIDITY,
        "departs from Maxwell at order f^(13/3); touches at pi sqrt(3)/8",
        MCKENZIE,
    ),
    Model(
        "fcc",
        "Face-centred cubic array of spheres",
        "face-centred cubic",
        arrays.fcc,
        (3,),
        "exact",
        _array_inputs(lattice_sums.FCC),
        SPACE_VALIDITY,
        "departs from Maxwell at order f^(13/3); touches at pi/sqrt(18)",
        MCKENZIE,
    ),
)

ENTRIES = (*BOUNDS, *EFFECTIVE_MEDIA, *ARRAYS, *GRANULAR, *NETWORKS)

# Effective thermal conductivity [W/(m K)] of the bed of study 'Li2TiO3 pebbles in helium'.
# Mean over realizations; intervals of 95 % (Student's t).
# source: etc_engine 0.1.0, engine dtem
# commit: 133580a6f98ae174dd1f16758a022b72fca0a7d0-dirty
# study_digest: 43656ef15c16fb85752ff3acda5e7ad4e72aa1d27afe8d1a06cc08e30e82a856
# In functions, t is the temperature [K]: HeatConductionMaterial passes it as the time.
[Functions]
  [Li2TiO3_pebbles_in_helium_0_table]
    # density = 0.61, bond_gap = 1e-06, contact_resistance = 0, youngs_modulus = 1.26e+11, poisson_ratio = 0.24, load = 100000, pressure = 100, accommodation = 0.43, emissivity = 0.8; half-widths 0.000166 0.000195 0.000231 0.000275 0.000327
    type = PiecewiseLinear
    x = '700 800 900 1000 1100' # K
    y = '0.11016657130654028 0.13113575411986772 0.15862679028075427 0.19288246197249251 0.23414812125249462' # W/(m K)
  []
  [Li2TiO3_pebbles_in_helium_0_fit]
    # Fit of order 2 from 700 to 1100 K: largest residual 0.000108 W/(m K), 0.41 of the half-width, within every interval.
    type = ParsedFunction
    expression = '(0.15278790348942523) + (-0.0002966369025806558)*t^1 + (3.3683935915632263e-07)*t^2'
  []
  [Li2TiO3_pebbles_in_helium_1_table]
    # density = 0.61, bond_gap = 1e-06, contact_resistance = 0, youngs_modulus = 1.26e+11, poisson_ratio = 0.24, load = 100000, pressure = 1000, accommodation = 0.43, emissivity = 0.8; half-widths 0.000395 0.000412 0.000433 0.000461 0.000497
    type = PiecewiseLinear
    x = '700 800 900 1000 1100' # K
    y = '0.31687936590825833 0.32663725713182845 0.34283518134958696 0.3660205082605652 0.39668960783993512' # W/(m K)
  []
  [Li2TiO3_pebbles_in_helium_1_fit]
    # Fit of order 2 from 700 to 1100 K: largest residual 0.000214 W/(m K), 0.48 of the half-width, within every interval.
    type = ParsedFunction
    expression = '(0.44533414449908237) + (-0.00042670213801298352)*t^1 + (3.4760203723662971e-07)*t^2'
  []
  [Li2TiO3_pebbles_in_helium_2_table]
    # density = 0.61, bond_gap = 1e-06, contact_resistance = 0, youngs_modulus = 1.26e+11, poisson_ratio = 0.24, load = 100000, pressure = 10000, accommodation = 0.43, emissivity = 0.8; half-widths 0.000245 0.000295 0.000396 0.000494 0.000584
    type = PiecewiseLinear
    x = '700 800 900 1000 1100' # K
    y = '0.70918142949841112 0.72889666980634982 0.75283706766508252 0.78254937979571804 0.81912686012218383' # W/(m K)
  []
  [Li2TiO3_pebbles_in_helium_2_fit]
    # Fit of order 3 from 700 to 1100 K: largest residual 3.9e-05 W/(m K), 0.095 of the half-width, within every interval.
    type = ParsedFunction
    expression = '(0.57803139310436413) + (0.00030500564722260761)*t^1 + (-3.256521871473147e-07)*t^2 + (2.2512549922773326e-10)*t^3'
  []
  [Li2TiO3_pebbles_in_helium_3_table]
    # density = 0.61, bond_gap = 1e-06, contact_resistance = 0, youngs_modulus = 1.26e+11, poisson_ratio = 0.24, load = 100000, pressure = 100000, accommodation = 0.43, emissivity = 0.8; half-widths 0.00133 0.00101 0.000791 0.000653 0.000577
    type = PiecewiseLinear
    x = '700 800 900 1000 1100' # K
    y = '0.85684756392906125 0.88918843699279992 0.92668743223625361 0.97153190839581993 1.0252584427713201' # W/(m K)
  []
  [Li2TiO3_pebbles_in_helium_3_fit]
    # Fit of order 2 from 700 to 1100 K: largest residual 0.000831 W/(m K), 0.82 of the half-width, within every interval.
    type = ParsedFunction
    expression = '(0.85114487613209278) + (-0.00025107709255881445)*t^1 + (3.7199166926226433e-07)*t^2'
  []
  [Li2TiO3_pebbles_in_helium_4_table]
    # density = 0.61, bond_gap = 1e-06, contact_resistance = 0, youngs_modulus = 1.26e+11, poisson_ratio = 0.24, load = 100000, pressure = 300000, accommodation = 0.43, emissivity = 0.8; half-widths 0.00157 0.00123 0.000994 0.000847 0.000767
    type = PiecewiseLinear
    x = '700 800 900 1000 1100' # K
    y = '0.87234718624602581 0.90620575916054869 0.94544841543228753 0.99236752827935815 1.0485926015483491' # W/(m K)
  []
  [Li2TiO3_pebbles_in_helium_4_fit]
    # Fit of order 2 from 700 to 1100 K: largest residual 0.000871 W/(m K), 0.71 of the half-width, within every interval.
    type = ParsedFunction
    expression = '(0.86445362340484122) + (-0.00025848954366242545)*t^1 + (3.8698794909130621e-07)*t^2'
  []
[]
[Materials]
  [Li2TiO3_pebbles_in_helium_0]
    # density = 0.61, bond_gap = 1e-06, contact_resistance = 0, youngs_modulus = 1.26e+11, poisson_ratio = 0.24, load = 100000, pressure = 100, accommodation = 0.43, emissivity = 0.8; set temp to your temperature variable
    type = HeatConductionMaterial
    temp = temperature
    thermal_conductivity_temperature_function = Li2TiO3_pebbles_in_helium_0_table
  []
  [Li2TiO3_pebbles_in_helium_1]
    # density = 0.61, bond_gap = 1e-06, contact_resistance = 0, youngs_modulus = 1.26e+11, poisson_ratio = 0.24, load = 100000, pressure = 1000, accommodation = 0.43, emissivity = 0.8; set temp to your temperature variable
    type = HeatConductionMaterial
    temp = temperature
    thermal_conductivity_temperature_function = Li2TiO3_pebbles_in_helium_1_table
  []
  [Li2TiO3_pebbles_in_helium_2]
    # density = 0.61, bond_gap = 1e-06, contact_resistance = 0, youngs_modulus = 1.26e+11, poisson_ratio = 0.24, load = 100000, pressure = 10000, accommodation = 0.43, emissivity = 0.8; set temp to your temperature variable
    type = HeatConductionMaterial
    temp = temperature
    thermal_conductivity_temperature_function = Li2TiO3_pebbles_in_helium_2_table
  []
  [Li2TiO3_pebbles_in_helium_3]
    # density = 0.61, bond_gap = 1e-06, contact_resistance = 0, youngs_modulus = 1.26e+11, poisson_ratio = 0.24, load = 100000, pressure = 100000, accommodation = 0.43, emissivity = 0.8; set temp to your temperature variable
    type = HeatConductionMaterial
    temp = temperature
    thermal_conductivity_temperature_function = Li2TiO3_pebbles_in_helium_3_table
  []
  [Li2TiO3_pebbles_in_helium_4]
    # density = 0.61, bond_gap = 1e-06, contact_resistance = 0, youngs_modulus = 1.26e+11, poisson_ratio = 0.24, load = 100000, pressure = 300000, accommodation = 0.43, emissivity = 0.8; set temp to your temperature variable
    type = HeatConductionMaterial
    temp = temperature
    thermal_conductivity_temperature_function = Li2TiO3_pebbles_in_helium_4_table
  []
[]

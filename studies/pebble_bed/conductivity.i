# Effective thermal conductivity [W/(m K)] of the bed of study 'Li2TiO3 pebbles in helium'.
# Mean over realizations; intervals of 95 % (Student's t).
# source: etc_engine 0.2.0, engine dtem
# commit: 5153b461439faed729080b352848e79785d389e8
# study_digest: dfe773137204e0f7047135a9412547fbd92bdecf62bbc1ece074412170bb8436
# In functions, t is the temperature [K]: HeatConductionMaterial passes it as the time.
[Functions]
  [Li2TiO3_pebbles_in_helium_0_table]
    # density = 0.61, bond_gap = 1e-06, coordination = 5.5, contact_resistance = 0, youngs_modulus = 1.26e+11, poisson_ratio = 0.24, load = 100000, pressure = 100, accommodation = 0.43, emissivity = 0.8; half-widths 0.000166 0.000195 0.000231 0.000275 0.000327
    type = PiecewiseLinear
    x = '700 800 900 1000 1100' # K
    y = '0.11016650346889645 0.13113564946932621 0.15862662833573096 0.19288221703291822 0.23414776158210948' # W/(m K)
  []
  [Li2TiO3_pebbles_in_helium_0_fit]
    # Fit of order 2 from 700 to 1100 K: largest residual 0.000108 W/(m K), 0.41 of the half-width, within every interval.
    type = ParsedFunction
    expression = '(0.15278733479094253) + (-0.00029663527179244929)*t^1 + (3.3683804956247562e-07)*t^2'
  []
  [Li2TiO3_pebbles_in_helium_1_table]
    # density = 0.61, bond_gap = 1e-06, coordination = 5.5, contact_resistance = 0, youngs_modulus = 1.26e+11, poisson_ratio = 0.24, load = 100000, pressure = 1000, accommodation = 0.43, emissivity = 0.8; half-widths 0.000395 0.000412 0.000433 0.000462 0.000497
    type = PiecewiseLinear
    x = '700 800 900 1000 1100' # K
    y = '0.31687846435925132 0.32663631078448335 0.34283416865175725 0.36601940426618845 0.39668838475747537' # W/(m K)
  []
  [Li2TiO3_pebbles_in_helium_1_fit]
    # Fit of order 2 from 700 to 1100 K: largest residual 0.000214 W/(m K), 0.48 of the half-width, within every interval.
    type = ParsedFunction
    expression = '(0.44533285047492666) + (-0.00042670071165916104)*t^1 + (3.4760079958701506e-07)*t^2'
  []
  [Li2TiO3_pebbles_in_helium_2_table]
    # density = 0.61, bond_gap = 1e-06, coordination = 5.5, contact_resistance = 0, youngs_modulus = 1.26e+11, poisson_ratio = 0.24, load = 100000, pressure = 10000, accommodation = 0.43, emissivity = 0.8; half-widths 0.000245 0.000295 0.000396 0.000494 0.000584
    type = PiecewiseLinear
    x = '700 800 900 1000 1100' # K
    y = '0.70917683164839695 0.72889174994411565 0.75283184598249175 0.78254386551718602 0.81912105348255571' # W/(m K)
  []
  [Li2TiO3_pebbles_in_helium_2_fit]
    # Fit of order 3 from 700 to 1100 K: largest residual 3.9e-05 W/(m K), 0.095 of the half-width, within every interval.
    type = ParsedFunction
    expression = '(0.57803120029875887) + (0.00030499507209564409)*t^1 + (-3.2564407150552683e-07)*t^2 + (2.2512264128472333e-10)*t^3'
  []
  [Li2TiO3_pebbles_in_helium_3_table]
    # density = 0.61, bond_gap = 1e-06, coordination = 5.5, contact_resistance = 0, youngs_modulus = 1.26e+11, poisson_ratio = 0.24, load = 100000, pressure = 100000, accommodation = 0.43, emissivity = 0.8; half-widths 0.00133 0.00101 0.00079 0.000653 0.000577
    type = PiecewiseLinear
    x = '700 800 900 1000 1100' # K
    y = '0.85684151886110715 0.88918199728024361 0.92668059501284317 0.97152465477148742 1.0252507409925797' # W/(m K)
  []
  [Li2TiO3_pebbles_in_helium_3_fit]
    # Fit of order 2 from 700 to 1100 K: largest residual 0.000831 W/(m K), 0.82 of the half-width, within every interval.
    type = ParsedFunction
    expression = '(0.85114203052200554) + (-0.00025108169116896554)*t^1 + (3.7199183509359499e-07)*t^2'
  []
  [Li2TiO3_pebbles_in_helium_4_table]
    # density = 0.61, bond_gap = 1e-06, coordination = 5.5, contact_resistance = 0, youngs_modulus = 1.26e+11, poisson_ratio = 0.24, load = 100000, pressure = 300000, accommodation = 0.43, emissivity = 0.8; half-widths 0.00157 0.00123 0.000994 0.000847 0.000766
    type = PiecewiseLinear
    x = '700 800 900 1000 1100' # K
    y = '0.87234098670718152 0.90619916744400708 0.94544142740572212 0.9923601222078714 1.0485847424772126' # W/(m K)
  []
  [Li2TiO3_pebbles_in_helium_4_fit]
    # Fit of order 2 from 700 to 1100 K: largest residual 0.000871 W/(m K), 0.71 of the half-width, within every interval.
    type = ParsedFunction
    expression = '(0.86445088459256003) + (-0.00025849477493355923)*t^1 + (3.86988484884649e-07)*t^2'
  []
[]
[Materials]
  [Li2TiO3_pebbles_in_helium_0]
    # density = 0.61, bond_gap = 1e-06, coordination = 5.5, contact_resistance = 0, youngs_modulus = 1.26e+11, poisson_ratio = 0.24, load = 100000, pressure = 100, accommodation = 0.43, emissivity = 0.8; set temp to your temperature variable
    type = HeatConductionMaterial
    temp = temperature
    thermal_conductivity_temperature_function = Li2TiO3_pebbles_in_helium_0_table
  []
  [Li2TiO3_pebbles_in_helium_1]
    # density = 0.61, bond_gap = 1e-06, coordination = 5.5, contact_resistance = 0, youngs_modulus = 1.26e+11, poisson_ratio = 0.24, load = 100000, pressure = 1000, accommodation = 0.43, emissivity = 0.8; set temp to your temperature variable
    type = HeatConductionMaterial
    temp = temperature
    thermal_conductivity_temperature_function = Li2TiO3_pebbles_in_helium_1_table
  []
  [Li2TiO3_pebbles_in_helium_2]
    # density = 0.61, bond_gap = 1e-06, coordination = 5.5, contact_resistance = 0, youngs_modulus = 1.26e+11, poisson_ratio = 0.24, load = 100000, pressure = 10000, accommodation = 0.43, emissivity = 0.8; set temp to your temperature variable
    type = HeatConductionMaterial
    temp = temperature
    thermal_conductivity_temperature_function = Li2TiO3_pebbles_in_helium_2_table
  []
  [Li2TiO3_pebbles_in_helium_3]
    # density = 0.61, bond_gap = 1e-06, coordination = 5.5, contact_resistance = 0, youngs_modulus = 1.26e+11, poisson_ratio = 0.24, load = 100000, pressure = 100000, accommodation = 0.43, emissivity = 0.8; set temp to your temperature variable
    type = HeatConductionMaterial
    temp = temperature
    thermal_conductivity_temperature_function = Li2TiO3_pebbles_in_helium_3_table
  []
  [Li2TiO3_pebbles_in_helium_4]
    # density = 0.61, bond_gap = 1e-06, coordination = 5.5, contact_resistance = 0, youngs_modulus = 1.26e+11, poisson_ratio = 0.24, load = 100000, pressure = 300000, accommodation = 0.43, emissivity = 0.8; set temp to your temperature variable
    type = HeatConductionMaterial
    temp = temperature
    thermal_conductivity_temperature_function = Li2TiO3_pebbles_in_helium_4_table
  []
[]

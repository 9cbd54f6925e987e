"""Cell element of spheres in a fluid: one Laguerre cell per sphere, any contrast and any gap."""

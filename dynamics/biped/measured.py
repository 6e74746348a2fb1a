"""placeholder"""

from stickslip.dynamics.biped.integrators import RK4Split
from stickslip.dynamics.biped.table import Table

MEASURED_ON = "nowhere"
SETTINGS = ((Table(pieces=32, degree=7), RK4Split(), 0.01, "float32"),)
COSTS = (("stick-slip", 0, 4096, 1e-5),)
ERRORS = {("stick-slip", 0, r): (((1e-5, 1e-5, 1e-5),) * 3, 0.0) for r in ("default", "others")}
SAMPLES = {("stick-slip", r): (1, 0.0) for r in ("default", "others")}

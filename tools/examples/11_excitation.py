"""Motion that excites the dynamics of an arm, and what it tells of them."""

import kr5
import numpy as np
from kr5 import cell, identification

believed = cell.load_cell(kr5.share("cells/kr5_arc.yaml"))
limits = identification.motion_limits(believed)
options = identification.ExcitationOptions(duration=20.0, lowest=0.1, starts=5, exchanges=200)
found = identification.design_excitation(believed, limits, options)

print(f"base parameters {found.base_parameters}")
print(f"condition number below 100: {'yes' if found.condition < 100 else 'no'}")
print(f"better than the best of the starts: {'yes' if found.condition < found.condition_after[0] else 'no'}")
motion = found.motion.sampled(0.012)
first, last = (abs(np.linalg.norm(motion.qd[row])) for row in (0, -1))
print(f"{len(motion.t)} samples, speeds at the ends {first:.3f} and {last:.3f} rad/s")

"""Where the tool tip of a cell stands, joint by joint."""

import kr5
import numpy as np
from kr5 import cell

arm = cell.load_cell(kr5.share("cells/kr5_arc.yaml"))
q = np.array([0.1, -0.5, -3.2, 0.2, 0.4, 0.3])
for T in arm.nominal_chain().link_poses(q):
    print("link at {:.2f} {:.2f} {:.2f} mm".format(*1e3 * np.asarray(T)[:3, 3]))
print("tip at {:.2f} {:.2f} {:.2f} mm".format(*1e3 * np.asarray(arm.T_base_tool(q))[:3, 3]))

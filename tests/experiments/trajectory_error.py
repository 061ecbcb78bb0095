"""How far a trajectory is from the truth, whatever the frames."""
import numpy as np


def ate(estimate, truth):
    """RMSE [m] of positions (n × 3) after rigid alignment (Umeyama without scale)."""
    e, g = estimate - estimate.mean(0), truth - truth.mean(0)
    U, _, Vt = np.linalg.svd(g.T @ e)
    R = U @ np.diag([1, 1, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    return float(np.sqrt((np.linalg.norm(g - e @ R.T, axis=1) ** 2).mean()))

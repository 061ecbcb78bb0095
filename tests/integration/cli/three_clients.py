"""The Python side of three_clients_test: uploads a scan, or prints what it sees of a map as JSON.

    three_clients.py upload|show HOST:PORT MAP
"""
import json
import sys

import numpy as np

import strata


def upload(world):
    """A square of 4 m beside the ramps, seen from 1 m above."""
    x, y = np.meshgrid(np.arange(-2, 2, 0.05), np.arange(-2, 2, 0.05))
    points = np.stack([x, y, np.full_like(x, -1.0)], axis=-1).reshape(-1, 3)
    ack = world.upload(points, pose=([30, 30, 1], [0, 0, 0, 1]), trajectory="python", sequence=1, align=False)
    return {"already_present": ack.already_present}


def show(world):
    stats = world.wait(timeout=60)
    return {"digest": stats.content_digest,
            "scans": [f"{scan.trajectory}/{scan.sequence}" for scan in world.scans()],
            "tiles": {str(key): [len(tile.surfaces), int((tile.surfaces["z"].astype(float) * 512).sum())]
                      for key, tile in world.fetch().items()}}


what, address, name = sys.argv[1:]
with strata.connect(address) as db:
    print(json.dumps({"upload": upload, "show": show}[what](db.map(name))))

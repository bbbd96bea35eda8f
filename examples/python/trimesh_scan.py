"""A noisy scan: Taubin's method removes the noise and keeps the volume.

Needs: trimesh
"""

import numpy as np
import trimesh

import meshsmooth as ms

scan = trimesh.creation.icosphere(subdivisions=4)
noise = np.random.default_rng(1).normal(scale=0.01, size=len(scan.vertices))
scan.vertices += noise[:, None] * scan.vertex_normals

clean = ms.smooth(scan, method=ms.Taubin(), boundary="free", guard=False, iterations=30)


def roughness(mesh: trimesh.Trimesh) -> float:
    """The mean angle between neighbouring facets, in degrees."""
    return float(np.degrees(mesh.face_adjacency_angles).mean())


clean.export("clean.ply")
print(f"roughness {roughness(scan):.1f} -> {roughness(clean):.1f} degrees")
print(f"volume {scan.volume:.4f} -> {clean.volume:.4f}")

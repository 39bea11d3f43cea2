"""Moments of scans and distances of contacts, compared with trimesh."""

import numpy as np
import pytest

from algorithms.grasping import GraspStatus, plan_grasps
from generated import grasping
from tests.support.scans import NAMES, scan

trimesh = pytest.importorskip("trimesh")
pytestmark = pytest.mark.peers


@pytest.mark.parametrize("name", NAMES)
def test_moments(name):
    vertices, faces = scan(name)
    peer = trimesh.Trimesh(vertices, faces, process=False)
    _, volume, first, _ = grasping.mesh_moments(vertices, *np.ascontiguousarray(faces.T))
    assert peer.is_watertight
    assert np.isclose(volume, peer.volume, rtol=1e-9) and np.allclose(first / volume, peer.center_mass, atol=1e-9)


@pytest.mark.parametrize("name", ["Banana", "PowerDrill", "CrackerBox"])
def test_contacts_are_on_the_scan(name):
    vertices, faces = scan(name)
    plan = plan_grasps(vertices, faces, 1)
    assert plan.status == GraspStatus.OK
    normals = trimesh.Trimesh(vertices, faces, process=False).face_normals
    for grasp in plan:
        for point, normal in zip(grasp.contacts, grasp.normals, strict=True):
            nearest = trimesh.triangles.closest_point(vertices[faces], np.tile(point, (len(faces), 1)))
            gaps = np.linalg.norm(nearest - point, axis=1)
            assert np.nanmin(gaps) < 5e-5
            # The normal is that of a face at the contact, and points outwards.
            assert np.linalg.norm(normals[gaps < np.nanmin(gaps) + 5e-5] - normal, axis=1).min() < 1e-6

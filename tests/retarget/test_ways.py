"""What a source's ways do to another mesh: loose pieces go along, folds are evened out."""

import numpy as np

from capture.motion import arap, keys, triangulate
from retarget.characters.proposed import ways
from retarget.characters.proposed.hinged import parents_of

SQUARE = np.array([[0, 0], [100, 0], [100, 40], [0, 40]], float)


def test_a_loose_piece_goes_with_the_nearest_place_of_the_largest():
    mesh, faces = _bar()
    piece = np.array([[104, 0], [112, 0], [104, 8]], float)
    both, all_faces = np.vstack([mesh, piece]), np.vstack([faces, len(mesh) + np.arange(3)])
    quarter = np.tile([np.pi / 2, 1, 0, 0, 1], (1, len(all_faces), 1))
    moved, _ = ways.followed(both, all_faces, quarter)
    turned = both @ [[0, 1], [-1, 0]]  # a quarter turn, x towards y
    np.testing.assert_allclose(moved[0] - moved[0, 0], turned - turned[0], atol=1e-6)


def test_ways_that_would_fold_a_face_are_evened_out():
    mesh, faces = _bar()
    fields = np.tile([0.0, 1, 0, 0, 1], (1, len(faces), 1))
    middle = np.linalg.norm(mesh[faces].mean(axis=1) - (50, 20), axis=1).argmin()
    fields[0, middle] = [np.pi, 3, 0, 0, 3]
    rough = arap.follow(mesh, faces, fields[..., 0], fields[..., 1:].reshape(1, -1, 2, 2))
    moved, gone = ways.followed(mesh, faces, fields)
    assert ways.strain(mesh, rough, faces, fields)[1][0] > 0
    assert ways.strain(mesh, moved, faces, gone)[1][0] == 0


def test_a_limb_hangs_on_the_one_before_it_in_the_source():
    """A blob with an arm to its right: the hand hangs on the arm, the arm on the blob, in whatever order they come."""
    arm = [[60, 24], [60, 60], [0, 60], [0, -20], [60, -20], [60, 16], [200, 16], [200, 24]]
    outline = triangulate.resample(np.array(arm, float), 160)
    source = ways.ways_of(keys.keyset(("rest", "other"), np.stack([outline, outline + 5])))
    hand, forearm, upper = [190.0, 20], [140.0, 20], [90.0, 20]
    assert parents_of(source, np.array([hand, upper, forearm])) == [3, 0, 2]


def _bar():
    outlines, _, inside, faces = triangulate.triangulate(triangulate.resample(SQUARE, 56)[None], 5.0)
    return np.vstack([outlines[0], inside]), faces

"""Pictures bent by their mesh: every pixel asks the right triangle, nothing shines through, nothing is fetched afar."""

import numpy as np
import pytest

from capture.motion import triangulate
from retarget.characters.photos.picture import DrawnPicture, Layer, halved
from retarget.stage import warp
from retarget.stage.draw2d import draw_things
from retarget.stage.lay import lay

COLOR = (40, 90, 200)


def blob(count=120, radius=80.0, spacing=9.0):
    """A round mesh: points (N, 2) about (100, 100), faces and outline."""
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    outline = 100 + radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    outlines, loop, inside, faces = triangulate.triangulate(outline[None], spacing)
    return np.vstack([outlines[0], inside]), faces, loop


def bent(points, by):
    """Bent round into `by` radians of an arch about a point on the left, which squeezes one side to a third."""
    angle = (points[:, 1] - 100) / 160 * by
    radius = points[:, 0] - 100 + 160 / max(by, 1e-9)
    return np.stack([100 - 160 / max(by, 1e-9) + radius * np.cos(angle), 100 + radius * np.sin(angle)], axis=-1)


def shown(image, points, mesh, share=1.0, size=(200, 200)):
    still, faces, loop = mesh
    layer = Layer(halved(image), still, image.shape[1::-1])
    return draw_things([DrawnPicture(points, faces, (loop,), ((layer, share),), 1.0)], size)


@pytest.mark.parametrize("by", [0.01, 1.0, 2.5])
def test_one_colour_bent_hard_shows_no_other_colour_and_no_hole(by):
    from skimage import measure

    image = np.full((200, 200, 4), (*COLOR, 255), np.uint8)
    mesh = blob()
    page = shown(image, bent(mesh[0], by), mesh, size=(260, 260))
    seen = page[..., 3] > 0
    assert seen.sum() > 10_000
    assert (np.abs(page[seen][:, :3].astype(int) - COLOR) <= 1).all()  # the soft edge too
    holes = measure.label(page[..., 3] < 255, connectivity=1)
    assert holes.max() == 1  # what is not solid is outside, in one piece


def test_the_soft_edge_is_as_the_outline_covers_it():
    import shapely

    image = np.full((200, 200, 4), (*COLOR, 255), np.uint8)
    mesh = blob()
    points = bent(mesh[0], 1.5)
    page = shown(image, points, mesh, size=(260, 260))
    ring = shapely.Polygon(points[mesh[2]])
    assert page[..., 3].sum() / 255 == pytest.approx(ring.area, rel=2e-3)
    edge = np.argwhere((page[..., 3] > 20) & (page[..., 3] < 235))[::17, ::-1]
    covered = [ring.intersection(shapely.box(*(at - 0.5), *(at + 0.5))).area for at in edge]
    np.testing.assert_allclose(page[edge[:, 1], edge[:, 0], 3] / 255, covered, atol=0.02)


def test_every_pixel_finds_the_face_it_lies_in():
    points, faces, _ = blob(40, 30.0, 11.0)
    corners = bent(points, 1.0)[faces] - 60
    face = warp.face_of_pixels(corners, np.zeros(len(faces), bool), (80, 80))
    y, x = np.mgrid[:80, :80]
    inside = np.array([_shares(corner, x, y).min(axis=0) for corner in corners])
    clear = np.abs(inside).min(axis=0) > 0.01  # nobody's edge
    truth = np.where(inside.max(axis=0) > 0, inside.argmax(axis=0), -1)
    np.testing.assert_array_equal(face[clear], truth[clear])
    assert (face[~clear & (inside.max(axis=0) >= 0)] >= 0).all()  # an edge is one side's or the other's


def test_colours_are_those_that_opencv_finds_at_the_same_places():
    import cv2

    rng = np.random.default_rng(0)
    image = rng.random((60, 70, 4)).astype(np.float32)
    there = np.array([[[2.0, 3], [66, 5], [30, 58]]])
    here = np.array([[[10.0, 4], [75, 30], [20, 76]]])
    face = warp.face_of_pixels(here, np.zeros(1, bool), (80, 80))
    mixed = np.zeros((80, 80, 4), np.float32)
    warp.add_colors(face, here, there, image, 0.5, False, mixed)
    back = warp.inverse_maps(here, there)[0]
    np.testing.assert_allclose(here[0] @ back[:, :2].T + back[:, 2], there[0])
    expected = cv2.warpAffine(image, back, (80, 80), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
    np.testing.assert_allclose(mixed[face >= 0], 0.5 * expected[face >= 0], atol=0.02)  # OpenCV's steps are 1/32 pixel
    assert (mixed[face < 0] == 0).all()


def test_a_thin_triangle_at_the_border_fetches_nothing_from_afar():
    """Its map back into the picture is steep: half a pixel off its edge lies the other end of the picture."""
    image = np.zeros((200, 200, 4), np.uint8)
    image[..., 3], image[..., 1] = 255, 255
    image[:60, :60] = (255, 0, 0, 255)
    still = np.array([[10.0, 10], [50, 10], [50, 50], [10, 50]])
    faces, loop = np.array([[0, 1, 2], [0, 2, 3]]), np.arange(4)
    flat = np.array([[20.0, 20.4], [120, 20.1], [120, 20.3], [20, 20.6]])
    page = shown(image, flat, (still, faces, loop))
    assert page[..., 3].any()
    assert (page[page[..., 3] > 0][:, :3] == [255, 0, 0]).all()


def test_a_photograph_goes_on_beyond_its_border_and_a_cut_out_ends():
    still = np.array([[-0.5, -0.5], [19.5, -0.5], [19.5, 19.5], [-0.5, 19.5]])
    mesh = still, np.array([[0, 1, 2], [0, 2, 3]]), np.arange(4)
    photo = np.full((20, 20, 4), 255, np.uint8)
    top = shown(photo, still + 10.4, mesh)[10, 15:25, 3] / 255  # these pixels' middles are 0.4 above the first row's
    np.testing.assert_allclose(top, 0.6, atol=0.01)
    photo[19, 0, 3] = 0
    top = shown(photo, still + 10.4, mesh)[10, 15:25, 3] / 255
    np.testing.assert_allclose(top, 0.6 * 0.6, atol=0.01)


def test_two_pictures_mix_by_their_shares():
    mesh = blob()
    images = [np.full((200, 200, 4), (*color, 255), np.uint8) for color in ((255, 0, 0), (0, 0, 255))]
    layers = [Layer(halved(image), mesh[0], (200, 200)) for image in images]
    picture = DrawnPicture(bent(mesh[0], 1.0), mesh[1], (mesh[2],), tuple(zip(layers, (0.25, 0.75))), 1.0)
    page = draw_things([picture], (260, 260))
    solid = page[page[..., 3] == 255]
    np.testing.assert_allclose(solid, np.broadcast_to([64, 0, 191, 255], solid.shape), atol=1)


def test_a_smaller_store_of_a_large_picture_shows_the_same():
    """A picture stored at half its size keeps the places of its points and what is seen of it."""
    rng = np.random.default_rng(2)
    small = np.repeat(np.repeat(rng.integers(0, 255, (50, 50, 3)), 4, 0), 4, 1).astype(np.uint8)
    image = np.dstack([small, np.full((200, 200), 255, np.uint8)])
    still, faces, loop = blob()
    pages = []
    for pixels in (halved(image), halved(image)[1:]):
        layer = Layer(pixels, still, (200, 200))
        pages.append(draw_things([DrawnPicture(still / 2, faces, (loop,), ((layer, 1.0),), 0.5)], (100, 100)))
    np.testing.assert_array_equal(*pages)


def test_laying_colours_is_the_formula_of_straight_alpha():
    rng = np.random.default_rng(1)
    below = rng.integers(0, 256, (40, 50, 4)).astype(np.uint8)
    below[:10, :, 3], below[10:20, :, 3] = 0, 255
    color, alpha = rng.random((40, 50, 3)), rng.random((40, 50))
    alpha[:, :8] = 0
    under = below[..., 3] / 255
    total = alpha + under * (1 - alpha)
    mixed = (255 * color * alpha[..., None] + below[..., :3] * (under * (1 - alpha))[..., None]) / np.maximum(
        total, 1e-9
    )[..., None]
    page = below.copy()
    lay(page, color, alpha)
    np.testing.assert_array_equal(page[:, :8], below[:, :8])
    np.testing.assert_allclose(page[:, 8:, :3], mixed[:, 8:], atol=0.51)
    np.testing.assert_allclose(page[:, 8:, 3], 255 * total[:, 8:], atol=0.51)


def _shares(corner, x, y):
    """The barycentric shares (3, h, w) of one triangle (3, 2) at pixels."""
    matrix = np.vstack([corner.T, np.ones(3)])
    flat = np.linalg.solve(matrix, np.stack([x.ravel(), y.ravel(), np.ones(x.size)]))
    return flat.reshape(3, *x.shape)

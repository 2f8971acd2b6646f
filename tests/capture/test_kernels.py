"""The compiled loops give what plain NumPy and OpenCV give, in a fraction of the time."""

import cv2
import numpy as np
import pytest

from capture.fit.pixels import kernels, layer, trust

GROUND = np.array([90.0, 60.0, 30.0, 0.0])
rng = np.random.default_rng(3)


def picture(height=40, width=50):
    return cv2.GaussianBlur(rng.uniform(0, 255, (height, width, 4)).astype(np.float32), (0, 0), 1.0)


@pytest.mark.parametrize("shape", [(40, 50), (4, 4), (3, 7), (1, 1)])
def test_values_and_slopes_are_those_of_opencv_and_numpy(shape):
    """The picture is framed by the ground: then central differences are NumPy's, at the border as well."""
    image = picture(*shape)
    at = rng.uniform((-4, -4), (shape[1] + 4, shape[0] + 4), (500, 2)).astype(np.float32)
    values, gx, gy = kernels.look_with_slopes(image, at, GROUND)
    framed = cv2.copyMakeBorder(image, 8, 8, 8, 8, cv2.BORDER_CONSTANT, value=tuple(GROUND))
    slopes = np.gradient(framed, axis=(0, 1))
    assert np.allclose(values, layer.sample(image, at, GROUND), atol=1e-3)
    assert np.allclose(gy, layer.sample(slopes[0], at + 8, np.zeros(4)), atol=1e-3)
    assert np.allclose(gx, layer.sample(slopes[1], at + 8, np.zeros(4)), atol=1e-3)


def test_far_away_and_at_no_number_lies_the_ground():
    far = np.array([(1e30, 0), (-1e9, -1e9), (np.inf, 3), (np.nan, 3)], np.float32)
    values, gx, gy = kernels.look_with_slopes(picture(), far, GROUND)
    assert np.allclose(values, GROUND) and not gx.any() and not gy.any()


def pixels(count=300, modes=5):
    points = rng.uniform(-1, 1, (count, 2)).astype(np.float32)
    gx, gy, difference = rng.standard_normal((3, count, 4)).astype(np.float32)
    weight = np.maximum(rng.uniform(-0.3, 1, count), 0).astype(np.float32)
    return points, rng.standard_normal((count, 2, modes)).astype(np.float32), gx, gy, weight, difference


@pytest.mark.parametrize("gone", [0.0, 40.0])
@pytest.mark.parametrize("hidden", [False, True])
def test_an_affine_pass_is_the_written_out_sum(gone, hidden):
    """Some pixels fall outside the picture, some differ a lot, some are hidden."""
    image, placed = picture(), np.array([(0.9, 0.2, 24.0), (-0.1, 1.1, 19.0)])
    local, _, gx, gy, _, values = pixels()
    points, values = 26.0 * local.astype(float), (128 + 40 * values).astype(np.float32)
    cover = rng.uniform(0, 1, image.shape[:2]).astype(np.float32) if hidden else None
    normal, right, sizes = kernels.affine_pass(
        image, cover, GROUND, placed, (points, local, values, gx, gy), huber=20.0, gone=gone
    )
    at = (points @ placed[:, :2].T + placed[:, 2]).astype(np.float32)
    assert 10 < np.count_nonzero((at < 0).any(axis=1) | (at > (49, 39)).any(axis=1)) < 150
    difference = layer.sample(image, at, GROUND) - values
    weight = trust.biweight(difference, gone) if gone else trust.huber(difference)
    if hidden:
        within = ((at >= 0) & (at < (49, 39))).all(axis=1)  # at the border and beyond it nothing hides a pixel
        weight = weight * np.where(within, layer.sample(cover, at, np.ones(1))[:, 0], 1)
    x, y = local.T[:, :, None]
    rows = np.stack([gx * x, gx * y, gy * x, gy * y, gx, gy], -1).astype(float)  # eq. 11
    assert np.allclose(normal, np.einsum("p,pci,pcj->ij", weight, rows, rows), rtol=1e-3, atol=1e-2)
    assert np.allclose(right, np.einsum("p,pci,pc->i", weight, rows, difference), rtol=1e-3, atol=0.1)
    assert np.allclose(sizes, trust.size_of(difference), atol=1e-3)


@pytest.mark.parametrize("modes", [1, 5])
def test_bent_sums_are_those_of_the_written_out_rows(modes):
    points, fields, gx, gy, weight, difference = pixels(modes=modes)
    linear = np.array([(0.8, 0.3), (-0.2, 1.1)])
    x, y = points.T[:, :, None]
    led = np.einsum("ij,pjl->pil", linear, fields)[:, None]
    rows = np.stack([gx * x, gx * y, gy * x, gy * y, gx, gy], -1)
    rows = np.concatenate([rows, gx[..., None] * led[:, :, 0] + gy[..., None] * led[:, :, 1]], -1)
    normal, right = kernels.bent_sums(points, fields, linear, gx, gy, weight, difference)
    assert np.allclose(normal, np.einsum("p,pci,pcj->ij", weight, rows, rows), rtol=1e-4, atol=1e-3)
    assert np.allclose(right, np.einsum("p,pci,pc->i", weight, rows, difference), rtol=1e-4, atol=1e-3)


def test_the_composite_is_the_layer_over_its_ground():
    image = rng.integers(0, 256, (12, 17, 3), dtype=np.uint8)
    matte = rng.uniform(0, 1, (12, 17))
    made = kernels.composite(image, matte, GROUND[:3], 128.0)
    assert made.dtype == np.float32
    assert np.allclose(made[..., :3], matte[..., None] * image + (1 - matte[..., None]) * GROUND[:3], atol=1e-3)
    assert np.allclose(made[..., 3], 128 * matte, atol=1e-3)


def test_windows_of_a_picture_need_no_copy():
    image = rng.integers(0, 256, (30, 30, 3), dtype=np.uint8)
    part, matte = image[5:20, 3:25], np.ones((30, 30))[5:20, 3:25]
    assert np.allclose(kernels.composite(part, matte, GROUND[:3], 128.0)[..., :3], part)

"""Pictures of every kind, and bad ones: the same colours, upright, or refused in a sentence."""

import struct

import numpy as np
import pytest
from PIL import Image

from retarget.characters.photos import photo


def disc(size=60):
    """A picture with a red disc, and its alpha."""
    y, x = np.mgrid[:size, :size]
    inside = np.hypot(x - size / 2, y - size / 2) < 0.4 * size
    return np.dstack([np.full((size, size), 200), 40 + 0 * x, 60 + 0 * x, 255 * inside]).astype(np.uint8)


def test_pictures_of_all_kinds_of_pixels_show_the_same_colours(tmp_path):
    import cv2

    straight = disc()
    Image.fromarray(straight).quantize(16).save(tmp_path / "palette.png")
    cv2.imwrite(str(tmp_path / "deep.png"), straight[..., [2, 1, 0, 3]].astype(np.uint16) * 257)
    grey = straight[..., 0] // 2
    cv2.imwrite(str(tmp_path / "deep_grey.png"), grey.astype(np.uint16) * 257)
    Image.fromarray(straight[..., :3]).convert("CMYK").save(tmp_path / "print.jpg", quality=95)
    inside = straight[..., 3] == 255
    for name, truth in (
        ("palette.png", straight),
        ("deep.png", straight),
        ("deep_grey.png", np.dstack([grey, grey, grey, 255 + 0 * grey])),
        ("print.jpg", straight),
    ):
        read = photo.read_photo(tmp_path / name).pixels
        assert np.abs(read[inside].astype(int) - truth[inside].astype(int)).max() <= 3, name


@pytest.mark.parametrize("held", range(1, 9))
def test_a_photograph_is_upright_however_the_camera_was_held(tmp_path, held):
    """EXIF's eight, written as the standard tells: where the picture's first row and column are seen."""
    upright = np.zeros((16, 24, 3), np.uint8)
    upright[:8, :12] = (250, 20, 20)
    stored = {
        1: upright,
        2: upright[:, ::-1],
        3: upright[::-1, ::-1],
        4: upright[::-1],
        5: upright.transpose(1, 0, 2),
        6: upright.transpose(1, 0, 2)[::-1],
        7: upright.transpose(1, 0, 2)[::-1, ::-1],
        8: upright.transpose(1, 0, 2)[:, ::-1],
    }[held]
    image = Image.fromarray(np.ascontiguousarray(stored))
    exif = image.getexif()
    exif[0x0112] = held
    image.save(tmp_path / "held.jpg", exif=exif, quality=98, subsampling=0)
    image.save(tmp_path / "held.png", exif=exif)
    for name in ("held.jpg", "held.png"):
        read = photo.read_photo(tmp_path / name)
        assert read.size == (24, 16)
        assert np.abs(read.pixels[..., :3].astype(int) - upright).max() < 30, name


def png(width, height, data=b""):
    """A PNG that says it is so large."""
    from zlib import compress, crc32

    def chunk(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", crc32(kind + content))

    head = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", compress(data)) + chunk(b"IEND", b"")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "cannot be read"),
        (b"a letter", "cannot be read"),
        (png(0, 0), "cannot be read"),
        (png(9999, 9999), "cannot be read"),
        (png(60_000, 60_000), "no more than 178 megapixels"),
        (png(4, 4, bytes(4 * 17)), "all of it is transparent"),
        (png(4, 4, (b"\0" + b"\xff" * 16) * 4), "transparent surrounding"),
    ],
    ids=["empty", "text", "no size", "cut short", "3600 megapixels", "clear", "opaque"],
)
def test_a_picture_that_cannot_be_played_is_refused(lent, tmp_path, content, said):
    (tmp_path / "a.png").write_bytes(content)
    code, told = lent("--drawing", tmp_path / "a.png", out="frames")
    assert code == 2 and "a.png" in told and said in told


def test_an_outline_beside_its_picture_or_a_box_of_no_numbers_is_refused(lent, tmp_path):
    Image.fromarray(disc()).save(tmp_path / "a.png")
    text = '[[parts]]\nname = "egg"\ndrawing = "a.png"\n[[parts.keys]]\nname = "sit"\n'
    cast = tmp_path / "a.cast.toml"
    cast.write_text(text + "outline = [[900, 900], [990, 900], [990, 990]]\n")
    code, said = lent("--cast", cast, out="frames")
    assert code == 2 and "a.png: an outline must lie on its picture of 60 x 60 pixels" in said
    for box in (("nan", 0, 5, 5), (0, 0, "nan", 5), (0, 0, "inf", 5)):
        code, said = lent("--drawing", tmp_path / "a.png", "--box", *box, out="frames")
        assert code == 2 and "must lie inside the 60 x 60 picture" in said

"""The hopping rabbit's body (Noto Animated Emoji): exact outlines, suggested keys, contour capture, lent to a frog.

The frog is one drawing.  Its other keys are made here: its silhouette is brought into correspondence with the rabbit's
first key, moved as the rabbit's outline moves from key to key, and the drawing carried along as rigidly as possible.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from capture.fit.outlines import corresponding
from capture.fit.suggest import Suggestion
from capture.motion import affine, arap, triangulate
from capture.motion.tracks import CartoonMotion
from capture.pictures import overlay
from capture.pictures.clip import Clip
from capture.pictures.encode import write_clip, write_picture
from retarget.characters.drawings import drawing, embed
from retarget.characters.drawings.drawing import Drawing
from retarget.characters.drawings.svg import read_svg
from retarget.characters.figures.puppet import KeyPose, read_puppet
from retarget.stage import draw2d, staging
from retarget.stage.perform import perform

RESIDUAL = 2.0  # what `rabbit_keys` asks for


@pytest.fixture
def body(rabbit_body: np.ndarray) -> np.ndarray:
    return rabbit_body


@pytest.fixture
def found(rabbit_keys: Suggestion) -> Suggestion:
    return rabbit_keys


@pytest.fixture
def clip(rabbit_clip: Clip) -> Clip:
    return rabbit_clip


@pytest.fixture
def motion(rabbit: CartoonMotion) -> CartoonMotion:
    return rabbit


def test_eight_keys_span_the_hop(found: Suggestion, body: np.ndarray):
    print(
        f"\nrabbit's body: {len(found.key_frames)} keys {sorted(found.key_frames.tolist())} of {len(body)} frames "
        f"({int((~found.held).sum())} drawings), residual median {np.median(found.residual):.2f} px, worst "
        f"{found.residual.max():.2f}; by number of keys {', '.join(f'{off:.1f}' for off in found.residual_by_count)}"
    )
    assert found.met()
    assert (found.residual_without.max(axis=1) > RESIDUAL).all()


def test_the_captured_motion_redraws_the_body(motion: CartoonMotion, body: np.ndarray):
    redrawn = motion.points("body")[:, : body.shape[1]]
    off = np.linalg.norm(redrawn - body, axis=-1)
    median, most = np.percentile(off, [50, 95])
    print(f"\nrabbit's body redrawn: median {median:.2f} px, p95 {most:.2f}, worst {off.max():.2f}")
    assert most < 2 * RESIDUAL


def test_a_contact_sheet_of_the_hopping_frog_is_left_to_look_at(
    data: Path, clip: Clip, motion: CartoonMotion, sheets: Path
):
    frog = frog_with_keys(data / "drawings" / "openclipart" / "red-eye_frog_mirko_maisc_01.svg", motion)
    drawn = list(draw2d.draw_frames(perform(motion, [frog]), "#cfe2f3"))
    proof = list(overlay.draw_over(clip, motion))
    pairs = list(overlay.side_by_side(zip(proof, drawn)))
    assert len(pairs) == len(clip)
    write_picture(sheets / "rabbit_frog.png", overlay.contact_sheet(pairs[::2], columns=4, width=480))
    write_clip(sheets / "rabbit_frog.mp4", pairs, motion.fps)


def test_the_rabbit_hops_as_a_fox_that_stands_on_the_rabbits_ground(
    data: Path, clip: Clip, motion: CartoonMotion, found: Suggestion, sheets: Path
):
    """Key poses are moments of the fox's gallop, by how far the hop is; all its joints mix by the captured weights."""
    stride = 1.15  # seconds of its animation
    poses = [KeyPose("Run", stride * frame / len(clip)) if frame else KeyPose("Survey") for frame in found.key_frames]
    fox = read_puppet("body", motion.tracks[0].keys, data / "meshes" / "Fox.glb", poses, "-zy")
    fox = replace(fox, height=0.7)
    sunk = perform(motion, [fox])
    stood = staging.stand(sunk, motion)
    contacts = staging.contacts(motion)
    before, after = (max((staging.slide(p, c) for c in contacts), default=0.0) for p in (sunk, stood))
    print(
        f"\nfox: ground {staging.ground(motion)}, {len(contacts)} contacts, its foot slid {before:.1f} px, {after:.2g} now"
    )
    assert after < 1e-9
    frames = list(draw2d.draw_frames(stood, "#cfe2f3"))
    pairs = list(overlay.side_by_side(zip(clip, frames)))
    write_picture(sheets / "rabbit_fox.png", overlay.contact_sheet(pairs[::2], columns=4, width=480))
    write_clip(sheets / "rabbit_fox.mp4", pairs, motion.fps)


def frog_with_keys(file: Path, motion: CartoonMotion) -> Drawing:
    """The drawing with a version of itself for every key of the rabbit's body."""
    keyset = motion.keyset("body")
    rabbit = affine.apply(keyset.removed, keyset.points)[:, keyset.outline]  # (K, B, 2) as drawn
    paths = read_svg(file)[0]
    whole = embed.silhouette_of(paths)
    whole = max(getattr(whole, "geoms", [whole]), key=lambda piece: piece.area).buffer(1.0)
    rim = np.array(whole.exterior.coords)[:-1]
    ours, theirs = corresponding([rabbit[0], rim], 80)
    scale = np.ptp(theirs, axis=0) / np.ptp(ours, axis=0)
    nearest = np.argmin(((ours[:, None] - rabbit[0]) ** 2).sum(axis=2), axis=1)
    theirs, _, inside, faces = triangulate.triangulate(theirs[None])
    mesh = np.vstack([theirs[0], inside])
    handles, shares = np.repeat(np.arange(80)[:, None], 3, axis=1), np.tile([1.0, 0.0, 0.0], (80, 1))
    versions = []
    for shape in rabbit:
        level = affine.apply(affine.fit(shape, rabbit[0]), shape)  # what a key turned or travelled is the track's
        goals = theirs[0, :80] + scale * (level - rabbit[0])[nearest]
        moved = arap.carry(mesh, faces, handles, shares, goals)
        versions.append([replace(path, points=_carried(path.points, mesh, faces, moved)) for path in paths])
    return drawing.drawing("body", keyset.names, versions)


def _carried(points: np.ndarray, mesh: np.ndarray, faces: np.ndarray, moved: np.ndarray) -> np.ndarray:
    face, share = triangulate.locate(points, mesh, faces)
    return np.einsum("pi,pid->pd", share, moved[faces[face]])

"""What pictures say of many drawings at once: robust Gauss-Newton in batches (Bregler et al. 2002, eqs. 2, 8-13).

The fine fit of `track_shape`, for B drawings side by side on a processor or a graphics card.  Beside the pose at
which a drawing's descent ends it tells how firmly the picture holds it there.  Pictures are sampled in
single precision, everything that is summed over pixels in double: both devices come to the same.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels import model as models
from capture.fit.pixels.judge import ALIKE
from capture.fit.pixels.model import PartModel
from capture.fit.whole.course import frame_of, mode_precision, placed_of
from capture.fit.whole.stack import Stack

ROUNDS = 15  # of Gauss-Newton at most
STILL = 0.002  # pixels; a step that moves nothing farther ends the descent
TETHER = 4.0  # pixels a drawing may go from where it starts in ways its picture does not tell
ALIKE_NOISE = 4 * np.pi  # pixels that share their noise after smoothing with sigma 1: the area under exp(-r^2 / 4)
QUANTUM = 1.0  # grey levels: no picture is truer


class Look(NamedTuple):
    """What the pictures of G drawings say: half the squared misfit in units of its noise, to second order.

    At unknowns u that is  pull . (u - at) + 1/2 (u - at)' information (u - at)  and a constant.
    """

    at: NDArray  # (G, M)
    information: NDArray  # (G, M, M)
    pull: NDArray  # (G, M)
    found: NDArray  # (G,) how much of the template's contrast is there and agrees, 0 to 1
    misfit: NDArray  # (G,) pixels, root mean square over what agrees


def descend(model: PartModel, stack: Stack, start: NDArray, coarsest: int, device: str) -> Look:
    """Descend from unknowns (B, M) through the levels, from `coarsest` down to full size."""
    import torch

    start = torch.as_tensor(start, dtype=torch.float64, device=device)
    at = start
    for number in range(min(coarsest, len(stack.levels) - 1), -1, -1):
        level = _level(model, number, device)
        pictures = _with_slopes(torch.as_tensor(stack.levels[number], device=device))
        origins = torch.as_tensor(stack.origins, dtype=torch.float64, device=device)
        mixed = torch.as_tensor(_amounts(model, at), device=device)
        target = torch.einsum("bk,kpc->bpc", mixed, level["textures"]).float()
        # what the picture does not tell stays: positions near the start, modes within what the rows do
        held = torch.as_tensor(mode_precision(model), device=device)
        tether = (held == 0) / TETHER**2
        live = torch.arange(len(at), device=device)
        seen_by = pictures, origins, target, start
        for _ in range(ROUNDS):
            now = at[live]
            said = _say(level, *seen_by[:3], now, 2**number)
            matrix = said["information"] + torch.diag(held + tether)
            right = said["pull"] + held * now + tether * (now - seen_by[3])
            step = -torch.linalg.solve(matrix, right)
            at = at.index_add(0, live, step)
            moved = (_positions(level, now + step)[0] - said["seen"]).abs().amax(dim=(1, 2))
            going = moved >= STILL * 2**number
            if not going.any():
                break
            if not going.all():
                live, seen_by = live[going], tuple(each[going] for each in seen_by)
    said = _say(level, pictures, origins, target, at, 1)
    names = ("information", "pull", "found", "misfit")
    return Look(at.cpu().numpy(), *(said[name].cpu().numpy() for name in names))


def _level(model: PartModel, number: int, device: str) -> dict[str, Any]:
    """A level of the template on the device: one texture without modes for a part of one key."""
    import torch

    if model.shape is None:
        level = model.rigid.levels[number]
        textures, modes = level.values[None], np.zeros((len(level.points), 2, 0))
    else:
        level = model.shape.bent.levels[number]
        textures, modes = level.textures, level.modes
    centre, scale = frame_of(model)
    ground = np.append(model.view.ground, 0)
    arrays = {"points": level.points - centre, "textures": textures - ground, "modes": modes}
    tensors = {name: torch.as_tensor(array, dtype=torch.float64, device=device) for name, array in arrays.items()}
    return tensors | {"scale": scale, "power": level.gradient_power, "channels": 3 + (model.view.flatness > 0)}


def _amounts(model: PartModel, at: Any) -> NDArray:
    """How the keys' textures are mixed (B, K)."""
    if model.shape is None:
        return np.ones((len(at), 1))
    return np.stack([models.amounts(model.shape, alpha) for alpha in placed_of(at.cpu().numpy(), model)[1]])


def _with_slopes(pictures: Any) -> Any:
    """Pictures (B, 4 + 1, h, w) with the x- and y-slopes of their four channels, (B, 13, h, w)."""
    import torch
    from kornia.filters import spatial_gradient

    slopes = spatial_gradient(pictures[:, :4], mode="diff", order=1, normalized=True)
    return torch.cat([pictures, slopes[:, :, 0], slopes[:, :, 1]], dim=1)


def _positions(level: dict[str, Any], at: Any) -> tuple[Any, Any, Any]:
    """Where the template's pixels are in the frames (B, P, 2), where in the part (B, P, 2), and the linear maps."""
    import torch

    bent = level["points"] + torch.einsum("pil,bl->bpi", level["modes"], at[:, 6:])
    linear = at[:, :4].reshape(-1, 2, 2) / level["scale"]
    return torch.einsum("bij,bpj->bpi", linear, bent) + at[:, None, 4:6], bent, linear


def _say(level: dict[str, Any], pictures: Any, origins: Any, target: Any, at: Any, step: int) -> dict[str, Any]:
    """Misfit, gradient and Gauss-Newton matrix of the robust image term at unknowns (B, M), in units of its noise."""
    import torch

    seen, bent, linear = _positions(level, at)
    values = _sampled(pictures, (seen - origins[:, None]) / step)
    difference = values[..., :4] - target
    gx, gy = values[..., 5:9] / step, values[..., 9:] / step
    size = difference.square().sum(-1).double()
    known = values[..., 4].clamp(0, 1).double()
    # Geman and McClure: what differs more than two things alike would is somebody else's, and falls silent
    weight = known / (1 + size / (4 * ALIKE**2)) ** 2
    xx, xy, yy = ((a * b).sum(-1).double() * weight for a, b in ((gx, gx), (gx, gy), (gy, gy)))
    bx, by = ((g * difference).sum(-1).double() * weight for g in (gx, gy))
    x, y = (bent / level["scale"]).unbind(-1)
    one, zero = torch.ones_like(x), torch.zeros_like(x)
    modes = torch.einsum("bij,pjl->bpil", linear, level["modes"])
    move_x = torch.cat([torch.stack([x, y, zero, zero, one, zero], -1), modes[:, :, 0]], -1)  # (B, P, M)
    move_y = torch.cat([torch.stack([zero, zero, x, y, zero, one], -1), modes[:, :, 1]], -1)
    normal = move_x.mT @ (xx[..., None] * move_x + xy[..., None] * move_y)
    normal = normal + move_y.mT @ (xy[..., None] * move_x + yy[..., None] * move_y)
    right = (move_x.mT @ bx[..., None] + move_y.mT @ by[..., None])[..., 0]
    count = weight.sum(-1).clamp(min=1e-9)
    variance = (weight * size).sum(-1) / (count * level["channels"]) + QUANTUM**2
    noise = ALIKE_NOISE * variance
    alike = known * (size < 4 * ALIKE**2)
    mean = (alike * size).sum(-1) / alike.sum(-1).clamp(min=1e-9)
    return {
        "seen": seen,
        "information": normal / noise[:, None, None],
        "pull": right / noise[:, None],
        "found": ((xx + yy).sum(-1) / (level["power"] * xx.shape[1])).clamp(max=1),
        "misfit": (mean / level["power"]).sqrt(),
    }


def _sampled(pictures: Any, at: Any) -> Any:
    """Bilinear values (B, P, C) at pixels (B, P, 2), pixel (0, 0) the centre of the first; 0 beyond the edge."""
    import torch

    height, width = pictures.shape[-2:]
    size = torch.tensor([width, height], dtype=at.dtype, device=at.device)
    even = ((2 * at + 1) / size - 1).float()  # the edges of the picture, not the centres of its pixels, are -1 and 1
    found = torch.nn.functional.grid_sample(pictures, even[:, :, None], padding_mode="zeros", align_corners=False)
    return found[..., 0].mT

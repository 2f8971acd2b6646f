"""A captured clip made better as a whole: all drawings of a part together, in the pictures and in time.

The frame-by-frame capture looks at one picture from the pose before and is done when it is near enough.  Here every
drawing descends to the very bottom, in batches, all pictures of a held drawing count, and modes are held by what the
pictures' noise allows; drawings in which a part is hidden are bridged by what came before and after.  The paper fits
frame by frame and names the temporal prior as future work.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.fit import contour, source, video
from capture.fit.pixels import model as models
from capture.fit.pixels.model import PartModel
from capture.fit.whole import in_time
from capture.fit.whole.course import Course, course_of, mode_precision, placed_of
from capture.fit.whole.descend import Look, descend
from capture.fit.whole.stack import Covers, only, stacks
from capture.motion import affine
from capture.motion.tracks import CartoonMotion, Track, relative_to_parents, track_of
from capture.pictures.clip import Clip
from capture.pictures.shot import Shot
from capture.progress import progress

SECOND_LOOKS = 3  # at most
FURTHER = 3  # drawings beyond those found that are guessed at from where they were going
# shares of the template's contrast, against what is found of it as a rule in this clip
COVERED = 0.95  # below it, a drawing is looked at again: from its neighbours, and without what lies inside its outline
DOUBTFUL = 0.7  # below it, it is no neighbour to go by
BETTER = 0.1  # by which another place must beat the one a drawing has: keys that do not fit well fit badly anywhere
FOUND = 0.25  # below it, the part is not in the picture
BRIDGED = 0.5  # seconds a part may be hidden and its way still be told from before and after
SURE = 0.1  # pixels to which a captured pose is taken at its word when others are bridged
SEARCHED = 2  # the level from which a drawing that was bridged descends


def refine(
    motion: CartoonMotion, shot: Shot, clip: Clip | None = None, device: str = "auto", loose: float = 0.5
) -> CartoonMotion:
    """Refine what `video.capture` found in the same shot; parts, keys and held drawings stay as they are.

    `device` is auto, cpu or cuda.  A part hidden for no more than half a second is bridged: its frames stay marked as
    not visible, but no longer hold the last pose.  `loose` says how many pixels of misfit are worth a weight of 1 on
    rows beside the three of eq. 7: with 0 there are three, as in the paper, and jitter where one three follows another.
    """
    from threadpoolctl import threadpool_limits

    device = device_of(device)
    clip = video.open_clip(shot) if clip is None else clip
    if len(clip) != len(motion.times):
        raise InputError(
            f"a motion must have been captured from the clip it is refined on: the clip has {len(clip)} frames, the "
            f"motion {len(motion.times)}; capture it again"
        )
    with threadpool_limits(1):  # matrices here are small: BLAS threads would only wait for each other
        learnt = [models.learn(part, clip, shot.start) for part in shot.parts]
        courses = [_bridged(course_of(motion, model), model, BRIDGED * clip.fps) for model in learnt]
        for number in sorted(range(len(learnt)), key=lambda n: -learnt[n].part.order):  # what covers others comes first
            courses[number] = _refined(number, learnt, courses, clip, shot.start, device)
        tracks = [_as_track(motion, model, course, loose) for model, course in zip(learnt, courses)]
    return source.stamped(relative_to_parents(replace(motion, tracks=tuple(tracks))), shot)


def device_of(device: str) -> str:
    """Where to compute, if what it takes is installed."""
    try:
        import kornia  # noqa: F401
        import torch
    except ImportError as error:
        raise InputError(
            f"refining needs torch and kornia, {error.name} is not installed: pip install 'tooncap[torch]'"
        ) from None
    if device not in ("auto", "cpu", "cuda"):
        raise InputError(f"the device must be auto, cpu or cuda, got {device!r}")
    if device == "cuda" and not torch.cuda.is_available():
        raise InputError("the device cuda needs a graphics card that torch can use, there is none: choose cpu or auto")
    if device == "auto":
        return "cuda" if torch.cuda.is_available() else "cpu"
    return device


def _refined(
    number: int, learnt: list[PartModel], courses: list[Course], clip: Clip, begin: int, device: str
) -> Course:
    """One part's course after looks at all its pictures, and second looks at those that told too little."""
    model, course = learnt[number], courses[number]
    prior, covers = mode_precision(model), _covers(number, learnt, courses)
    start = int(course.drawing[models.key_frames(model.part, clip, begin)[0]])
    look = _looked(model, clip, course, start, covers, np.ones(len(course.first), bool), device)
    if look.found.max() <= 0:
        return course
    rule = float(np.percentile(look.found[look.found > 0], 75))  # a part may be hidden in most drawings
    for _ in range(SECOND_LOOKS):
        wanted, sure = look.found < COVERED * rule, look.found >= DOUBTFUL * rule
        if not wanted.any() or not sure.any():
            break
        guess = _through_time(look, replace(course, seen=sure), prior, np.inf, further=FURTHER)
        again = _looked(model, clip, replace(guess, seen=~wanted), start, covers, wanted, device)
        look = _with(look, again, again.found > look.found + BETTER * rule)
    covered = (look.found < COVERED * rule) & (look.found >= FOUND * rule)
    if covered.any():
        near = replace(course, unknowns=look.at, seen=look.found >= FOUND * rule)
        look = _with(look, _looked(model, clip, near, start, covers, covered, device), covered)
    seen = look.found >= FOUND * rule
    course = replace(course, seen=seen, misfit=np.where(seen, look.misfit, 0))
    return _through_time(look, course, prior, BRIDGED * clip.fps)


def _with(look: Look, other: Look, chosen: NDArray) -> Look:
    """A look with some drawings (G,) of another."""
    return Look(*(np.where(chosen.reshape(-1, *(1,) * (a.ndim - 1)), b, a) for a, b in zip(look, other)))


def _looked(
    model: PartModel, clip: Clip, course: Course, start: int, covers: Covers, wanted: NDArray, device: str
) -> Look:
    """What the pictures of the `wanted` drawings (G,) say; of the others that nothing is found."""
    count, size = course.unknowns.shape
    nothing = np.zeros(count)
    look = Look(course.unknowns.copy(), np.zeros((count, size, size)), np.zeros((count, size)), nothing, nothing.copy())
    for stack in progress(stacks(model, clip, course, start, covers), f"refining {model.part.name}"):
        for sure in (True, False):
            chosen = wanted[stack.numbers] & (course.seen[stack.numbers] == sure)
            if chosen.any():
                some = only(stack, chosen)
                said = descend(model, some, course.unknowns[some.numbers], 0 if sure else SEARCHED, device)
                for whole, part in zip(look, said):
                    whole[some.numbers] = part
    return look


def _covers(number: int, learnt: list[PartModel], courses: list[Course]) -> Covers:
    """The outlines of the parts that are drawn over a part, where those are now thought to be."""
    over = [n for n, model in enumerate(learnt) if model.part.order > learnt[number].part.order]
    drawings = {n: courses[n].drawing for n in over}

    def covers(frame: int) -> list[NDArray]:
        shown = [(n, drawings[n][frame]) for n in over]
        return [
            models.outline_at(learnt[n], *placed_of(courses[n].unknowns[g], learnt[n]))
            for n, g in shown
            if courses[n].seen[g]
        ]

    return covers


def _bridged(course: Course, model: PartModel, longest: float) -> Course:
    """A course as it was captured, those drawings bridged in which the part was not seen."""
    count, size = course.unknowns.shape
    firmly = np.tile(np.eye(size) / SURE**2, (count, 1, 1))
    look = Look(course.unknowns, firmly, np.zeros((count, size)), course.seen.astype(float), course.misfit)
    return _through_time(look, course, mode_precision(model), longest)


def _through_time(look: Look, course: Course, prior: NDArray, longest: float, further: int = 0) -> Course:
    """The course by its pictures and the temporal prior; beyond gaps over `longest` frames the last pose is held.

    Before the first drawing seen and after the last it goes on evenly for `further` drawings.
    """
    unknowns = look.at.copy()
    stretches = in_time.stretches(course.seen, course.middle, longest)
    if stretches:
        stretches[0] = slice(max(stretches[0].start - further, 0), stretches[0].stop)
        stretches[-1] = slice(stretches[-1].start, min(stretches[-1].stop + further, len(unknowns)))
    for stretch in stretches:
        part = Look(*(field[stretch] for field in look))
        unknowns[stretch] = in_time.settle(part, course.middle[stretch], prior, course.seen[stretch])
    for before, after in pairwise(stretches):
        unknowns[before.stop : after.start] = unknowns[before.stop - 1]
    if stretches:
        unknowns[: stretches[0].start] = unknowns[stretches[0].start]
        unknowns[stretches[-1].stop :] = unknowns[stretches[-1].stop - 1]
    return replace(course, unknowns=unknowns)


def _as_track(motion: CartoonMotion, model: PartModel, course: Course, loose: float) -> Track:
    """The course as weights over rows, frame by frame."""
    before, keyset = motion.track(model.part.name), model.keyset
    placed, alpha = placed_of(course.unknowns, model)
    weights = np.ones((len(placed), 1))
    if model.shape is not None:
        shapes = np.stack([models.mesh_shape(model, one) for one in alpha])
        tracked = affine.apply(placed, shapes)
        placed, weights = contour.capture_points(tracked, keyset, placed)
        if loose > 0:
            placed, weights = contour.loosened(tracked, keyset, placed, weights, loose)
    shown = course.drawing
    return track_of(
        model.part.name,
        keyset,
        placed[shown],
        weights[shown],
        course.misfit[shown],
        pivot=before.pivot,
        parent=before.parent,
        order=model.part.order,
        visible=course.seen[shown],
        held=before.held,
    )

"""A mesh on a skeleton made of rubber: its skin weights shared out to the sub-joints (Kwon & Lee 2008, section 6).

A vertex that followed joint k with weight w_k follows the sub-joints l of the links that begin at k, by how near they
were when it was bound:

    w'_kl = w_k (1 / d_l) / sum_l (1 / d_l)

which sums to w_k.  With all sub-joints, as the paper has it, far ones have a say, and a bent limb is drawn in towards
its chord and kinks.  With the two nearest, which is the default, a vertex on the bone lies on the curve: a hose bent to
a quarter of a circle by six sub-joints is off by 0.08 of its radius, not 0.6.  A sub-joint carries what is round it
turned, stretched along its link and thinned across:

    v(t) = sum_l w'_l (P_l + R_l S_l (v - q_l))

so a twist is spread over the whole link and no limb is wrung like a wet towel.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine
from mocap.rubber.rubber import RubberMotion
from mocap.rubber.subjoints import SubJoints
from mocap.skeleton import Skeleton, SkeletonMotion, own_maps, world_maps
from retarget.characters.skin import Pose, Skin, sampled

BESIDE = 2
"""A vertex follows so many sub-joints for each joint that it followed."""

NEAREST = 1e-3
"""Of the skeleton's size: no vertex counts as nearer to a sub-joint than this."""

MOST = 4
"""A vertex follows at most this many sub-joints, as all programs can show."""


@dataclass(frozen=True, eq=False)
class RubberSkin:
    """A mesh bound to S sub-joints, in the space it is bound in."""

    names: tuple[str, ...]  # S
    home: NDArray  # (S, 3) where the sub-joints are when the mesh is bound
    axes: NDArray  # (S, 3, 3) rotations whose first column is the direction of a sub-joint's link when bound
    shares: object  # sparse (N, S), rows sum to 1


def motion_of(skin: Skin, animation: str, fps: float = 30.0) -> SkeletonMotion:
    """An animation of a skinned file as a motion of a skeleton that rests, nothing turned, where the mesh was bound.

    In the file's own units and space.  A file's joints may be turned when the mesh is bound; here each joint's turn is
    counted from there.
    """
    if animation not in skin.animations:
        sampled(skin, animation, np.zeros(1))  # refuses it with the names there are
    count = max(2, round(skin.animations[animation].seconds * fps) + 1)
    pose = sampled(skin, animation, np.arange(count) / fps)
    return motion_of_poses(skin, pose, fps)


def motion_of_poses(skin: Skin, pose: Pose, fps: float) -> SkeletonMotion:
    """Poses (T, ...) of a skin as a motion; see `motion_of`."""
    from scipy.spatial.transform import Rotation

    bound = _bound(skin)  # (J, 3, 4)
    world = world_maps(skin.parents, own_maps(pose.translation, pose.rotation, pose.scale))
    _refuse_stretched(world, bound)
    turns = _turns(world[..., :3]) @ np.swapaxes(_turns(bound[..., :3]), -1, -2)  # from the bound pose to the frame
    places, home = world[..., 3], bound[..., 3]
    parents = np.array(skin.parents)
    up = np.where(parents < 0, 0, parents)
    rooted = (parents < 0)[:, None]
    above = np.where(rooted[..., None], np.eye(3), turns[:, up])
    back = np.swapaxes(above, -1, -2)
    away = np.where(rooted, places, places - places[:, up])
    translation = np.einsum("tjab,tjb->tja", back, away)
    rotation = Rotation.from_matrix((back @ turns).reshape(-1, 3, 3)).as_quat().reshape(*places.shape[:2], 4)
    offsets = np.where(rooted, home, home - home[up])
    return SkeletonMotion(Skeleton(skin.names, skin.parents, offsets), translation, rotation, fps)


def rubber_skin(
    skin: Skin, points: NDArray, subjoints: SubJoints, beside: int = BESIDE, most: int = MOST
) -> RubberSkin:
    """A skin for points (N, 3), as they were bound, on the sub-joints of its skeleton by `motion_of`.

    A link that leads to nothing bound, as to the end of a head, bends nothing: a face stays stiff.
    """
    table, parents = joint_shares(skin), subjoints.skeleton.parents
    bends = np.asarray(table.sum(axis=0)).ravel() > 0
    for joint in range(len(parents) - 1, -1, -1):
        if parents[joint] >= 0:
            bends[parents[joint]] |= bends[joint]
    shares = strongest(redistributed(table, points, subjoints, beside, bends), most)
    return RubberSkin(subjoints.names(), rest_places(subjoints), _axes(subjoints), shares)


def joint_shares(skin: Skin) -> object:
    """Shares of points in joints, sparse (N, J): what several bindings give to one joint put together."""
    from scipy import sparse

    bindings = np.arange(len(skin.joints))
    table = (np.ones(len(bindings)), (bindings, skin.joints))
    return (skin.shares @ sparse.csr_matrix(table, shape=(len(bindings), len(skin.names)))).tocsr()


def redistributed(
    shares: object,
    points: NDArray,
    subjoints: SubJoints,
    beside: int | None = BESIDE,
    bends: NDArray | None = None,
) -> object:
    """Shares (N, J) in joints as shares (N, S), sparse, in the `beside` nearest sub-joints, or as in the paper in all.

    For each joint a point's shares in the sub-joints of the links that begin there sum to its share in the joint.
    The far end of a link counts where the link is cut: there the curve goes on; elsewhere the next joint is another.
    Where `bends` (J,) is False of the joint at its far end, a link counts as not cut.
    """
    from scipy import sparse

    home = rest_places(subjoints)
    floor = NEAREST * max(np.ptp(home, axis=0).max(), 1e-30)
    table = sparse.csc_matrix(shares)
    rows, columns, values = [], [], []
    for joint in range(table.shape[1]):
        own = slice(table.indptr[joint], table.indptr[joint + 1])
        followers, weight = table.indices[own], table.data[own]
        if not len(followers):
            continue
        some = _along_links_from(joint, subjoints, bends)
        near = np.linalg.norm(points[followers, None] - home[some], axis=-1)
        say = floor / np.maximum(near, floor)
        if beside is not None and len(some) > beside:
            say = np.where(say >= np.partition(say, -beside, axis=1)[:, -beside, None], say, 0.0)
        rows.append(np.repeat(followers, len(some)))
        columns.append(np.tile(some, len(followers)))
        values.append((weight[:, None] * say / say.sum(axis=1, keepdims=True)).ravel())
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sparse.csr_matrix(entries, shape=(table.shape[0], len(subjoints)))


def strongest(shares: object, most: int = MOST) -> object:
    """The greatest `most` shares of each row of a sparse table, made to sum to 1 again."""
    from scipy import sparse

    dense = shares.toarray()
    chosen = np.argsort(-dense, axis=1, kind="stable")[:, :most]
    kept = np.take_along_axis(dense, chosen, axis=1)
    kept /= kept.sum(axis=1, keepdims=True)
    rows = np.repeat(np.arange(len(dense)), chosen.shape[1])
    return sparse.csr_matrix((kept.ravel(), (rows, chosen.ravel())), shape=dense.shape)


def stretches(motion: RubberMotion) -> NDArray:
    """How much sub-joints stretch what is round them (T, S, 3): along their link, and twice across it.

    A sub-joint lies between the sub-link above it and those after it, and has the mean of both.
    """
    sub = motion.subjoints
    along, across = _round_each(motion.stretch, sub), _round_each(motion.thickness, sub)
    return np.stack([along, across, across], axis=-1)


def posed(rubber: RubberSkin, points: NDArray, motion: RubberMotion) -> NDArray:
    """The points (T, N, 3) of a mesh (N, 3), as it was bound, in a motion made of rubber."""
    maps = maps_of(rubber, motion)
    moved = np.empty((len(maps), len(points), 3))
    for t, own in enumerate(maps):
        blend = (rubber.shares @ own.reshape(len(own), 12)).reshape(-1, 3, 4)
        moved[t] = np.einsum("nij,nj->ni", blend[..., :3], points) + blend[..., 3]
    return moved


def maps_of(rubber: RubberSkin, motion: RubberMotion) -> NDArray:
    """The maps (T, S, 3, 4) from the bound mesh to each frame, one for each sub-joint."""
    from scipy.spatial.transform import Rotation

    turns = Rotation.from_quat(motion.rotation.reshape(-1, 4)).as_matrix().reshape(*motion.rotation.shape[:2], 3, 3)
    linear = turns @ rubber.axes * stretches(motion)[..., None, :] @ np.swapaxes(rubber.axes, -1, -2)
    shift = motion.positions - np.einsum("tsij,sj->tsi", linear, rubber.home)
    return np.concatenate([linear, shift[..., None]], axis=-1)


def rest_places(subjoints: SubJoints) -> NDArray:
    """Where the sub-joints (S, 3) are when nothing is turned."""
    from mocap.body import rest_places as of_joints

    joints, parents = of_joints(subjoints.skeleton), np.array(subjoints.skeleton.parents)[subjoints.joint]
    here = joints[subjoints.joint]
    before = np.where((parents < 0)[:, None], here, joints[np.maximum(parents, 0)])
    return before + subjoints.along[:, None] * (here - before)


def _along_links_from(joint: int, subjoints: SubJoints, bends: NDArray | None) -> NDArray:
    """The joint's own sub-joint, and those of the cut links to its children."""
    pieces = np.bincount(subjoints.joint, minlength=len(subjoints.skeleton))
    cut = (np.array(subjoints.skeleton.parents)[subjoints.joint] == joint) & (pieces[subjoints.joint] > 1)
    cut &= True if bends is None else bends[subjoints.joint]
    return np.concatenate([[subjoints.ends[joint]], np.flatnonzero(cut)])


def _round_each(values: NDArray, subjoints: SubJoints) -> NDArray:
    """The mean (T, S) of values (T, S) of the sub-links above a sub-joint and after it, as far as there are any."""
    parents = np.array(subjoints.parents)
    linked = (parents >= 0) & (subjoints.lengths() > 0)
    total, count = np.where(linked, values, 0.0), linked.astype(float)
    for child in np.flatnonzero(linked):
        total[:, parents[child]] += values[:, child]
        count[parents[child]] += 1
    return np.where(count > 0, total / np.maximum(count, 1), 1.0)


def _axes(subjoints: SubJoints) -> NDArray:
    """Rotations (S, 3, 3) that turn x into the direction at rest of the link that a sub-joint lies on."""
    from scipy.spatial.transform import Rotation

    home, parents = rest_places(subjoints), np.array(subjoints.parents)
    way = home - home[np.maximum(parents, 0)]
    for child in range(len(parents) - 1, -1, -1):  # a joint on no link takes that of what hangs on it
        if parents[child] >= 0 and not np.any(way[parents[child]]):
            way[parents[child]] = way[child]
    found = np.tile(np.eye(3), (len(home), 1, 1))
    for number, vector in enumerate(way):
        if np.any(vector):
            found[number] = Rotation.align_vectors(vector[None], np.array([[1.0, 0, 0]]))[0].as_matrix()
    return found


def _bound(skin: Skin) -> NDArray:
    """The joints' maps (J, 3, 4) when the mesh was bound; those that nothing is bound to go with what they hang on."""
    rest = own_maps(skin.rest.translation, skin.rest.rotation, skin.rest.scale)
    world = world_maps(skin.parents, rest)
    known: dict[int, NDArray] = {}
    for joint, inverse in zip(skin.joints.tolist(), skin.inverse_bind, strict=True):
        known.setdefault(joint, affine.invert(inverse))
    for joint, parent in enumerate(skin.parents):
        if joint in known:
            world[joint] = known[joint]
        elif parent >= 0:
            world[joint] = affine.compose(world[parent], rest[joint])
    return world


def _turns(linear: NDArray) -> NDArray:
    """The rotations nearest to linear maps (..., 3, 3)."""
    u, _, vt = np.linalg.svd(linear)
    return u * np.sign(np.linalg.det(u @ vt))[..., None, None] @ vt


def _refuse_stretched(world: NDArray, bound: NDArray) -> None:
    sizes = np.linalg.svd(world[..., :3], compute_uv=False) / np.linalg.svd(bound[..., :3], compute_uv=False)
    if np.abs(sizes - 1).max() > 0.02:
        raise InputError(
            "a figure that is made of rubber must have joints that turn and travel, this one's stretch by up to "
            f"{np.abs(sizes - 1).max():.0%} by themselves: bake its scale first"
        )

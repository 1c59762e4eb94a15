"""The paper's percept of every field and frame, as one would write it in Python today.

Each maker takes `members` (F, M) sensor indices, `uv` (F, M, 2) in metres and `values` (T, N), all float32, and gives a
function without arguments that computes the pressure-weighted centroid (eq. 1-2) and the direction of the line through
the two points farthest from it (eq. 9-19), for all frames. It returns arrays that `in_frames` of its name brings to
(T, F, 2) and (T, F). Directions are in (-pi, pi]: as lines they count modulo pi.
"""

import math

import numba
import numpy as np

SIDE_BY_SIDE = 64


def with_numpy(members, uv, values):
    """Gathered into (T, F, M), then whole-array arithmetic."""

    def compute():
        pressed = values[:, members]
        centroid = np.einsum("tfm,fmk->tfk", pressed, uv) / pressed.sum(axis=2, keepdims=True)
        points = (uv - centroid[:, :, None, :]) * pressed[..., None]
        reach = np.einsum("tfmk,tfmk->tfm", points, points)
        two = np.argpartition(reach, members.shape[1] - 2, axis=2)[:, :, -2:]
        ends = np.take_along_axis(points, two[..., None], axis=2)
        line = ends[:, :, 1] - ends[:, :, 0]
        return centroid, np.arctan2(line[..., 1], line[..., 0])

    return compute


def with_scipy(members, uv, values):
    """The centroid only, as three sparse matrices stacked on each other."""
    from scipy import sparse

    fields, width = members.shape
    starts = np.arange(fields + 1) * width

    def rows(weights):
        return sparse.csr_matrix((weights.astype(np.float32).ravel(), members.ravel(), starts), (fields, values.shape[1]))

    sums = sparse.vstack([rows(np.ones_like(uv[..., 0])), rows(uv[..., 0]), rows(uv[..., 1])], format="csr")

    def compute():
        total, along_u, along_v = (sums @ values.T).reshape(3, fields, -1)
        return np.stack([along_u / total, along_v / total], axis=-1), None

    return compute


def with_jax(members, uv, values):
    """What NumPy does, compiled whole; the two farthest by two passes of argmax, which XLA does faster than top_k."""
    import jax
    import jax.numpy as jnp

    members, uv, values = jnp.asarray(members), jnp.asarray(uv), jnp.asarray(values)

    @jax.jit
    def percept(values):
        pressed = values[:, members]
        centroid = jnp.einsum("tfm,fmk->tfk", pressed, uv) / pressed.sum(axis=2, keepdims=True)
        points = (uv - centroid[:, :, None, :]) * pressed[..., None]
        reach = (points * points).sum(axis=3)
        first = jnp.argmax(reach, axis=2, keepdims=True)
        others = jnp.where(jnp.arange(members.shape[1]) == first, -1.0, reach)
        second = jnp.argmax(others, axis=2, keepdims=True)

        def end(which):
            return jnp.take_along_axis(points, which[..., None], axis=2)[:, :, 0]

        line = end(first) - end(second)
        return centroid, jnp.arctan2(line[..., 1], line[..., 0])

    return lambda: jax.block_until_ready(percept(values))


def _loops(members, uv, values, centroid, direction):
    zero = np.float32(0)
    for frame in numba.prange(values.shape[0]):
        for field in range(members.shape[0]):
            total, u, v = zero, zero, zero
            for k in range(members.shape[1]):
                p = values[frame, members[field, k]]
                total += p
                u += p * uv[field, k, 0]
                v += p * uv[field, k, 1]
            u /= total
            v /= total
            first, second = np.float32(-1), np.float32(-1)
            first_u, first_v, second_u, second_v = zero, zero, zero, zero
            for k in range(members.shape[1]):
                p = values[frame, members[field, k]]
                du, dv = (uv[field, k, 0] - u) * p, (uv[field, k, 1] - v) * p
                reach = du * du + dv * dv
                if reach > first:
                    second, second_u, second_v = first, first_u, first_v
                    first, first_u, first_v = reach, du, dv
                elif reach > second:
                    second, second_u, second_v = reach, du, dv
            centroid[frame, field, 0] = u
            centroid[frame, field, 1] = v
            direction[frame, field] = math.atan2(first_v - second_v, first_u - second_u)


def _loops_side_by_side(members, uv, values, centroid, direction):
    """Blocks of frames in parallel, a block's frames side by side in vectors; all arrays have frames last."""
    width = SIDE_BY_SIDE
    for block in numba.prange(values.shape[1] // width):
        start = block * width
        total, u, v = np.empty(width, np.float32), np.empty(width, np.float32), np.empty(width, np.float32)
        first, first_u, first_v = np.empty(width, np.float32), np.empty(width, np.float32), np.empty(width, np.float32)
        second, second_u, second_v = np.empty(width, np.float32), np.empty(width, np.float32), np.empty(width, np.float32)
        for field in range(members.shape[0]):
            total[:] = 0
            u[:] = 0
            v[:] = 0
            for k in range(members.shape[1]):
                pressed = values[members[field, k], start : start + width]
                at_u, at_v = uv[field, k, 0], uv[field, k, 1]
                for i in range(width):
                    p = pressed[i]
                    total[i] += p
                    u[i] += p * at_u
                    v[i] += p * at_v
            for i in range(width):
                u[i] /= total[i]
                v[i] /= total[i]
            first[:] = -1
            second[:] = -1
            for k in range(members.shape[1]):
                pressed = values[members[field, k], start : start + width]
                at_u, at_v = uv[field, k, 0], uv[field, k, 1]
                # Without branches, so that it becomes vector code.
                for i in range(width):
                    du, dv = (at_u - u[i]) * pressed[i], (at_v - v[i]) * pressed[i]
                    reach = du * du + dv * dv
                    over_first, over_second = reach > first[i], reach > second[i]
                    second[i] = first[i] if over_first else (reach if over_second else second[i])
                    second_u[i] = first_u[i] if over_first else (du if over_second else second_u[i])
                    second_v[i] = first_v[i] if over_first else (dv if over_second else second_v[i])
                    first[i] = reach if over_first else first[i]
                    first_u[i] = du if over_first else first_u[i]
                    first_v[i] = dv if over_first else first_v[i]
            for i in range(width):
                centroid[field, 0, start + i] = u[i]
                centroid[field, 1, start + i] = v[i]
                direction[field, start + i] = math.atan2(first_v[i] - second_v[i], first_u[i] - second_u[i])


_one_thread = numba.njit(fastmath=True)(_loops)
_all_cores = numba.njit(fastmath=True, parallel=True)(_loops)
_side_by_side = numba.njit(fastmath=True, parallel=True)(_loops_side_by_side)


def _with_numba(kernel):
    def maker(members, uv, values):
        cells = (len(values), len(members))
        centroid, direction = np.empty((*cells, 2), np.float32), np.empty(cells, np.float32)

        def compute():
            kernel(members, uv, values, centroid, direction)
            return centroid, direction

        return compute

    return maker


def with_numba_side_by_side(members, uv, values):
    """From sensor-major input: turning the frames round beforehand is not counted."""
    values = np.ascontiguousarray(values.T)
    fields, frames = len(members), values.shape[1]
    assert frames % SIDE_BY_SIDE == 0
    centroid = np.empty((fields, 2, frames), np.float32)
    direction = np.empty((fields, frames), np.float32)

    def compute():
        _side_by_side(members, uv, values, centroid, direction)
        return centroid, direction

    return compute


MAKERS = {
    "NumPy": with_numpy,
    "SciPy CSR, centroid only": with_scipy,
    "Numba, one thread": _with_numba(_one_thread),
    "Numba, all cores": _with_numba(_all_cores),
    "Numba, all cores, 64 frames side by side": with_numba_side_by_side,
    "JAX jit": with_jax,
}


def fits(name, frames):
    """Whether the kernel `name` can take so many frames a call."""
    return MAKERS[name] is not with_numba_side_by_side or frames % SIDE_BY_SIDE == 0


def in_frames(name, answer):
    """(T, F, 2) and (T, F), or None, of what the kernel `name` returned."""
    centroid, direction = (part if part is None else np.asarray(part) for part in answer)
    if MAKERS[name] is with_numba_side_by_side:
        return centroid.transpose(2, 0, 1), direction.T
    if MAKERS[name] is with_scipy:
        return centroid.transpose(1, 0, 2), None
    return centroid, direction

"""What may be wrong with a mesh's geometry: functions of vertices, polygons and a source of random numbers.

They may change the arrays they are given.
"""

import random

import numpy as np


def _some(rng: random.Random, items: int) -> int:
    return rng.randrange(items)


def not_finite(v, f, rng):
    v[_some(rng, len(v)), rng.randrange(3)] = rng.choice([np.nan, np.inf, -np.inf])
    return v, f


def outside(v, f, rng):
    f[_some(rng, len(f))][rng.randrange(3)] = rng.choice([-1, len(v), len(v) + 1, 2**31 - 1, 2**31, -(2**31), 2**62])
    return v, f


def doubled_vertices(v, f, _rng):
    """Every face has corners of its own, as in an STL."""
    return v[np.concatenate(f)], [list(range(3 * i, 3 * i + 3)) for i in range(len(f))]


def doubled_faces(v, f, rng):
    return v, f + rng.choices(f, k=rng.randint(1, len(f)))


def repeated_corner(v, f, rng):
    for face in rng.choices(f, k=rng.randint(1, 4)):
        face[0] = face[1]
    return v, f


def zero_area(v, f, rng):
    """Faces whose corners are three vertices at two points, or at one."""
    for face in rng.choices(f, k=rng.randint(1, 3)):
        v[face[1]] = v[face[0]]
        if rng.random() < 0.3:
            v[face[2]] = v[face[0]]
    return v, f


def collinear(v, f, rng):
    for face in rng.choices(f, k=rng.randint(1, 3)):
        v[face[1]] = (v[face[0]] + v[face[2]]) / 2
    return v, f


def needles(v, f, rng):
    for face in rng.choices(f, k=rng.randint(1, 3)):
        v[face[1]] = v[face[0]] + 10.0 ** rng.uniform(-18, -4) * (v[face[2]] - v[face[0]] + rng.random())
    return v, f


def fins(v, f, rng):
    extra = []
    for face in rng.choices(f, k=rng.randint(1, 6)):
        extra.append([face[0], face[1], _some(rng, len(v))])
    return v, f + extra


def bowtie(v, f, rng):
    """Two vertices become one, so that pieces of surface meet in a point."""
    a, b = _some(rng, len(v)), _some(rng, len(v))
    return v, [[a if i == b else i for i in face] for face in f]


def flipped(v, f, rng):
    for face in rng.choices(f, k=rng.randint(1, len(f))):
        face.reverse()
    return v, f


def specks(v, f, rng):
    """Small pieces far from, or inside, the surface."""
    for _ in range(rng.randint(1, 4)):
        size, at = 10.0 ** rng.uniform(-12, 0), np.array([rng.uniform(-3, 3) for _ in range(3)])
        f = [*f, [len(v), len(v) + 1, len(v) + 2]]
        v = np.vstack([v, at + size * np.eye(3)])
    return v, f


def scaled(v, f, rng):
    return v * 10.0 ** rng.choice([-320, -200, -160, -100, -45, -20, -5, 5, 20, 38, 39, 100, 150, 155, 200, 308]), f


def stretched(v, f, rng):
    return v * [1, 1, 10.0 ** rng.choice([-300, -30, -17, -16, -12, -8, -4, 4, 8, 12])], f


def far_away(v, f, rng):
    return v + 10.0 ** rng.choice([3, 6, 7, 8, 12, 15, 16, 20]), f


def alone(v, f, rng):
    """Vertices that no face uses, some of them wrong."""
    extra = rng.choice([[[0, 0, 0]], [[1e300, 0, 0]], [[np.nan, 0, 0]], [[5, 5, 5]] * 20])
    v = np.vstack([v, extra])
    return v, f


def flat(v, f, rng):
    v[:, rng.randrange(3)] = rng.choice([0, 1, 1e9])
    return v, f


def on_a_line(v, f, _rng):
    v[:, 1:] = 0
    return v, f


def in_one_point(v, f, rng):
    return v * 0 + rng.choice([0, 1, 1e300]), f


def one_triangle(v, _f, rng):
    return v[:3], [rng.sample(range(3), 3)]


def few_faces(v, f, rng):
    return v, rng.sample(f, rng.randint(0, min(4, len(f))))


def no_vertices(v, f, _rng):
    return v[:0], f


def shuffled(v, f, rng):
    """Corners drawn at random: edges with many faces, everywhere."""
    return v, [rng.choices(range(len(v)), k=3) for _ in f]


def polygons(v, f, rng):
    """Faces of many corners, also repeated ones."""
    return v, f + [rng.choices(range(len(v)), k=rng.choice([2, 4, 5, 30, 300])) for _ in range(rng.randint(1, 3))]


def hub(v, f, _rng):
    """One vertex in every face."""
    return v, [[0, *face[1:]] for face in f]


def noisy(v, f, rng):
    size = 10.0 ** rng.uniform(-17, 3)
    return v + size * np.random.default_rng(rng.randrange(2**32)).standard_normal(v.shape), f


GEOMETRY = [
    not_finite,
    outside,
    doubled_vertices,
    doubled_faces,
    repeated_corner,
    zero_area,
    collinear,
    needles,
    fins,
    bowtie,
    flipped,
    specks,
    scaled,
    stretched,
    far_away,
    alone,
    flat,
    on_a_line,
    in_one_point,
    one_triangle,
    few_faces,
    no_vertices,
    shuffled,
    polygons,
    hub,
    noisy,
]

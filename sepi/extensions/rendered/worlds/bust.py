"""A marble head in a painted niche, between vases: surfaces that curve strongly and outlines that turn away.

The table runs into the niche. The bust is the surface on which a distance is zero: ellipsoids, capsules and cuts run
into each other, as a sculptor adds clay and takes it away. There ``y`` is up and the face looks along ``z``.
"""

import numpy as np
from skimage import measure

from sepi.extensions.rendered import shapes
from sepi.extensions.rendered.patterns import field, noise, painted, stone
from sepi.extensions.rendered.shapes import Points, box, moved, raster, sheet, thing, turned_body
from sepi.extensions.rendered.staging import fruit, profile, vessel
from sepi.extensions.rendered.world import Cameras, Lamp, Light, Material, Mesh, Pattern, Things, Vector, World

TABLE, WALL = 0.33, 2.35


def world() -> World:
    """By a large window at the upper left, and what a bright room sends back."""
    lamp = Lamp((-2.5, -1.0, 0.3), (0, 0, 1.3), (0.6, -1.2, 0), (15.0, 14.2, 13.0))
    light = Light(sky=(0.22, 0.23, 0.26), lamps=[lamp], exposure=1.35, depth=4)
    return World([*_things()], Cameras(1.15, 2.83, 2.1, -1.9, 31), light)


def _things() -> Things:
    marble = Material(stone(3, 0.5, (0.86, 0.84, 0.8), (0.75, 0.73, 0.71)))
    limestone = Material(noise(11, (0.66, 0.62, 0.55), 0.07, 0.5, (3, 256)))
    glaze = Material(noise(41, (0.2, 0.42, 0.4), 0.05, 0.4, (4, 500)), "glossy", 0.08)
    flesh = Material(noise(51, (0.72, 0.26, 0.14), 0.05, 0.12, (3, 256)))
    yield thing(moved(_bust(), (0, 0.5, 0), (0.03, TABLE - 0.59, 1.62)), marble)
    yield thing(turned_body(profile(_FOOT), (0.03, TABLE - 0.06, 1.62)), marble)
    yield thing(box((0.03, TABLE - 0.03, 1.62), (0.26, 0.06, 0.26), (0, 0.12, 0)), limestone)
    yield thing(box((0, TABLE + 0.06, 2.05), (3.6, 0.12, 1.8)), limestone)
    yield thing(_wall(0.48, -0.12), noise(21, (0.78, 0.72, 0.6), 0.022, 1.6, (4, 300)))
    yield thing(_niche(0.48, -0.12), noise(31, (0.36, 0.46, 0.45), 0.03, 1.2, (4, 300)))
    yield thing(_amphora((-0.4, TABLE, 1.85)), _amphora_paint())
    yield thing(_urn((0.37, TABLE, 1.78)), noise(61, (0.7, 0.68, 0.62), 0.05, 0.3))
    yield thing(vessel(_BOWL, 0.005, (-0.26, TABLE, 1.41)), glaze)
    for n, (x, y, z) in enumerate(_FRUIT):
        yield thing(fruit((x, TABLE - y, z), 0.038, n), flesh)


_FOOT = [(0.001, 0.125), (0.05, 0.125), (0.052, 0.112), (0.036, 0.09), (0.034, 0.07), (0.05, 0.05), (0.075, 0.035),
         (0.08, 0.025), (0.074, 0.014), (0.088, 0.012), (0.09, 0.0)]  # fmt: skip
_BOWL = [(0.11, 0.075), (0.108, 0.07), (0.09, 0.04), (0.055, 0.018), (0.04, 0.012), (0.042, 0.0)]
_FRUIT = [(-0.3, 0.06, 1.42), (-0.225, 0.058, 1.45), (-0.26, 0.06, 1.37), (0.2, 0.036, 1.33), (0.285, 0.034, 1.4)]


def _arch(radius: float, spring: float, rows: int = 40) -> Points:
    """Outline of the niche from the table up and over and down, ``(N, 2)``."""
    angle = np.linspace(np.pi, 0, 2 * rows)
    left = np.stack([np.full(rows, -radius), np.linspace(TABLE, spring, rows, endpoint=False)], -1)
    top = np.stack([radius * np.cos(angle), spring - radius * np.sin(angle)], -1)
    return np.concatenate([left, top, (left * [-1, 1])[::-1]])


def _wall(radius: float, spring: float) -> Mesh:
    inner = _arch(radius, spring)
    out = inner - [0, TABLE]
    flat = np.stack([inner, [0, TABLE] + 2.5 * out / np.abs(out).max(1, keepdims=True)])
    mesh = sheet(np.concatenate([flat, np.full((*flat.shape[:2], 1), WALL)], -1), smooth=False)
    return mesh._replace(uv=mesh.vertices[:, :2])


def _niche(radius: float, spring: float) -> Mesh:
    """Half a cylinder below a quarter of a ball."""
    turn = np.linspace(0, np.pi, 80)[:, None]
    # a little wider than the hole, so that no ray slips through between
    radius += 0.004
    x = radius * np.cos(turn)
    low = np.linspace(TABLE, spring, 30)[None, :]
    wall = raster(x, low, WALL + radius * np.sin(turn))
    rise = np.linspace(0, np.pi / 2, 40)[None, :]
    dome = [x * np.cos(rise), spring - radius * np.sin(rise) + 0 * x, WALL + radius * np.sin(turn) * np.cos(rise)]
    return shapes.joined([sheet(wall), sheet(raster(*dome))])


def _amphora(foot: Vector) -> Mesh:
    outline = [(0.062, 0.5), (0.066, 0.49), (0.045, 0.475), (0.04, 0.4), (0.075, 0.365), (0.125, 0.29), (0.122, 0.2),
               (0.075, 0.08), (0.046, 0.03), (0.062, 0.02), (0.064, 0.0)]  # fmt: skip
    turn = np.linspace(0, np.pi, 30)
    out = 0.042 + 0.035 * turn / np.pi + 0.065 * np.sin(turn)
    paths = [raster(side * out, -0.455 + 0.115 * turn / np.pi, 0 * turn) for side in (-1, 1)]
    handles = [shapes.tube(path @ shapes.rotation((0, 0.5, 0)).T + np.array(foot), 0.011) for path in paths]
    return shapes.joined([vessel(outline, 0.006, foot), *handles])


def _urn(foot: Vector) -> Mesh:
    """Its belly is fluted."""
    outline = [(0.085, 0.27), (0.09, 0.262), (0.072, 0.25), (0.07, 0.235), (0.12, 0.19), (0.125, 0.15), (0.09, 0.08),
               (0.045, 0.045), (0.045, 0.03), (0.07, 0.02), (0.072, 0.0)]  # fmt: skip
    mesh = vessel(outline, 0.008, foot)
    points = mesh.vertices - np.array(foot, np.float32)
    belly = np.clip(np.minimum(-points[:, 1] - 0.055, 0.215 + points[:, 1]) / 0.03, 0, 1)
    flute = 1 - 0.05 * belly * np.abs(np.cos(11 * np.arctan2(points[:, 2], points[:, 0])))
    points[:, [0, 2]] *= flute[:, None]
    return mesh._replace(vertices=(points + np.array(foot)).astype(np.float32))


def _amphora_paint() -> Pattern:
    """Bands of black gloss, keys and tongues on orange clay; ``v`` begins inside, at the foot."""
    y, x = np.mgrid[:1024, :1024] / 1024
    rows = ("111111", "100000", "101110", "101010", "100010", "111110")
    key = np.array([[int(cell) for cell in row] for row in rows])
    key = key[(6 * 24 * y).astype(int) % 6, (6 * 24 * x).astype(int) % 6]
    tongue = np.cos(2 * np.pi * 48 * x) > 0.2
    band = (y * 24).astype(int)
    kinds = [np.isin(band, (5, 14)), np.isin(band, (4, 6, 13, 15)), np.isin(band, (9, 18, 19)), band % 4 == 0]
    black = np.select(kinds, [key, 0 * y, tongue, 1 + 0 * y], 0)
    worn = 1 + 0.06 * field(71, 3, 120)
    colour = np.where(black[..., None] > 0, [0.17, 0.13, 0.12], [0.74, 0.42, 0.24]) * worn[..., None]
    return painted(colour, 0.6)


def _bust(finest: float = 0.002) -> Mesh:
    """Head, neck and chest, 0.55 m high: the face towards ``-z``, ``y`` down, the eyes at height 0."""
    low, count = np.array([-0.24, -0.48, -0.16]), np.array([60, 81, 38])
    step, distance = 4 * finest, np.zeros(count)
    for level in range(3):
        if level:
            # only near the surface is it worth while to look again
            step, distance = step / 2, distance.repeat(2, 0).repeat(2, 1).repeat(2, 2)
        near = np.nonzero(np.abs(distance) < 2.5 * step)
        distance[near] = _sculpture(low + step * (np.stack(near, -1) + 0.5))
    points, faces, _, _ = measure.marching_cubes(distance, 0.0)  # type: ignore[no-untyped-call]
    points = low + step * (points + 0.5)
    uv = np.stack([0.1 * np.arctan2(points[:, 0], points[:, 2]), -points[:, 1]], -1)
    upright = points * np.array([1, -1, -1])
    return Mesh(upright.astype(np.float32), faces.astype(np.uint32), uv.astype(np.float32), smooth=True)


def _ellipsoid(p: Points, centre: Vector, radii: Vector) -> Points:
    scaled = (p - np.array(centre)) / np.array(radii)
    length = np.linalg.norm(scaled, axis=-1)
    return np.asarray(length * (length - 1) / np.maximum(np.linalg.norm(scaled / np.array(radii), axis=-1), 1e-9))


def _capsule(p: Points, start: Vector, end: Vector, first: float, last: float) -> Points:
    """Distance to a line whose radius goes from ``first`` to ``last``."""
    a, along = np.array(start), np.array(end) - np.array(start)
    share = np.clip((p - a) @ along / (along @ along), 0, 1)
    return np.asarray(np.linalg.norm(p - a - share[..., None] * along, axis=-1) - first - share * (last - first))


def _blend(a: Points, b: Points, width: float) -> Points:
    """Both bodies, their meeting rounded."""
    over = np.maximum(width - np.abs(a - b), 0) / width
    return np.asarray(np.minimum(a, b) - over**2 * width / 4)


def _head(q: Points) -> Points:
    """Distance from the head, whose face looks along ``z``, ``y`` up; the ears are at height 0."""
    d = _ellipsoid(q, (0, 0.03, -0.012), (0.074, 0.088, 0.1))
    d = _blend(d, _ellipsoid(q, (0, -0.03, 0.03), (0.06, 0.085, 0.064)), 0.02)
    d = _blend(d, _ellipsoid(q, (0, -0.072, 0.035), (0.051, 0.042, 0.054)), 0.02)
    d = _blend(d, _ellipsoid(q, (0, -0.1, 0.077), (0.021, 0.017, 0.018)), 0.02)
    d = _blend(d, _ellipsoid(q, (0.044, -0.022, 0.06), (0.02, 0.016, 0.02)), 0.025)
    d = -_blend(-d, _ellipsoid(q, (0.031, 0.001, 0.102), (0.021, 0.013, 0.022)), 0.014)
    d = _blend(d, _capsule(q, (0.01, 0.021, 0.091), (0.05, 0.018, 0.07), 0.006, 0.005), 0.014)
    d = np.minimum(d, _eye(q))
    d = _blend(d, _capsule(q, (0, 0.014, 0.094), (0, -0.036, 0.116), 0.0065, 0.0095), 0.008)
    d = _blend(d, _ellipsoid(q, (0.0125, -0.041, 0.1), (0.008, 0.008, 0.01)), 0.005)
    d = -_blend(-d, _capsule(q, (0, -0.05, 0.103), (0, -0.06, 0.101), 0.003, 0.004), 0.006)
    d = _blend(d, _capsule(q, (0.004, -0.066, 0.0975), (0.022, -0.0705, 0.088), 0.0055, 0.002), 0.004)
    d = _blend(d, _capsule(q, (0, -0.0785, 0.096), (0.018, -0.0735, 0.089), 0.0065, 0.002), 0.003)
    return _blend(d, _ellipsoid(q, (0.076, -0.008, -0.012), (0.011, 0.03, 0.018)), 0.006)


def _eye(q: Points) -> Points:
    """The ball, and two lids that leave a slit."""
    x, y, z = 0.031, 0.001, 0.073
    away = np.linalg.norm(q - np.array([x, y, z]), axis=-1)
    slit = np.abs(q[..., 1] - y) - 0.0052 * (1 - ((q[..., 0] - x) / 0.016) ** 2)
    return np.asarray(np.minimum(away - 0.0125, np.maximum(away - 0.0145, -slit)))


def _body(q: Points) -> Points:
    d = _capsule(q, (0, -0.06, -0.018), (0, -0.27, -0.035), 0.054, 0.06)
    d = _blend(d, _capsule(q, (0.016, -0.25, 0.03), (0.05, -0.06, -0.01), 0.012, 0.012), 0.02)
    d = _blend(d, _capsule(q, (0.02, -0.2, -0.05), (0.16, -0.275, -0.045), 0.05, 0.06), 0.05)
    d = _blend(d, _ellipsoid(q, (0, -0.36, -0.02), (0.17, 0.13, 0.1)), 0.06)
    d = _blend(d, _ellipsoid(q, (0.07, -0.37, 0.03), (0.075, 0.06, 0.06)), 0.05)
    d = -_blend(-d, -_ellipsoid(q, (0, -0.21, 0), (0.2, 0.25, 0.3)), 0.012)
    return d


def _sculpture(p: Points) -> Points:
    x, y, z = p[..., 0], p[..., 1], p[..., 2]
    q = np.stack([np.abs(x), y, z], axis=-1)
    # the head is far from what lies lower
    upper = y > -0.17
    d = np.full(y.shape, 1.0)
    d[upper] = _head(q[upper]) - _hair(p[upper])
    d = _blend(d, _body(q - np.array([0, 0.03, 0])), 0.022)
    fold = np.sin(75 * (y - 0.45 * x) + 5 * np.sin(14 * x + 3 * z))
    return np.asarray(d - np.clip((0.45 * x - 0.305 - y) / 0.008, 0, 1) * (0.006 + 0.005 * fold))


def _hair(p: Points) -> Points:
    """Height of the hair, in waves from the crown down: it ends over the brow, before the ears and in the neck."""
    hairline = np.interp(p[..., 2], [-0.03, 0.0, 0.035, 0.07], [-0.09, 0.012, 0.03, 0.066])
    rng = np.random.default_rng(5)
    waves = (40, 40, 60, 60, 110)
    warp = sum(np.sin(p @ (wave * rng.standard_normal(3)) + rng.uniform(0, 6)) * 40 / wave for wave in waves)
    around = np.arctan2(p[..., 0], p[..., 2] + 0.01)
    locks = 1 - 2 * np.abs(np.sin(10 * around + 30 * p[..., 1] + warp))
    return np.asarray(np.clip((p[..., 1] - hairline) / 0.01, 0, 1) * (0.008 + 0.004 * locks))

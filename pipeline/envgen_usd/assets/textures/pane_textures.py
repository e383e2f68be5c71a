"""Panes of windows with what is behind them: curtains, rooms, displays; by day and lit by lamps.

A texture covers a window. Colours are those behind glass, which takes a fifth of the light twice.
"""

import numpy as np

from envgen_usd.assets.textures.procedural_texture import Texture
from envgen_usd.assets.textures.texture_noise import grid, spectral
from envgen_usd.models.array_types import FloatArray

SIZE = 256
_ROOM = np.array([0.028, 0.032, 0.034])
_FABRIC = np.array([0.34, 0.32, 0.28])
_NET = np.array([0.20, 0.20, 0.19])


def draped(rng: np.random.Generator) -> Texture:
    """Curtains at both sides, and a net over the lower part between them; a lamp glows through."""
    u, v = grid(SIZE)
    folds = 0.75 + 0.25 * np.sin(2 * np.pi * (19 * u + 0.25 * np.sin(7 * u) + 0.05 * v))
    from_side = np.minimum(u, 1.0 - u)
    # Curtains are drawn aside and hang a little wider at the foot.
    hung = from_side < 0.20 + 0.05 * (1.0 - v) + 0.01 * np.sin(2 * np.pi * 2.0 * v)
    ripple = 0.85 + 0.15 * np.sin(2 * np.pi * (31 * u + 0.4 * np.sin(9 * u)))
    net = (v < 0.55) & ~hung
    colour = _room(rng)
    colour[net] = (_NET * ripple[..., None])[net]
    colour[hung] = (_FABRIC * folds[..., None])[hung]
    through = np.where(hung, 0.45 * folds, np.where(net, 0.7 * ripple, 1.0))
    near = np.exp(-((u - 0.62) ** 2 + (v - 0.75) ** 2) / 0.18)
    return Texture(1.0, colour, glow=_evenly((through * (0.25 + near))[..., None]))


def lit_room(rng: np.random.Generator) -> Texture:
    """A room seen from the street: ceiling, a lamp, a wall with a picture, a cupboard, curtains."""
    u, v = grid(SIZE)
    away = np.hypot(1.3 * (u - 0.42), v - 0.84)
    # From below one sees much of the ceiling, and the lamp's light fades along it and the wall.
    light = np.where(v > 0.70, 1.25, 0.75) * (0.35 + 0.9 * np.exp(-((away / 0.45) ** 2)))
    light = np.where(abs(v - 0.70) < 0.008, 0.6 * light, light)
    light *= 1.0 + 0.06 * spectral(rng, SIZE, 2.0, 8.0)
    glow = light[..., None] * np.array([1.0, 0.94, 0.86])
    wall = v < 0.70
    glow[(abs(u - 0.66) < 0.09) & (abs(v - 0.50) < 0.075) & wall] *= (0.45, 0.40, 0.38)
    glow[(u > 0.16) & (u < 0.36) & (v < 0.40)] *= (0.30, 0.24, 0.20)  # a cupboard
    glow[(u > 0.36) & (v < 0.14)] *= (0.42, 0.36, 0.34)  # the back of a sofa
    glow[(abs(u - 0.42) < 0.004) & (v > 0.86)] *= 0.3  # the cord of the lamp
    glow[(abs(u - 0.42) < 0.055) & (abs(v - 0.835) < 0.028)] = (6.0, 5.4, 4.4)
    folds = 0.75 + 0.25 * np.sin(2 * np.pi * (21 * u + 0.3 * np.sin(6 * u)))
    curtain = np.minimum(u, 1.0 - u) < 0.11 + 0.02 * (1.0 - v)
    glow[curtain] = (0.38 * folds[..., None] * np.array([1.0, 0.86, 0.70]))[curtain]
    colour = _room(rng)
    colour[curtain] = (_FABRIC * folds[..., None])[curtain]
    return Texture(1.0, colour, glow=_evenly(glow))


def shop(rng: np.random.Generator) -> Texture:
    """A display: goods on shelves and stands, a back wall, lamps below the ceiling, a poster."""
    u, v = grid(SIZE)
    colour = np.full((SIZE, SIZE, 3), 0.075) * np.array([1.0, 0.94, 0.82])
    colour *= (0.55 + 0.9 * v + 0.1 * spectral(rng, SIZE, 2.0, 8.0))[..., None]
    for shelf in (0.05, 0.21, 0.37, 0.53):
        left = 0.0
        while left < 1.0:
            width, tall = rng.uniform(0.02, 0.075), rng.uniform(0.04, 0.125)
            goods = (u > left) & (u < left + width) & (v > shelf) & (v < shelf + tall)
            if rng.random() < 0.75:
                shade = rng.uniform(0.03, 0.22) * rng.uniform(0.5, 1.5, 3)
                colour[goods] = shade * (0.6 + 0.5 * v[goods, None])
            left += width + rng.uniform(0.004, 0.03)
        colour[(v > shelf - 0.012) & (v <= shelf)] = (0.16, 0.14, 0.11)
    poster = (abs(u - 0.78) < 0.075) & (abs(v - 0.56) < 0.13)
    colour[poster] = (0.34, 0.30, 0.22)
    colour[(abs(u - 0.78) < 0.05) & (abs(v - 0.6) < 0.05)] = (0.22, 0.05, 0.04)
    lamps = (abs((5.0 * u) % 1.0 - 0.5) < 0.16) & (abs(v - 0.9) < 0.014)
    colour[lamps] = (0.62, 0.58, 0.5)
    # The lamps below the ceiling light what is near and below them, and shelves shade the rest: the
    # goods still differ where a camera by night makes the brightest of them white.
    wide = 0.22 + 0.5 * np.clip(0.9 - v, 0.0, None)
    pools = np.exp(-((((5.0 * u) % 1.0 - 0.5) / wide) ** 2)) * 0.3 / wide
    shade = np.clip(colour / colour.mean(), 0.0, None) ** 0.5
    glow = 10.0 * colour * shade * ((0.3 + v) * (0.5 + 0.8 * pools))[..., None]
    glow[lamps] = 8.0 * glow.mean()
    return Texture(1.0, np.clip(colour, 0.01, 0.7), glow=_evenly(glow))


def _evenly(glow: FloatArray) -> FloatArray:
    """Light with a mean of 1 in each channel: the material says its colour."""
    whole = np.broadcast_to(np.clip(glow, 0.02, None), (SIZE, SIZE, 3))
    balanced: FloatArray = whole / whole.mean(axis=(0, 1))
    return balanced


def _room(rng: np.random.Generator) -> FloatArray:
    """A dim room, S x S x 3: a little lighter below, where daylight meets the floor."""
    _, v = grid(SIZE)
    light = 1.0 + 0.5 * (1.0 - v) + 0.25 * spectral(rng, SIZE, 2.0, 8.0)
    room: FloatArray = _ROOM * np.clip(light, 0.4, 3.0)[..., None]
    return room

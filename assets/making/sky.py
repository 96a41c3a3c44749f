"""The sky, in the axes of the files: +Y up."""
import numpy as np

from .images import write_hdr
from .patterns import mix, step

SUN = np.array([-.82, .55, .22])


def sky():
    """Clear evening: deep blue above, warm towards the horizon below the sun; a soft sun 7 degrees wide; dim, warm ground."""
    height, width = 256, 512
    theta = np.pi * (np.arange(height)[:, None] + .5) / height
    phi = 2 * np.pi * ((np.arange(width)[None] + .5) / width - .5)
    d = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta) + 0 * phi, np.sin(theta) * np.sin(phi)], 2)
    up = d[..., 1]
    sun = d @ (SUN / np.linalg.norm(SUN))
    towards = np.clip(d[..., [0, 2]] @ (SUN[[0, 2]] / np.hypot(SUN[0], SUN[2])), -1, 1) * .5 + .5
    above = np.clip(up, 0, 1)
    color = mix([.62, .70, .82], [.13, .24, .50], above ** .55)
    glow = np.exp(-above / .16) * (.25 + .75 * towards ** 2)
    color = mix(color, [1.45, .80, .40], np.clip(.85 * glow, 0, 1))
    ground = mix([.26, .21, .17], [.10, .085, .075], np.clip(-up, 0, 1) ** .5)
    color = mix(ground, color, step(0, up, .05))
    angle = np.degrees(np.arccos(np.clip(sun, -1, 1)))
    color = color + np.array([1.0, .74, .46]) * (.9 * np.exp(-angle / 11))[..., None]
    color = color + np.array([1.0, .83, .62]) * (190 * (1 - step(3.5, angle, 2.0)))[..., None]
    write_hdr("studio-sky.hdr", color)

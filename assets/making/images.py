"""Image files from arrays of rows from the top, with the values that are to be stored."""
import os
import struct
import zlib

import numpy as np

FOLDER = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def to_srgb(linear):
    c = np.clip(linear, 0, 1)
    return np.where(c <= 0.0031308, 12.92 * c, 1.055 * c ** (1 / 2.4) - 0.055)


def write_png(name, rgb):
    """8-bit RGB; each row filtered by whichever of the five filters leaves the least (PNG specification, section 12.7)."""
    rows = np.rint(np.clip(rgb, 0, 1) * 255).astype(np.int16)
    height, width, _ = rows.shape
    left, up = np.zeros_like(rows), np.zeros_like(rows)
    left[:, 1:], up[1:] = rows[:, :-1], rows[:-1]
    corner = np.zeros_like(rows)
    corner[1:, 1:] = rows[:-1, :-1]
    base = left + up - corner
    a, b, c = abs(base - left), abs(base - up), abs(base - corner)
    paeth = np.where((a <= b) & (a <= c), left, np.where(b <= c, up, corner))
    filtered = np.stack([rows - p for p in (np.zeros_like(rows), left, up, (left + up) >> 1, paeth)]) & 255
    best = np.minimum(filtered, 256 - filtered).sum((2, 3)).argmin(0)
    raw = b"".join(bytes([f]) + filtered[f, y].astype(np.uint8).tobytes() for y, f in enumerate(best))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    path = os.path.join(FOLDER, name)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
                   + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))
    return path


def write_hdr(name, rgb):
    """Radiance RGBE with run-length coding (Ward 1991)."""
    peak = rgb.max(2)
    _, exponent = np.frexp(np.maximum(peak, 1e-32))
    scale = np.ldexp(1.0, 8 - exponent)
    rgbe = np.concatenate([np.minimum(rgb * scale[..., None], 255), exponent[..., None] + 128.0], 2).astype(np.uint8)
    rgbe[peak < 1e-32] = 0
    height, width, _ = rgbe.shape
    out = [f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode()]
    for row in rgbe:
        out.append(bytes([2, 2, width >> 8, width & 255]))
        out += [run_length(row[:, channel].tobytes()) for channel in range(4)]
    with open(os.path.join(FOLDER, name), "wb") as file:
        file.write(b"".join(out))


def run_length(values):
    out, at = bytearray(), 0
    while at < len(values):
        end = at
        while end < len(values) and end - at < 128:
            if values[end:end + 4] == values[end:end + 1] * 4:
                break
            end += 1
        if end > at:
            out += bytes([end - at]) + values[at:end]
            at = end
        else:
            while end < len(values) and values[end] == values[at] and end - at < 127:
                end += 1
            out += bytes([128 + end - at, values[at]])
            at = end
    return bytes(out)

"""Images of ROS messages as files."""
from __future__ import annotations

import struct
import zlib
from typing import Any

import numpy as np

#: Channels, bits, and the order of channels that makes red, green, blue (or grey) of them.
RAW = {"mono8": (1, 8, (0,)), "8UC1": (1, 8, (0,)), "mono16": (1, 16, (0,)), "16UC1": (1, 16, (0,)),
       "rgb8": (3, 8, (0, 1, 2)), "bgr8": (3, 8, (2, 1, 0)), "8UC3": (3, 8, (2, 1, 0)), "rgba8": (4, 8, (0, 1, 2)),
       "bgra8": (4, 8, (2, 1, 0)),
       # Of these the brightness, which lies behind the colours or before them.
       "yuv422": (2, 8, (1,)), "uyvy": (2, 8, (1,)), "yuv422_yuy2": (2, 8, (0,)), "yuyv": (2, 8, (0,))}
#: The colours of the first two pixels of the first row and of the second.
BAYER = ("rggb", "bggr", "gbrg", "grbg")
RAW.update({f"bayer_{pattern}{bits}": (1, bits, (0,)) for pattern in BAYER for bits in (8, 16)})
COMPRESSED = {b"\xff\xd8\xff": ".jpg", b"\x89PNG\r\n\x1a\n": ".png"}


class ImageError(Exception):
    """What was found, and what was expected."""


def png(pixels: np.ndarray) -> bytes:
    """Of (height, width) or (height, width, 3), 8 or 16 bits."""
    height, width = pixels.shape[:2]
    bits = 8 * pixels.dtype.itemsize
    rows = pixels.astype(pixels.dtype.newbyteorder(">"), copy=False).reshape(height, -1).view(np.uint8)
    filtered = np.zeros((height, rows.shape[1] + 1), np.uint8)
    filtered[:, 1:] = rows

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    header = struct.pack(">IIBBBBB", width, height, bits, 0 if pixels.ndim == 2 else 2, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(filtered.tobytes(), 1)) +
            chunk(b"IEND", b""))


def _sums(values: np.ndarray) -> np.ndarray:
    """About each pixel but those at the rim, weighed by 1 2 1 along both sides."""
    rows = values[:-2] + 2 * values[1:-1] + values[2:]
    return rows[:, :-2] + 2 * rows[:, 1:-1] + rows[:, 2:]


def demosaiced(mosaic: np.ndarray, pattern: str) -> np.ndarray:
    """Red, green and blue: each pixel keeps its own colour, and has of the others the mean of the nearest that show them.

    ``pattern``: one of BAYER.
    """
    if min(mosaic.shape) < 2:
        raise ImageError(f"{mosaic.shape[1]}x{mosaic.shape[0]} of a Bayer pattern: expected at least 2x2")
    colours = np.empty((*mosaic.shape, 3), mosaic.dtype)
    values = np.pad(mosaic.astype(np.uint32), 1, mode="reflect")  # Which goes on with the pattern.
    for channel, colour in enumerate("rgb"):
        shows = np.zeros(mosaic.shape, np.uint32)
        for place in range(4):
            if pattern[place] == colour:
                shows[place // 2::2, place % 2::2] = 1
        shown = np.pad(shows, 1, mode="reflect")
        weights = _sums(shown)
        colours[:, :, channel] = np.where(shows == 1, mosaic, (_sums(shown * values) + weights // 2) // weights)
    return colours


def raw_pixels(message: Any) -> np.ndarray:
    """Of a sensor_msgs/Image."""
    if message.encoding not in RAW:
        raise ImageError(f"encoding is '{message.encoding}': expected one of {', '.join(RAW)}, or a CompressedImage")
    channels, bits, order = RAW[message.encoding]
    height, width, step = int(message.height), int(message.width), int(message.step)
    row_bytes = width * channels * bits // 8
    data = np.ascontiguousarray(message.data).view(np.uint8)
    if height < 1 or width < 1 or step < row_bytes or len(data) < step * height:
        raise ImageError(f"{len(data)} bytes of {width}x{height}, {step} a row: expected at least {row_bytes * height}, "
                         f"{row_bytes} a row")
    rows = np.ascontiguousarray(data[:step * height].reshape(height, step)[:, :row_bytes])
    numbers = rows.view((">" if message.is_bigendian else "<") + f"u{bits // 8}")
    pixels = numbers.reshape(height, width, channels)[:, :, list(order)]
    if message.encoding.startswith("bayer_"):
        return demosaiced(pixels[:, :, 0], message.encoding[len("bayer_"):][:4])
    return np.ascontiguousarray(pixels[:, :, 0] if len(order) == 1 else pixels)


def encoded_image(message: Any) -> tuple[bytes, str, tuple[int, int] | None]:
    """The file's bytes, its ending, and width and height where they are known without decoding."""
    if hasattr(message, "encoding"):
        pixels = raw_pixels(message)
        return png(pixels), ".png", (pixels.shape[1], pixels.shape[0])
    data = np.ascontiguousarray(message.data).tobytes()
    for begin, ending in COMPRESSED.items():
        if data.startswith(begin):
            size = struct.unpack(">II", data[16:24]) if ending == ".png" and len(data) >= 24 else None
            return data, ending, size
    raise ImageError(f"format '{message.format}' begins with {data[:4].hex() or 'nothing'}: expected JPEG or PNG")

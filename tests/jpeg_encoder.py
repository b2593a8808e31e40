"""Baseline JPEG of grey images (ITU-T T.81), with nothing but the standard library: for cameras that tests play."""
import math
import struct
from operator import mul

# T.81's example tables for luminance (Annex K): quantisation in zigzag order, then code lengths and values.
_ZIGZAG = sorted(range(64), key=lambda k: (k // 8 + k % 8, k % 8 if (k // 8 + k % 8) % 2 == 0 else k // 8))
_STEP = 4  # One quantisation step for all frequencies: fine enough for key points.
_DC_LENGTHS = (0, 1, 5, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0)
_DC_VALUES = bytes(range(12))
_COSINES = [[(math.sqrt(0.5) if u == 0 else 1) / 2 * math.cos((2 * x + 1) * u * math.pi / 16) for x in range(8)]
            for u in range(8)]


def _ac_table():
    """A code of 8 bits or 9 for every run and size: as short as it must be, not as it could be."""
    values = bytes([0x00, 0xF0] + [run << 4 | size for size in range(1, 11) for run in range(16)])
    lengths = [0] * 16
    lengths[7], lengths[8] = 128, len(values) - 128  # The rest of 8 bits' 256 codes has room for twice as many of 9.
    return tuple(lengths), values


_AC_LENGTHS, _AC_VALUES = _ac_table()


def _codes(lengths, values):
    codes, code, at = {}, 0, 0
    for length, count in enumerate(lengths, 1):
        for _ in range(count):
            codes[values[at]] = (code, length)
            code, at = code + 1, at + 1
        code <<= 1
    return codes


_DC, _AC = _codes(_DC_LENGTHS, _DC_VALUES), _codes(_AC_LENGTHS, _AC_VALUES)
_cache = {}


def _coefficients(block):
    """Quantised, in zigzag order, of 64 pixels."""
    if block not in _cache:
        rows = [[value - 128 for value in block[i:i + 8]] for i in range(0, 64, 8)]
        half = [[sum(map(mul, row, cosine)) for cosine in _COSINES] for row in rows]
        columns = list(zip(*half))
        full = [[sum(map(mul, column, cosine)) for column in columns] for cosine in _COSINES]
        _cache[block] = [round(full[k // 8][k % 8] / _STEP) for k in _ZIGZAG]
    return _cache[block]


def _append(bits, code, length):
    bits.append(format(code, f"0{length}b") if length else "")


def _append_number(bits, table, run, number):
    size = abs(number).bit_length()
    _append(bits, *table[run << 4 | size])
    if size:
        _append(bits, number if number > 0 else number + (1 << size) - 1, size)


def _scan(rows, width, height):
    bits, last = [], 0
    for y in range(0, height, 8):
        for x in range(0, width, 8):
            zigzag = _coefficients(b"".join(bytes(row[x:x + 8]) for row in rows[y:y + 8]))
            _append_number(bits, _DC, 0, zigzag[0] - last)
            last, run = zigzag[0], 0
            for number in zigzag[1:]:
                if number == 0:
                    run += 1
                    continue
                for _ in range(run // 16):
                    _append(bits, *_AC[0xF0])
                _append_number(bits, _AC, run % 16, number)
                run = 0
            if run:
                _append(bits, *_AC[0x00])
    text = "".join(bits)
    text += "1" * (-len(text) % 8)
    return int(text, 2).to_bytes(len(text) // 8, "big").replace(b"\xff", b"\xff\0")


def _segment(marker, content):
    return struct.pack(">BBH", 0xFF, marker, len(content) + 2) + content


def jpeg(rows):
    """Of rows of grey bytes; width and height are multiples of 8."""
    height, width = len(rows), len(rows[0])
    return (b"\xff\xd8" + _segment(0xDB, bytes([0] + [_STEP] * 64)) +
            _segment(0xC0, struct.pack(">BHHBBBB", 8, height, width, 1, 1, 0x11, 0)) +
            _segment(0xC4, bytes([0x00, *_DC_LENGTHS]) + _DC_VALUES) +
            _segment(0xC4, bytes([0x10, *_AC_LENGTHS]) + _AC_VALUES) +
            _segment(0xDA, bytes([1, 1, 0x00, 0, 63, 0])) + _scan(rows, width, height) + b"\xff\xd9")

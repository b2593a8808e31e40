"""A sequence that SLAM can follow, drawn with nothing but the standard library: patterned cards at several depths."""
import math
import random
import shutil
import struct
import zlib

WIDTH, HEIGHT = 320, 240
FOCAL_PX = 200.0
CARDS = 160
STEP_M = 0.06


def straight(frame):
    """Where the camera is at a frame."""
    return frame * STEP_M, 0.2 * frame * STEP_M


def weaving(frame):
    return frame * STEP_M + 0.3 * math.sin(0.5 * frame), 0.3 * math.cos(0.4 * frame)


def euroc(folder, frames, seed=1, path=straight, readout_s=0, rows_of=lambda rows: rows):
    """An EuRoC sequence of a camera that moves sideways, 10 images a second, and does not say how long it takes to read
    one, row by row. `rows_of` makes of an image's rows those that are written."""
    data = folder / "mav0/cam0/data"
    data.mkdir(parents=True)
    cards = make_cards(random.Random(seed))
    lines = ["#timestamp [ns],filename"]
    for index in range(frames):
        time = 10**9 + index * 10**8
        places = [path(index + (row / (HEIGHT - 1) - 0.5) * readout_s * 10) for row in range(HEIGHT)]
        (data / f"{time}.png").write_bytes(png(rows_of(draw_by_rows(cards, places))))
        lines.append(f"{time},{time}.png")
    (folder / "mav0/cam0/data.csv").write_text("\n".join(lines) + "\n")
    (folder / "mav0/cam0/sensor.yaml").write_text(
        "sensor_type: camera\nT_BS:\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\nrate_hz: 10\n"
        f"resolution: [{WIDTH}, {HEIGHT}]\ncamera_model: pinhole\n"
        f"intrinsics: [{FOCAL_PX}, {FOCAL_PX}, {(WIDTH - 1) / 2}, {(HEIGHT - 1) / 2}]\n"
        "distortion_model: radial-tangential\ndistortion_coefficients: [0, 0, 0, 0]\n")
    return folder


def photographs(scene, folder):
    """The images of a sequence as a folder of photographs that know nothing of one another; its path."""
    folder.mkdir(parents=True)
    for number, image in enumerate(sorted((scene / "mav0/cam0/data").iterdir())):
        shutil.copy(image, folder / f"{number:04}{image.suffix}")
    return folder


def make_cards(generator):
    """(depth, left, top, size, grey, pattern), the farthest first; metres."""
    cards = []
    for _ in range(CARDS):
        depth = generator.uniform(2, 6)
        pattern = [[generator.choice((-70, 0, 70)) for _ in range(4)] for _ in range(4)]
        cards.append((depth, generator.uniform(-0.9, 1.3) * depth, generator.uniform(-0.7, 0.7) * depth,
                      generator.uniform(0.3, 0.8), generator.randrange(80, 176), pattern))
    return sorted(cards, reverse=True)


def draw(cards, x, y):
    """The image, row by row, from a camera at (x, y, 0) that looks along z."""
    return draw_by_rows(cards, [(x, y)] * HEIGHT)


def draw_by_rows(cards, places):
    """The image, each row from a camera at its own (x, y, 0)."""
    rows = [bytearray([60]) * WIDTH for _ in range(HEIGHT)]
    first = 0
    while first < HEIGHT:
        last = first
        while last < HEIGHT and places[last] == places[first]:
            last += 1
        draw_rows(cards, *places[first], rows, first, last)
        first = last
    return rows


def draw_rows(cards, x, y, rows, first, last):
    """The rows from `first` to before `last`."""
    for depth, left, top, size, grey, pattern in cards:
        if edge(top - y, depth, HEIGHT) >= last or edge(top + size - y, depth, HEIGHT) <= first:
            continue
        cells = len(pattern)
        lines = [min(max(edge(top + size * i / cells - y, depth, HEIGHT), first), last) for i in range(cells + 1)]
        columns = [edge(left + size * i / cells - x, depth, WIDTH) for i in range(cells + 1)]
        for i in range(cells):
            strip = b"".join(bytes([grey + pattern[i][j]]) * (columns[j + 1] - columns[j]) for j in range(cells))
            for row in rows[lines[i]:lines[i + 1]]:
                row[columns[0]:columns[0] + len(strip)] = strip


def edge(offset, depth, length):
    """The pixel at which a card's edge lies, within the image."""
    return min(max(round(FOCAL_PX * offset / depth + length / 2), 0), length)


def png(rows):
    def chunk(kind, content):
        body = kind + content
        return struct.pack(">I", len(content)) + body + struct.pack(">I", zlib.crc32(body))

    header = struct.pack(">IIBBBBB", WIDTH, HEIGHT, 8, 0, 0, 0, 0)
    pixels = zlib.compress(b"".join(b"\0" + bytes(row) for row in rows), 1)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")

"""Datasets for the tests of commands, in every layout, made with nothing but the standard library."""
import os
import struct
import zlib
from pathlib import Path

EUROC_WIDTH, EUROC_HEIGHT = 752, 480
EUROC_PINHOLE = (458.654, 457.296, 367.215, 248.375)

SENSOR_YAML = """sensor_type: camera
T_BS:
  data: [1, 0, 0, 0,
         0, 1, 0, 0,
         0, 0, 1, 0,
         0, 0, 0, 1]
rate_hz: 20
resolution: [{width}, {height}]
camera_model: pinhole
intrinsics: [{fx}, 50, 31.5, 23.5]
distortion_model: radial-tangential
distortion_coefficients: {distortion}
"""


def camera_yaml(width=EUROC_WIDTH, height=EUROC_HEIGHT, pinhole=EUROC_PINHOLE):
    fx, fy, cx, cy = pinhole
    return (f"model: pinhole\nwidth: {width}\nheight: {height}\n"
            f"fx: {fx}\nfy: {fy}\ncx: {cx}\ncy: {cy}\nrate_hz: 20\n")


def png(width, height):
    """A grey gradient."""
    def chunk(kind, data):
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    rows = b"".join(b"\0" + bytes((3 * x + 2 * y) % 256 for x in range(width)) for y in range(height))
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) +
            chunk(b"IEND", b""))


def small_euroc(folder, *, times=(100, 200, 300), width=64, height=48, fx=50,
                distortion="[0.01, 0, 0, 0]"):
    """A sequence of 64x48 gradients: enough for everything that comes before the network."""
    data = folder / "mav0/cam0/data"
    data.mkdir(parents=True)
    for time in times:
        (data / f"{time}.png").write_bytes(png(64, 48))
    write_euroc_list(folder, [(time, f"{time}.png") for time in times])
    (folder / "mav0/cam0/sensor.yaml").write_text(
        SENSOR_YAML.format(width=width, height=height, fx=fx, distortion=distortion))
    return folder


def write_euroc_list(folder, frames):
    lines = ["#timestamp [ns],filename"] + [f"{time},{name}" for time, name in frames]
    (folder / "mav0/cam0/data.csv").write_text("\n".join(lines) + "\n")


def euroc_frames(sequence):
    """(nanoseconds, image file) of every frame of an EuRoC sequence."""
    cam0 = sequence / "mav0/cam0"
    lines = (cam0 / "data.csv").read_text().splitlines()
    fields = [line.split(",") for line in lines if not line.startswith("#")]
    return [(int(time), cam0 / "data" / name.strip()) for time, name in fields]


def euroc_part(folder, sequence, frames, times=None):
    """Some frames of an EuRoC sequence as another, with their own times or the given ones, ns."""
    data = folder / "mav0/cam0/data"
    data.mkdir(parents=True)
    (folder / "mav0/cam0/sensor.yaml").symlink_to(sequence / "mav0/cam0/sensor.yaml")
    names = []
    for index, (time, file) in enumerate(frames):
        (data / file.name).symlink_to(file)
        names.append((times[index] if times else time, file.name))
    write_euroc_list(folder, names)
    return folder


def tum(folder, frames):
    (folder / "rgb").mkdir(parents=True)
    lines = ["# timestamp filename"]
    for time, file in frames:
        (folder / "rgb" / file.name).symlink_to(file)
        lines.append(f"{time / 1e9:.6f} rgb/{file.name}")
    (folder / "rgb.txt").write_text("\n".join(lines) + "\n")
    (folder / "camera.yaml").write_text(camera_yaml())
    return folder


def kitti(folder, frames):
    (folder / "image_0").mkdir(parents=True)
    for index, (_, file) in enumerate(frames):
        (folder / "image_0" / f"{index:06}{file.suffix}").symlink_to(file)
    first = frames[0][0]
    (folder / "times.txt").write_text("".join(f"{(time - first) / 1e9:.6e}\n" for time, _ in frames))
    fx, fy, cx, cy = EUROC_PINHOLE
    (folder / "calib.txt").write_text(f"P0: {fx} 0 {cx} 0 0 {fy} {cy} 0 0 0 1 0\n")
    return folder


def photographs(folder, frames):
    """Without EXIF: by name, with a camera.yaml."""
    folder.mkdir()
    for index, (_, file) in enumerate(frames):
        (folder / f"IMG_{index}{file.suffix}").symlink_to(file)
    (folder / "camera.yaml").write_text(camera_yaml())
    return folder


def video(file, frames, rate_hz=10):
    """A Motion-JPEG AVI of JPEG files, with its calibration beside it."""
    file.write_bytes(mjpeg_avi([image.read_bytes() for _, image in frames], rate_hz))
    file.with_suffix(".yaml").write_text(camera_yaml())
    return file


def mjpeg_avi(jpegs, rate_hz, width=EUROC_WIDTH, height=EUROC_HEIGHT):
    """AVI 1.0 (RIFF) with one video stream and an index."""
    def chunk(kind, data):
        return kind + struct.pack("<I", len(data)) + data + b"\0" * (len(data) % 2)

    def chunks(kind, name, data):
        return chunk(kind, name + data)

    size, longest, has_index = len(jpegs), max(map(len, jpegs)), 0x10
    main_header = struct.pack("<14I", 1000000 // rate_hz, longest * rate_hz, 0, has_index, size, 0, 1,
                              longest, width, height, 0, 0, 0, 0)
    stream_header = b"vidsMJPG" + struct.pack("<IHHIIIIIIIIHHHH", 0, 0, 0, 0, 1, rate_hz, 0, size,
                                              longest, 0xFFFFFFFF, 0, 0, 0, width, height)
    stream_format = struct.pack("<IiiHH4sIiiII", 40, width, height, 1, 24, b"MJPG",
                                3 * width * height, 0, 0, 0, 0)
    stream = chunks(b"LIST", b"strl", chunk(b"strh", stream_header) + chunk(b"strf", stream_format))
    movie, index, key_frame = b"", b"", 0x10
    for jpeg in jpegs:
        index += struct.pack("<4sIII", b"00dc", key_frame, 4 + len(movie), len(jpeg))
        movie += chunk(b"00dc", jpeg)
    return chunks(b"RIFF", b"AVI ", chunks(b"LIST", b"hdrl", chunk(b"avih", main_header) + stream) +
                  chunks(b"LIST", b"movi", movie) + chunk(b"idx1", index))


def replace(file, content):
    """The content in place of a linked image, which stays as it is."""
    file.unlink()
    if content is not None:
        file.write_bytes(content)


def link_with_bytes(folder, name, target):
    """A link whose name need not be UTF-8."""
    path = os.path.join(os.fsencode(folder), name)
    os.symlink(os.fsencode(Path(target)), path)
    return path

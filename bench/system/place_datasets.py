"""Datasets made of real sequences to see what the program stands and whether places are known again: images left out,
darkened, blurred, turned, in another order, or two sequences one behind the other. TUM layout; images that stay as they
are become symbolic links."""
import hashlib
import json
import math
import shutil
import subprocess
import tempfile
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import damaged_images
from damaged_images import DAMAGES, MISSING, blurred, noisy, with_writing

if not MISSING:
    from PIL import Image

JPEG_QUALITY = 95
VIDEO_PIXEL_BITS = 0.05  # as of 720p at 30 images a second sent at 1.4 Mbit/s
VIDEO_GROUP_S = 2
SEQUENCES = ("7scenes_redkitchen", "euroc_mh01_excerpt", "uav_nadir_survey")
FLIGHT_CAMERAS = {"radial-tangential": "radial_tangential", "equidistant": "equidistant"}


def require_libraries(script):
    """Ends the script where what makes images is not installed."""
    if MISSING:
        raise SystemExit(f"{script}: no module {MISSING}: expected NumPy and Pillow, as in .venv after scripts/test.sh")


@dataclass(frozen=True)
class Camera:
    model: str
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple = ()

    def window(self, left, top, width, height):
        """The camera of a part of the image."""
        return Camera(self.model, width, height, self.fx, self.fy, self.cx - left, self.cy - top, self.distortion)

    def mirrored(self):
        distortion = list(self.distortion)
        if len(distortion) >= 4 and self.model == "radial_tangential":
            distortion[3] = -distortion[3]
        return replace(self, cx=self.width - 1 - self.cx, distortion=tuple(distortion))

    def around_centre(self, square):
        """The largest part of the image, square or not, that is the same when turned about the principal point."""
        half_width = min(self.cx, self.width - 1 - self.cx)
        half_height = min(self.cy, self.height - 1 - self.cy)
        if square:
            half_width = half_height = min(half_width, half_height)
        left, top = math.ceil(self.cx - half_width), math.ceil(self.cy - half_height)
        width, height = (math.floor(c + half) - start + 1 for c, half, start in
                         ((self.cx, half_width, left), (self.cy, half_height, top)))
        if square:
            width = height = min(width, height)
        return self.window(left, top, width, height)

    def seen_by_both(self, other):
        """The largest part of this camera's image that a scaled image of the other covers."""
        fx_ratio, fy_ratio = self.fx / other.fx, self.fy / other.fy
        left = max(0, math.ceil(self.cx - other.cx * fx_ratio))
        top = max(0, math.ceil(self.cy - other.cy * fy_ratio))
        right = min(self.width - 1, math.floor(self.cx + (other.width - 1 - other.cx) * fx_ratio))
        bottom = min(self.height - 1, math.floor(self.cy + (other.height - 1 - other.cy) * fy_ratio))
        return self.window(left, top, right - left + 1, bottom - top + 1)

    def yaml(self, rate_hz):
        fields = dict(asdict(self), distortion=list(self.distortion), rate_hz=rate_hz)
        return "".join(f"{name}: {value}\n" for name, value in fields.items())


@dataclass(frozen=True)
class Sequence:
    name: str
    rate_hz: float
    camera: Camera
    images: list
    truth: list  # position and quaternion (x y z w) of world_from_cam, or None, for each image
    horizontal: bool  # the truth knows no altitude and no orientation
    near_m: float  # two images so near (and with axes so close) surely show the same place
    near_deg: float = 25
    apart_m: float = math.inf  # two images so far apart surely do not


@dataclass(frozen=True)
class Shot:
    """One image of a derived dataset; index None: a black one."""
    sequence: Sequence
    index: int | None
    quarter_turns: int = 0
    brightness: float = 1
    blur_px: float = 0  # the way that the image moves during the exposure, in a direction drawn for each image
    noise: float = 0  # standard deviation, of 255
    mirrored: bool = False  # left and right change places, in the world as well
    writing: bool = False  # a display over the image, as many drones' videos have it
    damage: str = ""  # one of DAMAGES

    def truth(self):
        """The camera's pose; where the image is turned, so is the camera. Of a mirrored world only the position."""
        if self.index is None or not self.sequence.truth[self.index]:
            return None
        position, (x, y, z, w) = self.sequence.truth[self.index]
        if self.mirrored:
            return (-position[0], *position[1:]), (0, 0, 0, 1)
        angle = -self.quarter_turns * math.pi / 2
        s, c = math.sin(angle / 2), math.cos(angle / 2)
        return position, (x * c + y * s, y * c - x * s, z * c + w * s, w * c - z * s)


def read_rows(file, separator=None):
    return [line.split(separator) for line in file.read_text().splitlines() if line.strip() and line[0] != "#"]


def nearest(poses, time, tolerance):
    best = min(poses, key=lambda t: abs(t - time))
    return poses[best] if abs(best - time) <= tolerance else None


def load_redkitchen(folder):
    poses = {float(row[0]): (tuple(map(float, row[1:4])), tuple(map(float, row[4:8])))
             for row in read_rows(folder / "groundtruth.txt")}
    frames = read_rows(folder / "rgb.txt")
    return Sequence(folder.name, 30, Camera("pinhole", 640, 480, 585, 585, 320, 240),
                    [folder / file for _, file in frames], [nearest(poses, float(t), 1e-3) for t, _ in frames],
                    horizontal=False, near_m=0.3, apart_m=2.5)


def load_euroc(folder):
    poses = {}
    for row in read_rows(folder / "groundtruth_cam0.csv", ","):
        w, x, y, z = map(float, row[4:8])
        poses[int(row[0])] = tuple(map(float, row[1:4])), (x, y, z, w)
    frames = read_rows(folder / "mav0/cam0/data.csv", ",")
    camera = Camera("radial_tangential", 752, 480, 458.654, 457.296, 367.215, 248.375,
                    (-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05))
    return Sequence(folder.name, 20, camera, [folder / "mav0/cam0/data" / name.strip() for _, name in frames],
                    [nearest(poses, int(t), 5_000_000) for t, _ in frames], horizontal=False, near_m=0.3)


def exif_position_deg(file):
    with Image.open(file) as image:
        gps = image.getexif().get_ifd(0x8825)
    degrees = [sum(float(part) / 60**i for i, part in enumerate(gps[tag])) for tag in (2, 4)]
    return degrees[0] * (1 if gps[1] == "N" else -1), degrees[1] * (1 if gps[3] == "E" else -1)


def load_survey(folder):
    """Metres east and north on the ellipsoid's tangent plane: exact to millimetres over 200 m."""
    images = sorted((folder / "images").glob("*.JPG"))
    fixes = [exif_position_deg(file) for file in images]
    latitude = math.radians(fixes[0][0])
    semi_major_m, eccentricity2 = 6378137.0, 6.69437999014e-3
    w = 1 - eccentricity2 * math.sin(latitude)**2
    north_m, east_m = semi_major_m * (1 - eccentricity2) / w**1.5, semi_major_m / math.sqrt(w) * math.cos(latitude)
    truth = [((math.radians(lon - fixes[0][1]) * east_m, math.radians(lat - fixes[0][0]) * north_m, 0.0), (0, 0, 0, 1))
             for lat, lon in fixes]
    return Sequence(folder.name, 1, Camera("auto", 800, 600, 444.4, 444.4, 399.5, 299.5), images, truth,
                    horizontal=True, near_m=30, apart_m=100)


def load_kitti(folder):
    poses = {row[0]: (tuple(map(float, row[1:4])), tuple(map(float, row[4:8])))
             for row in read_rows(folder / "groundtruth.txt")}
    frames = read_rows(folder / "rgb.txt")
    camera = Camera("pinhole", 1226, 370, 707.0912, 707.0912, 601.8873, 183.1104)
    return Sequence(folder.name, 10, camera, [folder / file for _, file in frames],
                    [poses.get(time) for time, _ in frames], horizontal=False, near_m=5)


def load_flight(folder):
    """A flight as the program renders it."""
    fields = dict(line.split("#")[0].split(": ", 1) for line in (folder / "mav0/cam0/sensor.yaml").read_text().splitlines()
                  if ": " in line and not line.startswith(" "))
    def numbers(name):
        return [float(word) for word in fields[name].strip().strip("[]").split(",") if word.strip()]
    size = [int(value) for value in numbers("resolution")]
    distortion = tuple(numbers("distortion_coefficients"))
    model = FLIGHT_CAMERAS[fields["distortion_model"].strip()] if any(distortion) else "pinhole"
    camera = Camera(model, *size, *numbers("intrinsics"), distortion if any(distortion) else ())
    poses = {}
    for row in read_rows(folder / "groundtruth_cam0.csv", ","):
        w, x, y, z = map(float, row[4:8])
        poses[row[0]] = tuple(map(float, row[1:4])), (x, y, z, w)
    frames = read_rows(folder / "mav0/cam0/data.csv", ",")
    return Sequence(folder.name, numbers("rate_hz")[0], camera,
                    [folder / "mav0/cam0/data" / name.strip() for _, name in frames],
                    [poses.get(time) for time, _ in frames], horizontal=False, near_m=5)


def load_sequence(name, data):
    """A real sequence in the folder `data`, or a rendered flight by its own folder."""
    loaders = dict(zip((*SEQUENCES, "kitti07_excerpt"), (load_redkitchen, load_euroc, load_survey, load_kitti)))
    return loaders[name](data / name) if name in loaders else load_flight(Path(name))


def resample(image, source, target, quarter_turns):
    """The image of camera `source` as `target` would have taken it, turned about the optical axis. Lenses are taken to
    be alike: only focal lengths, principal point and size change."""
    cos, sin = ((1, 0), (0, 1), (-1, 0), (0, -1))[quarter_turns]
    xx, xy = cos * source.fx / target.fx, sin * source.fx / target.fy
    yx, yy = -sin * source.fy / target.fx, cos * source.fy / target.fy
    # Pillow puts (0, 0) at the corner of the first pixel, a camera at its centre.
    from_x, from_y, to_x, to_y = source.cx + 0.5, source.cy + 0.5, target.cx + 0.5, target.cy + 0.5
    affine = (xx, xy, from_x - xx * to_x - xy * to_y, yx, yy, from_y - yx * to_x - yy * to_y)
    return image.convert("L").transform((target.width, target.height), Image.Transform.AFFINE, affine,
                                        Image.Resampling.BICUBIC)


def write_image(shot, camera, folder, number):
    """Gives the file's name, relative to the dataset."""
    unchanged = shot == Shot(shot.sequence, shot.index) and shot.index is not None and camera == shot.sequence.camera
    if unchanged:
        file = folder / "rgb" / f"{number:06}{shot.sequence.images[shot.index].suffix.lower()}"
        file.symlink_to(shot.sequence.images[shot.index].resolve())
        return file.relative_to(folder)
    file = folder / "rgb" / f"{number:06}.jpg"
    if shot.index is None:
        image = Image.new("L", (camera.width, camera.height))
    else:
        with Image.open(shot.sequence.images[shot.index]) as original:
            if shot.mirrored:
                image = original.convert("L").transpose(Image.Transpose.FLIP_LEFT_RIGHT)
            else:
                image = resample(original, shot.sequence.camera, camera, shot.quarter_turns)
        if shot.blur_px > 0:
            image = blurred(image, shot.blur_px, shot.index)
        if shot.brightness != 1:
            image = image.point(lambda value: min(255, round(value * shot.brightness)))
        if shot.noise > 0:
            image = noisy(image, shot.noise, shot.index)
        if shot.writing:
            image = with_writing(image, number)
        if shot.damage:
            image = DAMAGES[shot.damage](image, shot.index)
    image.save(file, quality=JPEG_QUALITY)
    return file.relative_to(folder)


def send_as_video(folder, camera, rate_hz):
    """Puts what a drone's link leaves of the images in their place: H.264 at a low rate, without images from later."""
    files = sorted((folder / "rgb").iterdir())
    rate_bits = f"{VIDEO_PIXEL_BITS * camera.width * camera.height * rate_hz:.0f}"
    common = ["ffmpeg", "-nostdin", "-v", "error", "-y"]
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        video = Path(scratch) / "sent.mp4"
        subprocess.run([*common, "-framerate", f"{rate_hz:g}", "-i", folder / "rgb" / f"%06d{files[0].suffix}", "-vf",
                        "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=in_range=full:out_range=limited,format=yuv420p", "-c:v",
                        "libx264", "-preset", "veryfast", "-tune", "zerolatency", "-g",
                        str(max(1, round(VIDEO_GROUP_S * rate_hz))), "-b:v", rate_bits, "-maxrate", rate_bits, "-bufsize", rate_bits,
                        video], check=True)
        for file in files:
            file.unlink()
        window = f"crop={camera.width}:{camera.height}:0:0"
        subprocess.run([*common, "-i", video, "-vf", f"{window},scale=in_range=limited:out_range=full,format=gray",
                        "-start_number", "0", folder / "rgb" / "%06d.png"], check=True)
    return [file.relative_to(folder) for file in sorted((folder / "rgb").iterdir())]


def write_dataset(folder, camera, rate_hz, shots, video=False):
    """A dataset of the shots, one behind the other at the given rate; None is an image that was lost. Whatever was made
    before in the same way stays."""
    shots = [(number, shot) for number, shot in enumerate(shots) if shot]
    assert not video or shots[-1][0] + 1 == len(shots), "a video of lost images"
    recipe = [Path(__file__).read_text(), Path(damaged_images.__file__).read_text(), asdict(camera), rate_hz, video,
              [(n, str(s.index is not None and s.sequence.images[s.index]), s.quarter_turns, s.brightness, s.blur_px, s.noise,
                s.mirrored, s.writing, s.damage) for n, s in shots]]
    made_by = hashlib.sha256(json.dumps(recipe).encode()).hexdigest()
    stamp = folder / "made_by.txt"
    if stamp.is_file() and stamp.read_text() == made_by:
        return
    if folder.exists():
        shutil.rmtree(folder)
    (folder / "rgb").mkdir(parents=True)
    (folder / "camera.yaml").write_text(camera.yaml(rate_hz))
    files = [write_image(shot, camera, folder, number) for number, shot in shots]
    if video:
        files = send_as_video(folder, camera, rate_hz)
    with (folder / "rgb.txt").open("w") as frames, (folder / "groundtruth.txt").open("w") as truth:
        for (number, shot), file in zip(shots, files, strict=True):
            time_s = f"{number / rate_hz:.6f}"
            frames.write(f"{time_s} {file}\n")
            if shot.truth():
                position, quaternion = shot.truth()
                truth.write(" ".join([time_s, *(f"{value:.9f}" for value in (*position, *quaternion))]) + "\n")
    stamp.write_text(made_by)


def show_same_place(a, b):
    """True, False, or None where the truth does not tell."""
    if a.index is None or b.index is None or not a.truth() or not b.truth():
        return None
    sequence = a.sequence
    if sequence.name != b.sequence.name:
        return False
    distance_m = math.dist(a.truth()[0], b.truth()[0])
    between_deg = 0 if sequence.horizontal else axes_between_deg(a.truth()[1], b.truth()[1])
    if distance_m <= sequence.near_m and between_deg <= sequence.near_deg:
        return True
    return False if distance_m >= sequence.apart_m or between_deg >= 90 else None


def axes_between_deg(a, b):
    def optical_axis(quaternion):
        x, y, z, w = quaternion
        return 2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)
    cosine = sum(p * q for p, q in zip(optical_axis(a), optical_axis(b)))
    return math.degrees(math.acos(max(-1.0, min(1.0, cosine))))

"""What python_package_test.py has the package's Python do."""

# The ten lines of the page, and what they give.
LINES = """
import numpy as np, deepuav
result = deepuav.run("scene", out="python", schedule="sequential")
frames = result.frames
assert frames["world_from_camera"].shape == (40, 4, 4) and frames["id"].tolist() == list(range(40))
assert len(result.points) == result.maps[0].landmarks and result.main_map == 0 and result.failure == ""
world = deepuav.Map.load("python/map.deepuav")
assert world.keyframes["world_from_camera"].shape[0] == world.maps[0].keyframes > 2
assert np.allclose(world.points, result.points) and world.camera.lens == "radial_tangential"
error = deepuav.evaluate(result, result, align="none")
assert error.ate_m.rmse == 0 and error.pairs > 20, error.json
assert abs(deepuav.evaluate("program/trajectory.txt", "python/trajectory.txt").scale - 1) < 1e-9
images = sorted(__import__("pathlib").Path("scene/mav0/cam0/data").iterdir())
matches = deepuav.match(images[0], images[1])
assert len(matches.score) > 20 and abs(np.median(matches.b - matches.a, axis=0)[1]) < 5
"""

PIXELS = """
import struct, zlib, numpy as np
def pixels(file):  # a grey PNG as layered_scene draws it
    data, at, packed = file.read_bytes(), 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        if kind == b"IDAT": packed += data[at + 8:at + 8 + length]
        at += 12 + length
    return np.frombuffer(zlib.decompress(packed), np.uint8).reshape(240, 321)[:, 1:].copy()
"""

# Images of an array, a watcher, and what is refused.
PUSHED = PIXELS + """
import pathlib, deepuav
told = []
assert np.allclose(deepuav.ImuSensor(np.eye(4)).camera_from_imu, np.eye(4))
camera = deepuav.Camera.load(pathlib.Path("scene/mav0/cam0/sensor.yaml"))
slam = deepuav.Slam(camera, deepuav.options(features__size="small"), on_frame=told.append, on_keyframe=told.append)
for file in sorted(pathlib.Path("scene/mav0/cam0/data").iterdir()):
    slam.feed(pixels(file), int(file.stem))
slam.finish().write(pathlib.Path("pushed"))
assert [event["id"] for event in told if "state" in event] == list(range(40)), told
assert any(len(event.get("new_landmarks_world", ())) > 20 for event in told)
for wrong in (lambda: deepuav.run("absent"), lambda: deepuav.options(features__keypoint=1), lambda: slam.finish(),
              lambda: deepuav.Map.load("absent"), lambda: deepuav.evaluate("absent", "absent")):
    try: wrong()
    except deepuav.Error as error: assert str(error)
    else: raise AssertionError(wrong)
kept = deepuav.Slam(camera, on_map=lambda event: kept)  # given up, in a circle
"""

# With fixes of a camera that looks north, from when on it knows its place on Earth.
PLACED = PIXELS + """
import math, pathlib, time, deepuav, layered_scene
told, origin = [], (47.0, 8.0, 400.0)
degree = math.radians(6378137.0)
camera = deepuav.Camera.load(pathlib.Path("weaving/mav0/cam0/sensor.yaml"))
slam = deepuav.Slam(camera, deepuav.options(features__size="small"), on_frame=told.append)
for index, file in enumerate(sorted(pathlib.Path("weaving/mav0/cam0/data").iterdir())):
    right, down = layered_scene.weaving(index)
    slam.feed_fix(int(file.stem), origin[0], origin[1] + right / degree / math.cos(math.radians(origin[0])), origin[2] - down,
                  (0.001, 0.001, 0.001))
    slam.feed(pixels(file), int(file.stem))
    time.sleep(0.05)
slam.finish()
placed = [frame for frame in told if frame["metric"]]
assert len(placed) > 5, [frame["state"] for frame in told]
first = layered_scene.weaving(0)
for frame in placed:
    metric, (right, down) = frame["metric"], layered_scene.weaving(frame["id"])
    assert np.allclose(metric["origin"], (origin[0], origin[1], origin[2] - first[1]), rtol=0, atol=1e-9)
    assert metric["scale_sigma"] < 0.05
    off = metric["metric_from_camera"][:3, 3] - (right - first[0], 0, first[1] - down)
    assert np.allclose(metric["metric_from_camera"][:3, :3], [[1, 0, 0], [0, 0, 1], [0, -1, 0]], atol=0.05)
    assert np.abs(off).max() < 0.05, (frame["id"], off)
"""

# Of several threads at once, what they do one after the other.
THREADS = """
import pathlib, numpy as np, deepuav
from concurrent.futures import ThreadPoolExecutor
images = sorted(pathlib.Path("scene/mav0/cam0/data").iterdir())
pairs = [(images[i], images[i + 1 + i % 3]) for i in range(6)]
alone = [deepuav.match(*pair) for pair in pairs]
with ThreadPoolExecutor(4) as pool:
    together = list(pool.map(lambda pair: deepuav.match(*pair), 2 * pairs))
for one, other in zip(2 * alone, together):
    assert len(one.score) > 20 and all(np.array_equal(*both) for both in zip(one, other))
"""

# Other threads go on while the library works: one writes what is read, the other counts.
UNLOCKED = """
import os, threading, time, numpy as np, deepuav
reading, writing = os.pipe()
def write():
    time.sleep(0.2)
    os.write(writing, b"features:\\n  keypoints: 123\\n")
    os.close(writing)
threading.Thread(target=write).start()
options = deepuav.Options()
options.load(f"/dev/fd/{reading}")
assert dict(row[:2] for row in options.values())["features.keypoints"] == "123"
ticks, end = [], threading.Event()
def tick():
    while not end.wait(0.001): ticks.append(time.monotonic())
ticking = threading.Thread(target=tick)
ticking.start()
poses = np.tile(np.eye(4), (200_000, 1, 1))
poses[:, :3, 3] = np.random.default_rng(1).normal(size=(len(poses), 3))
times = np.arange(len(poses)) * 10**8
start = time.monotonic()
deepuav.evaluate((times, poses), (times, poses))
took = time.monotonic() - start
end.set()
ticking.join()
assert any(0.3 < (tick - start) / took < 0.7 for tick in ticks), (took, len(ticks))
"""

# A watcher that is held up until more happened than waits for it, and one of a run that begins anew.
WATCHED = """
import threading, numpy as np, deepuav
told, dropped, gate = [], [], threading.Event()
def on_frame(frame):
    gate.wait()
    told.append(frame["id"])
camera = deepuav.Camera(320, 240, 200, 200, 160, 120)
slam = deepuav.Slam(camera, deepuav.options(features__size="small"), on_frame=on_frame, on_dropped=dropped.append)
image = np.random.default_rng(1).integers(0, 255, (240, 320), np.uint8)
for index in range(300): slam.feed(image, index)
gate.set()
slam.finish()
assert told[-1] == 299 and sum(dropped) >= 300 - len(told) > 0, (len(told), dropped)
states, restarts = [], []
deepuav.run("rolling", on_frame=lambda frame: states.append(frame["state"]), on_restart=lambda: restarts.append(len(states)),
            mapping__readout__min_keyframes=5, mapping__readout__begin_anew_share=0)
assert restarts == [40] and len(states) == 80, (restarts, states)
"""

# Images minutes apart that come at that pace.
INTERRUPTED = """
import sys, deepuav
try:
    deepuav.run("slow", out="interrupted", schedule="live", on_frame=lambda frame: print("going", flush=True))
except KeyboardInterrupt:
    sys.exit(9)
"""

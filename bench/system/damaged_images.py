"""What happens to images on their way: motion blur, a display's writing, noise, and what weather, cameras and links do."""
import io
import math

try:
    import numpy as np
    from PIL import Image, ImageDraw, ImageFilter
except ModuleNotFoundError as error:  # --help needs neither
    MISSING = error.name
else:
    MISSING = None

BLUR_STEPS = 16


def blurred(image, length_px, seed):
    """As if the camera had moved by that much, to one side, during the exposure."""
    angle = np.random.default_rng(seed).uniform(0, math.pi)
    total = np.zeros((image.height, image.width))
    for along in np.linspace(-0.5, 0.5, BLUR_STEPS):
        dx, dy = along * length_px * math.cos(angle), along * length_px * math.sin(angle)
        total += np.asarray(image.transform(image.size, Image.Transform.AFFINE, (1, 0, dx, 0, 1, dy),
                                            Image.Resampling.BILINEAR))
    return Image.fromarray(np.rint(total / BLUR_STEPS).astype(np.uint8))


def with_writing(image, number):
    """What a display shows: lines of text that change, scales and a cross in the middle."""
    image = image.copy()
    draw = ImageDraw.Draw(image)
    width, height = image.size
    lines = [f"REC 00:{number // 60 % 60:02}:{number % 60:02}", "ISO 100  1/500  F2.8  4K",
             f"BAT 78  SAT 17  H 45.{number % 10}m"]
    for row, text in enumerate(lines):
        draw.rectangle((8, 8 + 14 * row, 8 + 6 * len(text), 20 + 14 * row), fill=20)
        draw.text((8, 8 + 14 * row), text, fill=255)
    draw.text((width - 150, height - 20), f"N 47.3{number % 1000:03} E 8.5{7 * number % 1000:03}", fill=255)
    x, y = width // 2, height // 2
    for near, far in ((8, 30), (-8, -30)):
        draw.line((x + near, y, x + far, y), fill=255, width=2)
        draw.line((x, y + near, x, y + far), fill=255, width=2)
    for tick in range(width // 3, 2 * width // 3, 12):
        draw.line((tick, height - 14, tick, height - 6), fill=255)
    for tick in range(height // 4, 3 * height // 4, 12):
        draw.line((width - 24, tick, width - 14, tick), fill=255)
    return image


def noisy(image, sigma, seed):
    values = np.asarray(image) + np.random.default_rng(seed).normal(0, sigma, (image.height, image.width))
    return Image.fromarray(np.clip(np.rint(values), 0, 255).astype(np.uint8))


def thermal(image, number):
    """As a thermal camera shows it: warm is dark, two fifths of the contrast, soft, columns of their own brightness, noise."""
    values = 160 - np.asarray(image.filter(ImageFilter.GaussianBlur(1.5))) / 2.55
    values = values + np.random.default_rng(0).normal(0, 3, image.width)
    return noisy(Image.fromarray(np.clip(np.rint(values), 0, 255).astype(np.uint8)), 3, number)


def foggy(image, number):
    """A fifth of the contrast, about a light grey."""
    return noisy(image.point(lambda value: round(120 + 0.2 * value)), 2, number)


def dark(image, number):
    """Of 15 % of the brightness, with a sensor's noise."""
    return noisy(image.point(lambda value: round(0.15 * value)), 4, number)


def wet(image, _number):
    """25 drops on the lens, out of focus, at places of their own."""
    draw_places = np.random.default_rng(3)
    mask = Image.new("L", image.size, 0)
    draw = ImageDraw.Draw(mask)
    for _ in range(25):
        x, y = draw_places.uniform(0, image.width), draw_places.uniform(0, image.height)
        radius = draw_places.uniform(0.02, 0.06) * image.width
        draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill=230)
    return Image.composite(image.filter(ImageFilter.GaussianBlur(12)), image, mask.filter(ImageFilter.GaussianBlur(6)))


def banded(image, number):
    """Lamps that flicker while a shutter rolls: bands of 0.7 to 1.3 times the brightness, elsewhere in each image."""
    rows = np.arange(image.height)[:, None] / image.height
    values = np.asarray(image) * (1 + 0.3 * np.sin(2 * math.pi * (1.7 * rows + 0.37 * number)))
    return Image.fromarray(np.clip(np.rint(values), 0, 255).astype(np.uint8))


def compressed(image, _number):
    """JPEG of quality 12, each image by itself."""
    file = io.BytesIO()
    image.save(file, "JPEG", quality=12)
    with Image.open(file) as again:
        return again.convert("L")


DAMAGES = {"thermal": thermal, "foggy": foggy, "dark": dark, "wet": wet, "banded": banded, "compressed": compressed}

# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The material of the quality study: drives, stationary vehicles, frames without content."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from benchmarks.shared.clips import Clip, kitti_clip, kitti_poses, mirrored, paste
from benchmarks.shared.conditions import Condition, CONDITIONS, each_frame
import cv2
import numpy as np
from phase_traj_ros.synthetic import (
    Camera,
    Drive,
    named_drive,
    plan_drive,
    pose_drive,
    poses_from_kitti,
    render_drive,
    Straight,
    Turn,
)
from phase_traj_ros.synthetic.degradations import gain, night, rain, sensor_noise

#: Number of frames of the parts along true poses.
_STRETCH = 120
_SMALL = Camera.with_field_of_view(320, 240, 80)
_VGA = Camera.with_field_of_view(640, 480, 60)
_HD = Camera.with_field_of_view(1280, 720, 70)
#: The creeping cameras, with their rates.
_CREEPING = {'KITTI': (Camera(), 10.0), '320x240': (_SMALL, 20.0), '640x480': (_VGA, 30.0)}
#: Prefixes of conditions under which there is little or nothing to see.
BLIND = ('lens covered', 'nearly blind')
#: Speed from which a vehicle has to be recognised as moving, in m/s.
_CREEP = 0.4


def _clip_of(drive: Drive) -> Clip:
    return Clip(drive.name, drive.camera, list(render_drive(drive)), drive.poses[:, 2])


def _fast_and_winding(sequence: str) -> Iterator[Drive]:
    """Yield the fastest part along true poses, and the one with the most turning."""
    matrices = kitti_poses(sequence)
    if matrices is None:
        return
    poses = poses_from_kitti(matrices)
    speed = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    turning = np.abs(np.diff(poses[:, 2]))
    for word, score in (('fast', speed), ('winding', turning)):
        first = int(np.convolve(score, np.ones(_STRETCH), 'valid').argmax())
        yield pose_drive(
            f'along {sequence}, {word}', poses[first:first + _STRETCH], seed=int(sequence))


def driving() -> list[Clip]:
    """Return clips of moving vehicles, real and rendered, of several cameras."""
    real = [clip for clip in (kitti_clip('00'), kitti_clip('06')) if clip is not None]
    turns = [Straight(1.5), Turn(90.0, 3.0, 4.5), Straight(1.0), Turn(-90.0, 3.0, 4.5),
             Straight(1.0)]
    drives = [
        named_drive('demo'), *_fast_and_winding('02'), *_fast_and_winding('08'),
        plan_drive('320x240, 20 Hz', turns, rate_hz=20, camera=_SMALL, speed=8.0, seed=21),
        plan_drive('640x480, 30 Hz', turns, rate_hz=30, camera=_VGA, speed=10.0, seed=22),
        plan_drive('1280x720, 15 Hz', turns, rate_hz=15, camera=_HD, speed=12.0, seed=23)]
    return [*real, *(mirrored(clip) for clip in real[:1]), *map(_clip_of, drives)]


def windows(clip: Clip, count: int, length: int, seed: int) -> Clip:
    """Return ``count`` parts of ``length`` frames each, one after the other."""
    rng = np.random.default_rng(seed)
    firsts = rng.choice(len(clip.frames) - length + 1, count, replace=False)
    index = (np.sort(firsts)[:, None] + np.arange(length)).ravel()
    return replace(clip, frames=[clip.frames[each] for each in index], yaw=clip.yaw[index])


def named(*names: str) -> list[Condition]:
    """Return the conditions with these names."""
    return [next(each for each in CONDITIONS if each.name == name) for name in names]


def cropped(frame: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Return the middle of a frame, enlarged if it is too small."""
    scale = max(shape[0] / frame.shape[0], shape[1] / frame.shape[1])
    if scale > 1:
        size = [int(np.ceil(side * scale)) for side in frame.shape[::-1]]
        frame = cv2.resize(frame, size, interpolation=cv2.INTER_LINEAR)
    top, left = ((had - wanted) // 2 for had, wanted in zip(frame.shape, shape))
    return np.ascontiguousarray(frame[top:top + shape[0], left:left + shape[1]])


def _glared(frame: np.ndarray, spread: float, seed: int) -> np.ndarray:
    """Simulate a view into the sun: little contrast around it, none in the middle."""
    rng = np.random.default_rng(seed)
    rows, columns = (np.arange(side) for side in frame.shape)
    row, column = rng.uniform(0.2, 0.6) * len(rows), rng.uniform(0.3, 0.7) * len(columns)
    distance = np.hypot(rows[:, None] - row, columns[None] - column) / (spread * len(columns))
    return np.clip(0.25 * frame + 420 * np.exp(-distance ** 2), 0, 255).astype(np.uint8)


def blind_frames(clip: Clip, seed: int) -> Iterator[tuple[str, np.ndarray, np.ndarray, bool]]:
    """Yield pairs of frames with little or nothing to see: name, both frames, related."""
    black = np.zeros(clip.shape, np.uint8)
    shade = _glared(black, 0.8, seed) // 4

    def noisy(frame: np.ndarray, number: int, sigma: float = 3.0) -> np.ndarray:
        return sensor_noise(frame, sigma=sigma, seed=(seed, number))

    at = seed % (len(clip.frames) - 1)
    first, second = clip.frames[at], clip.frames[at + 1]
    yield 'lens covered: black, noise', noisy(black, 1), noisy(black, 2), False
    yield 'lens covered: grey, noise', noisy(black + 40, 1), noisy(black + 40, 2), False
    yield 'lens covered: a shade, noise', noisy(shade, 1), noisy(shade, 2), False
    yield 'lens covered: just now', first, noisy(black, 2), False
    for sigma in (12, 25):
        blurred = (cv2.GaussianBlur(frame, (0, 0), sigma) for frame in (first, second))
        yield (f'nearly blind: blur, σ = {sigma} px, noise', *(
            noisy(frame, number, 2.0) for number, frame in enumerate(blurred)), True)
    for word, spread in (('half of it', 0.8), ('nearly all', 2.0)):
        glared = (_glared(frame, spread, seed) for frame in (first, second))
        yield (f'nearly blind: glare, {word}, noise', *(
            noisy(frame, number, 2.0) for number, frame in enumerate(glared)), True)


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """Frames of a stationary or moving vehicle, and when it moves."""

    name: str
    condition: str
    frames: list[np.ndarray]
    moving: np.ndarray
    """(n - 1,) whether it moved between two frames; NaN if not defined."""
    interval: float = 0.1
    """Seconds between the frames."""


def _held(frame: np.ndarray, count: int, seed: int) -> Iterator[tuple[str, list[np.ndarray]]]:
    """Yield the view of a stationary camera, once for each disturbance, with its name."""
    def each(spoil: Callable[[np.ndarray, tuple[int, int]], np.ndarray]) -> list[np.ndarray]:
        return [spoil(frame, (seed, number)) for number in range(count)]

    def jpeg(noisy: np.ndarray, quality: int) -> np.ndarray:
        coded = cv2.imencode('.jpg', noisy, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
        return np.asarray(cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE))

    for sigma in (1, 5, 15, 25):
        yield f'noise, σ = {sigma}', each(
            lambda image, seeds, sigma=sigma: sensor_noise(image, sigma=sigma, seed=seeds))
    yield 'noise, σ = 5, JPEG 30', each(
        lambda image, seeds: jpeg(sensor_noise(image, sigma=5, seed=seeds), 30))
    yield 'night', each(lambda image, seeds: night(image, seed=seeds))
    yield 'gain 0.6–1.4 by chance', each(lambda image, seeds: gain(
        image, factor=np.random.default_rng(seeds).uniform(0.6, 1.4)))
    yield 'rain', each(_streaked)
    for pixels in (0.1, 0.3, 0.6):
        yield f'shaking, {pixels} px of 1241', each(
            lambda image, seeds, pixels=pixels: sensor_noise(
                _shaken(image, pixels, seeds), sigma=3, seed=seeds))
    for share in (0.1, 0.25, 0.4, 0.6):
        for speed in (0.01, 0.03):
            yield f'a vehicle passes, {100 * share:g} % wide', [
                sensor_noise(image, sigma=5, seed=(seed, number))
                for number, image in enumerate(_passed(frame, count, share, speed, seed))]
    yield 'people pass', [
        sensor_noise(image, sigma=5, seed=(seed, number))
        for number, image in enumerate(_walked(frame, count, seed))]


def _shaken(frame: np.ndarray, pixels: float, seed: tuple[int, int]) -> np.ndarray:
    """Return the frame with the vibration of an idling engine; pixels of a width of 1241."""
    height, width = frame.shape
    across, down, roll = np.random.default_rng(seed).normal(0, pixels * width / 1241, 3)
    matrix = cv2.getRotationMatrix2D(
        (width / 2, height / 2), float(np.degrees(roll / (width / 2))), 1.0)
    matrix[:, 2] += across / 2, down
    return cv2.warpAffine(
        frame, matrix, (width, height), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)


def _texture(shape: tuple[int, int], seed: int) -> np.ndarray:
    """Return panes and panels like those of a vehicle's side."""
    rng = np.random.default_rng(seed)
    texture = np.full(shape, rng.integers(60, 200), np.uint8)
    for _ in range(25):
        top, left = rng.integers(0, shape[0]), rng.integers(0, shape[1])
        tall, wide = rng.integers(2, max(shape[0] // 3, 3)), rng.integers(2, max(shape[1] // 3, 3))
        texture[top:top + tall, left:left + wide] = rng.integers(10, 245)
    return cv2.GaussianBlur(texture, (0, 0), 1.0)


def _passed(
    frame: np.ndarray, count: int, share: float, speed: float, seed: int,
) -> Iterator[np.ndarray]:
    """Yield the view of a stationary camera while a vehicle passes in front of it."""
    height, width = frame.shape
    vehicle = _texture((int(min(0.75, 1.6 * share) * height), int(share * width)), seed)
    start = np.random.default_rng(seed).uniform(-share, 1.0 - share)
    for number in range(count):
        image = frame.copy()
        left = (start + share + number * speed) % (1.0 + share) - share
        paste(image, vehicle, int(0.9 * height) - len(vehicle), round(left * width))
        yield image


def _walked(frame: np.ndarray, count: int, seed: int) -> Iterator[np.ndarray]:
    """Yield the view of a stationary camera while people cross."""
    height, width = frame.shape
    rng = np.random.default_rng(seed)
    people = [
        (_texture((int(0.35 * height), max(int(0.03 * width), 4)), seed + number),
         rng.uniform(0, 1), rng.uniform(-0.005, 0.005)) for number in range(6)]
    for number in range(count):
        image = frame.copy()
        for person, start, speed in people:
            left = int((start + number * speed) % 1.0 * width)
            paste(image, person, int(0.5 * height), left)
        yield image


def standing(clips: list[Clip], *, pictures: int, count: int) -> Iterator[Stretch]:
    """Yield single frames of clips, held for ``count`` frames and disturbed."""
    for number, clip in enumerate(clips):
        rng = np.random.default_rng(number)
        for index in rng.choice(len(clip.frames), pictures, replace=False):
            for condition, frames in _held(clip.frames[index], count, int(index)):
                yield Stretch(clip.name, condition, frames, np.zeros(len(frames) - 1))


def creeping() -> Iterator[Stretch]:
    """Yield rendered drives that stop, creep and continue, under several conditions."""
    conditions = [
        *named('as they are', 'noise, σ = 10', 'noise, σ = 20', 'night, 6 % of the light'),
        Condition('rain', each_frame(_streaked, seeded=True)),
        Condition('shaking, 0.4 px of 1241', each_frame(_shaken, seeded=True, pixels=0.4)),
        Condition('only lights are seen', each_frame(_only_lights))]
    plan = [Straight(2.0, 6.0), Straight(4.0, 0.0), Straight(4.0, 0.5), Straight(3.0, 1.0),
            Straight(3.0, 2.0), Straight(3.0, 0.0), Straight(2.0, 5.0)]
    for name, (camera, rate) in _CREEPING.items():
        drive = plan_drive(name, plan, rate_hz=rate, camera=camera, seed=31)
        clip = _clip_of(drive)
        speed = np.hypot(*np.diff(drive.poses[:, :2], axis=0).T) * rate
        moving = np.where(speed >= _CREEP, 1.0, np.where(speed == 0.0, 0.0, np.nan))
        for condition in conditions:
            frames = condition.spoil(clip, 0).frames
            yield Stretch(name, condition.name, frames, moving, 1.0 / rate)


def _streaked(frame: np.ndarray, seed: tuple[int, int]) -> np.ndarray:
    """Return the frame with rain, equally dense for small and large images."""
    return rain(frame, streaks=max(400 * frame.size // (376 * 1241), 1), seed=seed)


def _only_lights(frame: np.ndarray) -> np.ndarray:
    """Blacken all but the bright parts, like a camera at night, without noise."""
    return np.clip((frame.astype(np.int16) - 140) * 2, 0, 255).astype(np.uint8)


@dataclass(frozen=True, slots=True, eq=False)
class Overlay:
    """A fixed object in front of the scene, or in the image."""

    name: str
    opacity: np.ndarray
    """(H, W) from 0 to 1."""
    tone: np.ndarray
    """(H, W) grey levels."""
    added: np.ndarray | float = 0.0
    """(H, W) grey levels added to the whole image."""

    def over(self, frame: np.ndarray) -> np.ndarray:
        """Return the frame with the overlay."""
        mixed = frame * (1 - self.opacity) + self.tone * self.opacity + self.added
        return np.clip(np.rint(mixed), 0, 255).astype(np.uint8)

    @property
    def mask(self) -> np.ndarray:
        """Return a mask as a user would draw it: 0 roughly where it is, and 255 elsewhere."""
        hidden = (self.opacity > 0.02).astype(np.uint8)
        side = max(self.opacity.shape[1] // 200, 1)
        return 255 * (1 - cv2.dilate(hidden, np.ones((side, 2 * side), np.uint8)))


def overlays(shape: tuple[int, int], seed: int) -> list[Overlay]:
    """Return overlays that may lock the peak to zero."""
    rng = np.random.default_rng(seed)
    nothing = np.zeros(shape, np.float32)
    text = _text(shape)
    dirt, bonnet = _dirt(shape, rng), _bonnet(shape)
    tone = np.full(shape, 60.0, np.float32)
    shiny = cv2.GaussianBlur(rng.normal(0, 1, shape).astype(np.float32), (0, 0), 2.0)
    metal = tone + 25 * shiny / shiny.std()
    fixed = rng.normal(0, 2, shape) + rng.normal(0, 1.5, (1, shape[1]))
    everything = np.maximum(np.maximum(dirt, bonnet), text[0])
    return [
        Overlay('none', nothing, nothing),
        Overlay('bonnet', bonnet, metal),
        Overlay('dirt', dirt, tone),
        Overlay('burnt-in text', *text),
        Overlay('bonnet, dirt, text', everything, np.where(text[0] > 0, text[1], metal)),
        Overlay('fixed noise of the sensor, σ = 2.5', nothing, nothing, fixed),
    ]


def _bonnet(shape: tuple[int, int]) -> np.ndarray:
    height, width = shape
    edge = height * (0.8 + 0.07 * np.linspace(-1, 1, width) ** 2)
    return np.clip(np.arange(height)[:, None] - edge, 0, 1).astype(np.float32)


def _dirt(shape: tuple[int, int], rng: np.random.Generator) -> np.ndarray:
    height, width = shape
    dirt = np.zeros(shape, np.float32)
    for _ in range(120):
        spot = np.zeros(shape, np.float32)
        radius = max(int(rng.uniform(2, 18) * width / 1241), 1)
        middle = (int(rng.uniform(0, width)), int(rng.uniform(0, height)))
        axes = (radius, max(int(radius * rng.uniform(0.4, 1)), 1))
        cv2.ellipse(spot, middle, axes, rng.uniform(0, 180), 0, 360, rng.uniform(0.4, 0.95), -1)
        dirt = np.maximum(dirt, cv2.GaussianBlur(spot, (0, 0), rng.uniform(0.5, 2)))
    return dirt


def _text(shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    height, width = shape
    hidden, tone = np.zeros(shape, np.uint8), np.zeros(shape, np.uint8)
    size = 1.3 * width / 1241
    lines = (('2024-05-17 14:23:05 CAM1 FRONT 48.1372N 11.5756E', 0.03, 0.1),
             ('DASHCAM  SPEED 42 km/h', 0.5, 0.96))
    for line, left, bottom in lines:
        place = (int(left * width), int(bottom * height))
        for canvas, value, thick in (
                (hidden, 255, 5), (tone, 0, 5), (hidden, 255, 2), (tone, 255, 2)):
            cv2.putText(canvas, line, place, cv2.FONT_HERSHEY_SIMPLEX, size, value,
                        max(int(thick * size), 1), cv2.LINE_AA)
    return (hidden / 255).astype(np.float32), tone.astype(np.float32)

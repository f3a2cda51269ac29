# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The reasons against a result, and the evidence of a pair of frames."""

from enum import Enum


class Reason(Enum):
    """Why a result is not reliable. The value is the word used in files and messages."""

    sentence: str
    """The reason as a sentence for users."""

    def __new__(cls, word: str, sentence: str = '') -> 'Reason':
        """Make a member with its word and its sentence."""
        member = object.__new__(cls)
        member._value_, member.sentence = word, sentence
        return member

    TOO_SHORT = 'too_short', 'There are too few frames to judge, and the few are in doubt.'
    NOTHING_TO_SEE = 'nothing_to_see', (
        'Most images show too little: they are dark or blank, or the lens is covered.')
    VIEW_BLOCKED = 'view_blocked', (
        'Most of what the images show is fixed to the camera, such as drops or dirt on'
        ' the windscreen.')
    NOT_ONE_MOTION = 'not_one_motion', (
        'The parts of the image do not move as seen from one vehicle in a static world.')
    SHAKING = 'shaking', 'The camera turns back and forth faster than a vehicle can.'
    RATE_TOO_LOW = 'rate_too_low', (
        'The frames are too far apart in time: give more frames per second.')
    MANY_CUTS = 'many_cuts', 'The video is cut into scenes that are too short to show a turn.'
    CAMERA_NOT_KNOWN = 'camera_not_known', (
        'The focal length is not known well enough, or not from the start: give hfov_deg'
        ' or a calibration.')
    CAMERA_CONTRADICTED = 'camera_contradicted', (
        'The turns contradict the given lens: correct hfov_deg, focal_px or'
        ' lens_straightness, or leave them out to learn the lens.')
    NOT_COMPARED = 'not_compared', (
        'Most frames cannot be compared with the one before: they are further apart than'
        ' max_gap, or they differ in size or encoding.')
    FROZEN = 'frozen', 'The camera repeats one image, or one stamp, for more than a second.'
    FRAMES_LOST = 'frames_lost', (
        'Parts of the drive have no frames: they were lost, or could not be used.')
    HEADING_UNKNOWN = 'heading_unknown', (
        'A turn may be lost or wrong: the heading was not measured while the yaw rate'
        ' changed.')
    DISTANCE_UNKNOWN = 'distance_unknown', (
        'The distance of parts of the drive is unknown: the road is not visible, or it'
        ' moves too far between two frames.')
    ROAD_UNCLEAR = 'road_unclear', (
        'Another motion stands out more on the road than that of the vehicle: the video'
        ' is strongly compressed, something covers the road, the frames are too far apart,'
        ' or a given speed has the wrong sign.')
    DIRECTION_CONTRADICTS_HEADING = 'direction_contradicts_heading', (
        'On a straight, the heading is more than 60 degrees away from the direction code.')


class Evidence(Enum):
    """Quality of the measurement of a pair of frames."""

    TRUSTED = 'trusted'
    STILL = 'still'
    """The vehicle was stationary: neither for nor against."""
    BLANK = 'blank'
    """The image holds only noise."""
    FIXED = 'fixed'
    """Only areas fixed to the camera agree."""
    SCATTERED = 'scattered'
    """The parts of the image do not agree on a motion."""
    JERKED = 'jerked'
    """They agree on a rotation that is impossible for a vehicle."""
    APART = 'apart'
    """The frames could not be compared: against the result only if this applies to most pairs."""
    REPEATED = 'repeated'
    """Both frames show one picture: neither for nor against, unless the camera is frozen."""

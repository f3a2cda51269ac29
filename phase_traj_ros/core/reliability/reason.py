# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The reasons against a result, and the evidence of a pair of frames."""

from enum import Enum


class Reason(Enum):
    """Why a result is not reliable. The value is the word used in files and messages."""

    TOO_SHORT = 'too_short'
    NOTHING_TO_SEE = 'nothing_to_see'
    VIEW_BLOCKED = 'view_blocked'
    NOT_ONE_MOTION = 'not_one_motion'
    SHAKING = 'shaking'
    RATE_TOO_LOW = 'rate_too_low'
    MANY_CUTS = 'many_cuts'
    CAMERA_NOT_KNOWN = 'camera_not_known'
    CAMERA_CONTRADICTED = 'camera_contradicted'
    NOT_COMPARED = 'not_compared'
    FROZEN = 'frozen'
    FRAMES_LOST = 'frames_lost'
    HEADING_UNKNOWN = 'heading_unknown'
    DISTANCE_UNKNOWN = 'distance_unknown'
    ROAD_UNCLEAR = 'road_unclear'
    DIRECTION_CONTRADICTS_HEADING = 'direction_contradicts_heading'

    @property
    def sentence(self) -> str:
        """Return the reason as a sentence for users."""
        return _SENTENCES[self]


_SENTENCES = {
    Reason.TOO_SHORT: 'There are too few frames to judge, and the few are in doubt.',
    Reason.NOTHING_TO_SEE: 'Most images show too little: they are dark or blank, or the lens is'
                           ' covered.',
    Reason.VIEW_BLOCKED: 'Most of what the images show is fixed to the camera, such as drops or'
                         ' dirt on the windscreen.',
    Reason.NOT_ONE_MOTION: 'The parts of the image do not move as seen from one vehicle in a'
                           ' static world.',
    Reason.SHAKING: 'The camera turns back and forth faster than a vehicle can.',
    Reason.RATE_TOO_LOW: 'The frames are too far apart in time: give more frames per second.',
    Reason.MANY_CUTS: 'The video is cut into scenes that are too short to show a turn.',
    Reason.CAMERA_NOT_KNOWN: 'The focal length is not known well enough, or not from the start:'
                             ' give hfov_deg or a calibration.',
    Reason.CAMERA_CONTRADICTED: 'The turns contradict the given lens: correct hfov_deg, focal_px'
                                ' or lens_straightness, or leave them out to learn the lens.',
    Reason.NOT_COMPARED: 'Most frames cannot be compared with the one before: they are further'
                         ' apart than max_gap, or they differ in size or encoding.',
    Reason.FROZEN: 'The camera repeats one image, or one stamp, for more than a second.',
    Reason.FRAMES_LOST: 'Parts of the drive have no frames: they were lost, or could not be used.',
    Reason.HEADING_UNKNOWN: 'A turn may be lost or wrong: the heading was not measured while the'
                            ' yaw rate changed.',
    Reason.DISTANCE_UNKNOWN: 'The distance of parts of the drive is unknown: the road is not'
                             ' visible, or it moves too far between two frames.',
    Reason.ROAD_UNCLEAR: 'Another motion stands out more on the road than that of the vehicle: the'
                         ' video is strongly compressed, something covers the road, the frames are'
                         ' too far apart, or a given speed has the wrong sign.',
    Reason.DIRECTION_CONTRADICTS_HEADING: 'On a straight, the heading is more than 60 degrees away'
                                          ' from the direction code.',
}


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

"""All desks, in the order of their tabs."""

from retarget.workbench import capture_desk, folder, posing_desk, stage_desk
from retarget.workbench.desks import Desk

DESKS: tuple[Desk, ...] = (folder.DESK, capture_desk.DESK, stage_desk.DESK, posing_desk.DESK)

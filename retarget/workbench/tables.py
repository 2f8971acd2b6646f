"""All desks, in the order of their tabs."""

from retarget.workbench.capturing import desk as capture_desk
from retarget.workbench.desks import Desk
from retarget.workbench.folder import desk as folder
from retarget.workbench.posing import desk as posing_desk
from retarget.workbench.staging import desk as stage_desk

DESKS: tuple[Desk, ...] = (folder.DESK, capture_desk.DESK, stage_desk.DESK, posing_desk.DESK)

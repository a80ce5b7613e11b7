"""The verb `run_campaign`: plays a campaign unattended, and goes on at the stage where it stopped."""

from __future__ import annotations

import os
import shutil
import time
from dataclasses import replace
from os import PathLike
from pathlib import Path

from oed.campaigns.result import CAMPAIGN, Campaign
from oed.campaigns.runs.player import INTERRUPTED, Player
from oed.campaigns.runs.result import CampaignRun
from oed.campaigns.runs.stage_progress import PROGRESS_PERIOD, StageProgress
from oed.campaigns.runs.state import LOGS, RUN, RecordedStage, RunState, run_lock
from oed.campaigns.timetable import Slot
from oed.controllers import Endpoint, StreamOptions
from oed.controllers.recording.clock import ClockAnchor
from robots.common.errors import InputError, OedError
from robots.common.files import sha256
from robots.common.progress import SILENT, Progress
from robots.robot import Robot


def run_campaign(
    folder: str | PathLike[str],
    endpoint: Endpoint,
    *,
    robot: Robot | None = None,
    options: StreamOptions | None = None,
    speed: float = 1.0,
    collision: bool = True,
    progress: Progress = SILENT,
) -> CampaignRun:
    """Plays a planned campaign on a controller and records a log for each stage.

    The timetable is kept: stages follow each other, and the robot rests where nothing is planned. After each stage the
    file ``run.json`` is replaced, so a run that was ended in any way goes on at the stage where it stopped. A stage
    that was cut short is played again from its beginning; its recording is kept in the folder ``interrupted``. Before
    that the robot is moved home slowly, on a way that is proved free of collisions.

    Args:
        folder: of the campaign, where ``campaign.json`` is; logs go to its folder ``logs``.
        endpoint: the controller.
        robot: of the campaign; by default the one that it names.
        options: of the streams.
        speed: how many times faster than real time the controller plays, for controllers to test against.
        collision: whether moves home are checked for collisions.
        progress: listener; its unit is the second of the timetable.

    Returns:
        What was recorded.

    Raises:
        InputError: no campaign or another one than before, a robot that stands elsewhere at the first start, another
            program that plays the campaign, or a disk without room for the logs.
        LinkError: the controller cannot be reached, or falls silent.
        ControllerError: the controller is not ready, or the robot does not reach the end of a stage.
    """
    if not speed > 0:
        raise InputError(f"a speed of {speed}", allowed="above 0")
    place = Path(folder)
    campaign = Campaign.load(place, robot)
    with run_lock(place, "plays this campaign"):
        digest = sha256(place / CAMPAIGN)
        state = RunState.load(place)
        if state is None:
            state = RunState(campaign=digest)
        elif state.campaign != digest:
            raise InputError(
                "the campaign was planned again after its run had begun",
                file=place / RUN,
                remedy="choose another folder for the new campaign",
            )
        run = _Run(campaign, place, endpoint, options or StreamOptions(), state, speed, collision, progress)
        return run.play()


class _Run:
    """One start of a run."""

    def __init__(
        self,
        campaign: Campaign,
        folder: Path,
        endpoint: Endpoint,
        options: StreamOptions,
        state: RunState,
        speed: float,
        collision: bool,
        progress: Progress,
    ) -> None:
        self.campaign, self.folder, self.state = campaign, folder, state
        self.speed, self.progress = speed, progress
        self.player = Player(
            robot=campaign.robot,
            home=campaign.home,
            endpoint=endpoint,
            options=options,
            folder=folder,
            bodies=campaign.surroundings.model(campaign.robot) if collision else None,
        )
        self.played = [slot for slot in campaign.slots if slot.stage is not None]
        self.width = max(3, len(str(len(self.played))))

    def play(self) -> CampaignRun:
        begin = time.monotonic()
        first = len(self.state.recorded)
        if not self.state.starts and any((self.folder / LOGS).glob("*")):
            raise InputError("holds other logs", file=self.folder / LOGS, remedy="move them elsewhere first")
        if first < len(self.played):
            self._require_room(first)
            (self.folder / LOGS).mkdir(exist_ok=True)
            self._play_from(first)
        return CampaignRun(
            robot=self.campaign.robot.name,
            place=self.player.endpoint.place(self.player.endpoint.motion_port),
            folder=os.fspath(self.folder / LOGS),
            stages=tuple(self.state.recorded),
            starts=self.state.starts,
            duration=time.monotonic() - begin,
        )

    def _play_from(self, first: int) -> None:
        pending = self.played[first:]
        self.origin = pending[0].start
        zero = self._beginning(pending[0]) - pending[0].start / self.speed
        # Only what is left counts: its rate is measured from here on.
        self.progress.start(f"campaign of {self.campaign.robot.name}", pending[-1].end - self.origin)
        try:
            resumed = self.state.starts > 0
            self._move_recording()
            self.state.starts += 1
            self.state.save(self.folder)
            if resumed:
                self._go_home(first + 1)
            cycle = None
            for number, slot in enumerate(pending, start=first + 1):
                self._rest(zero + slot.start / self.speed, slot.start)
                if slot.cycle != cycle:
                    # A stage takes a little longer than its samples. Rests make up for it, cycles are not shortened.
                    zero = max(zero, time.time() - slot.start / self.speed)
                    cycle = slot.cycle
                self._play_stage(number, slot)
        finally:
            self.progress.finish()

    def _beginning(self, slot: Slot) -> float:
        """When a stage is due, in seconds since 1970: a rest that was interrupted is kept to its end."""
        last = self.state.last
        if last is None:
            return time.time()
        rest = slot.start - self.played[last.number - 1].end
        return min(max(last.end.unix + rest / self.speed, time.time()), time.time() + rest / self.speed)

    def _rest(self, until: float, planned: float) -> None:
        """Waits until a time in seconds since 1970, which is at a time of the timetable [s]."""
        while (left := until - time.time()) > 0:
            self.progress.update(max(planned - left * self.speed - self.origin, 0.0), "rest")
            time.sleep(min(left, PROGRESS_PERIOD))

    def _play_stage(self, number: int, slot: Slot) -> None:
        assert slot.stage is not None
        stage = self.campaign.stages_by_name[slot.stage]
        name = f"{number:0{self.width}d}_{stage.name}"
        header = {
            "campaign_stage": number,
            "stage": stage.name,
            "cycle": slot.cycle,
            "phase": slot.phase,
            "run": slot.run,
            "duty": slot.duty,
        }
        note = f"stage {number} of {len(self.played)}: {stage.name} of cycle {slot.cycle}"
        try:
            result, end, recording = self.player.play(
                stage.motion,
                name,
                header,
                anchor=self._anchor,
                file=self.folder / stage.file,
                progress=StageProgress(self.progress, slot.start - self.origin, stage.duration, note),
            )
            recorded = RecordedStage(
                number=number,
                stage=stage.name,
                cycle=slot.cycle,
                file=f"{LOGS}/{name}.csv",
                recording=f"{INTERRUPTED}/{recording.name}",
                rows=result.rows,
                lost=result.feedback["lost"],
                delay=result.delay,
                end=end,
            )
            following = replace(self.state, recorded=[*self.state.recorded, recorded])
            # A disk without room for the state leaves the stage to be played again.
            following.save(self.folder)
            self.state = following
        except OedError as error:
            raise self._goes_on(error) from None
        self._move_recording()

    def _move_recording(self) -> None:
        """Moves the recording of the last stage to its place; a kill may have come in between."""
        last = self.state.last
        if last is not None and (self.folder / last.recording).exists():
            os.replace(self.folder / last.recording, self.folder / last.file)

    def _go_home(self, number: int) -> None:
        """Moves the robot to where stages begin, if it was stopped elsewhere."""
        listener = StageProgress(self.progress, 0.0, 0.0, "moving home slowly")
        try:
            self.player.go_home(f"{number:0{self.width}d}_home", self._anchor, listener)
        except OedError as error:
            raise self._goes_on(error) from None

    @property
    def _anchor(self) -> ClockAnchor | None:
        return None if self.state.last is None else self.state.last.end

    def _goes_on(self, error: OedError) -> OedError:
        """Says how to go on after an error."""
        done = len(self.state.recorded)
        text = f"{done} of {len(self.played)} stages are recorded; the same command goes on with the next one"
        error.remedy = "; ".join(filter(None, [error.remedy, text]))
        return error

    def _require_room(self, first: int) -> None:
        """Refuses a disk that the logs will not fit on."""
        robot = self.campaign.robot
        seconds = sum(slot.duration for slot in self.played[first:])
        # A number in a log takes 20 bytes at most.
        needed = int(seconds / robot.period) * (1 + 3 * robot.n) * 20
        free = shutil.disk_usage(self.folder).free
        if needed > free:
            raise InputError(
                f"the logs may need {needed / 1e6:.0f} MB, the disk has {free / 1e6:.0f} MB left",
                file=self.folder,
                remedy="make room, or choose a folder on another disk",
            )

"""A piece of work at the workbench: plain messages in, events out, no screen needed.

Messages:  {"do": "capture.box", "part": "frog", ...}     an action; with "gesture": "g7" it is one of a drag, and
                                                   says what is done from where that began
           {"do": "undo"}  "redo"  "reload"  "cancel"
           {"work": "capture.suggest", ...}                starts long work
           {"look": "capture.frame", "frame": 12}          changes nothing; answered with bytes
Events:    {"kind": "state", "revision", "changed": {desk: {section: ...}}, "undo", "redo"}    for everybody
           {"kind": "progress", "work", "label", "done", "total"}, {"kind": "ended", "work", "sentence", "made"}  to all
           {"kind": "told", "sentence", "why"}             for everybody: what became of saving; why is "elsewhere"
                                                   (another program changed a file), "unwritable" or "saved" (again)
           {"kind": "refused", "sentence"}, {"kind": "seen", "type", ..., "data"}, {"kind": "done"}   to who asked
A message's "id" comes back in the answers to it, the last of which is done, seen or refused.
"""

import traceback
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from threading import Lock, RLock, Timer
from typing import Any

from capture.errors import InputError
from retarget.workbench import desks, history, saving, working
from retarget.workbench.desks import Desk, Done
from retarget.workbench.folder import desk as folder
from retarget.workbench.folder import reach
from retarget.workbench.history import History
from retarget.workbench.saving import Saved
from retarget.workbench.state import State, pose_file

Event = dict[str, Any]
SAVED_AFTER = 0.5  # seconds: the most that a drag goes on before what it did so far is on disk
TRIED_AGAIN = 3.0  # seconds after which what could not be written is tried again
ALONE = 3  # times that an action is worked out while others act; then they wait


class Session:
    """The state with its past and its files; several pages may work on it, and see the same."""

    def __init__(self, at: str | Path, file: str = "", tables: tuple[Desk, ...] | None = None) -> None:
        """Work in the folder `at`, with a file of it open if one is named."""
        if tables is None:
            from retarget.workbench.tables import DESKS as tables
        self.desks = tables
        self.history = History(State(Path(at).resolve()))
        self.revision = 0
        self.running: working.Running | None = None
        self._saved = Saved()
        self._listeners: list[Callable[[Event], None]] = []
        self._lock = RLock()  # held for moments only: what takes long is worked out first, and then put in place
        self._writing = Lock()
        self._timer: Timer | None = None
        self._closed = False
        self._unsaved = ""  # the sentence last told of why not all is on disk
        if file:
            self.history = History(folder.named(self.state, file))  # who starts it chose that file, and what it names
            saving.note(self._saved, self.state)
        self._sent = self._sections()

    @property
    def state(self) -> State:
        """What is worked on now."""
        return self.history.state

    def listen(self, hears: Callable[[Event], None]) -> Callable[[], None]:
        """Call `hears` with every event that is for everybody, from any thread; returns what ends that."""
        with self._lock:
            self._listeners.append(hears)
        return lambda: self._listeners.remove(hears) if hears in self._listeners else None

    def shown(self) -> Event:
        """The whole state as an event: what a page gets when it opens.

        What cannot be read any more, such as a clip that was moved away, is closed: its documents are on disk.
        """
        with self._lock:
            try:
                self._sent = self._sections()
            except InputError as error:
                self.save()
                self.history = History(State(self.state.folder))
                self._sent = self._sections()
                self._tell({"kind": "told", "sentence": f"closed, for it cannot be read: {error}"})
            return self._state_event(self._sent)

    def act(self, message: Any) -> list[Event]:
        """Do what a message asks; returns the events, of which those for everybody have gone to the listeners too.

        Whatever cannot be done is an event, "refused", with a sentence; nothing is changed then.
        """
        given = isinstance(message, dict)
        answer = {"id": message["id"]} if given and isinstance(message.get("id"), int | str) else {}
        if given and "look" in message:
            return [self._look(message, answer)]
        try:
            if not given:
                _unknown()
            if isinstance(name := message.get("do"), str) and "work" not in message:
                for table, do in (("actions", self._act), ("writes", self._write)):
                    if desks.has(self.desks, table, name):
                        return [*do(name, message), {"kind": "done", **answer}]
            with self._lock:
                return [*self._asked(message), {"kind": "done", **answer}]
        except Exception as error:
            return [{**_refused(error), **answer}]

    def save(self) -> list[Event]:
        """Write what is not on disk yet; a failure is told, and tried again in a while and at the next change."""
        with self._lock:
            if self._timer is not None:
                self._timer.cancel()
                self._timer = None
            before = self._unsaved
            try:
                saving.save(self._saved, self.state)  # what can be; the rest is told
            except InputError as error:
                self._unsaved, full = str(error), isinstance(error, saving.Unwritable)
                event = {"kind": "told", "sentence": self._unsaved, "why": "unwritable" if full else "elsewhere"}
                if full and not self._closed:
                    self._save_in(TRIED_AGAIN)
                return [event if full and self._unsaved == before else self._tell(event)]
            self._unsaved = ""
            if before:
                self._tell({"kind": "told", "sentence": "All is saved again.", "why": "saved"})
            return []

    def _save_in(self, seconds: float) -> None:
        self._timer = Timer(seconds, self.save)
        self._timer.daemon = True
        self._timer.start()

    def close(self) -> None:
        """Save, and stop what is running."""
        self._closed = True
        self.save()
        if self.running is not None:
            working.cancel(self.running)

    def _asked(self, message: dict[str, Any]) -> list[Event]:
        if isinstance(name := message.get("work"), str):
            return self._start(name, _fields(message))
        if not isinstance(name := message.get("do"), str):
            return _unknown()
        if name in ("undo", "redo"):
            return self._become((history.undo if name == "undo" else history.redo)(self.history))
        if name == "reload":
            return self._reload()
        if name == "cancel":
            if self.running is not None:
                working.cancel(self.running)
            return []
        raise InputError(f"the workbench has nothing called {name[:60]!r} to be done: reload the page")

    def _act(self, name: str, message: dict[str, Any]) -> list[Event]:
        """Do an action: others go on while it is worked out, so it is worked out again if they changed something."""
        action, gesture, begun = desks.find(self.desks, "actions", name), str(message.get("gesture") or ""), self.state
        fields = desks.arguments(action, _fields(message))

        def step() -> tuple[History, History]:
            old = self.history
            if (old.state.folder, old.state.name) != (begun.folder, begun.name):
                raise InputError("something else was opened meanwhile: do it again")
            state = action(history.base(old, gesture), **fields)
            return old, history.done(old, state, desks.label(action), gesture)

        for _ in range(ALONE):
            old, new = step()
            with self._lock:
                if self.history is old:
                    return self._become(new, later=bool(gesture))
        with self._lock:
            return self._become(step()[1], later=bool(gesture))

    def _write(self, name: str, message: dict[str, Any]) -> list[Event]:
        """Do what puts a file into the folder, once and one after the other; others may change the state meanwhile."""
        action = desks.find(self.desks, "writes", name)
        fields = desks.arguments(action, _fields(message))
        with self._writing:
            old = self.state
            state = action(old, **fields)
            with self._lock:
                same = state is old
                return self._become(self.history if same else history.done(self.history, state, desks.label(action)))

    def _become(self, new: History, later: bool = False) -> list[Event]:
        """Go over to a new history; save it now, or within half a second while a gesture goes on."""
        sections = self._sections(new.state)  # what cannot be shown is refused before it takes the other's place
        other = new.state.name != self.state.name
        if other:
            self.save()
        self.history = new
        if other:
            saving.note(self._saved, self.state)
        unsaved = []
        if not later:
            unsaved = self.save()
        elif self._timer is None:
            self._save_in(SAVED_AFTER)
        changed = {
            desk: {name: value for name, value in inner.items() if self._sent[desk].get(name) != value}
            for desk, inner in sections.items()
        }
        self._sent = sections
        self.revision += 1
        return [self._tell(self._state_event({desk: inner for desk, inner in changed.items() if inner})), *unsaved]

    def _reload(self) -> list[Event]:
        """What is on disk now, whoever wrote it; what was there before can be had again by undoing."""
        if self.state.figure is not None:
            fresh = replace(pose_file(self.state, self.state.figure.file), name=self.state.name)
            saving.note(self._saved, fresh)
            return self._become(history.done(self.history, fresh, "read the files again"))
        files = [file for file in folder.listed(self.state.folder) if file["kind"] in ("shot", "motion", "cast")]
        named = [one["file"] for one in files if one["file"].startswith(f"{self.state.name}.")]
        if not named:
            raise InputError("nothing of this work is on disk to be read again: open a file")
        fresh = folder.named(self.state, named[0])
        reach.refuse_outside(fresh, reach.outside(self.state))
        saving.note(self._saved, fresh)
        return self._become(history.done(self.history, fresh, "read the files again"))

    def _start(self, name: str, fields: dict[str, Any]) -> list[Event]:
        if self.running is not None:
            raise InputError(f"one thing at a time: {self.running.name} is still at work, cancel it or wait")
        work = desks.find(self.desks, "work", name)
        arguments = work.prepare(self.state, **desks.arguments(work.prepare, fields))
        unsaved = self.save()
        if unsaved:
            return unsaved
        self.running = working.start(name, arguments, self._heard)
        return [self._tell({"kind": "progress", "work": name, "label": "starting", "done": 0, "total": None})]

    def _heard(self, running: working.Running, said: dict[str, Any]) -> None:
        """What the working process says, on a thread of its own."""
        with self._lock:
            if said["kind"] == "progress":
                self._tell({**said, "work": running.name})
                return
            self.running = None
            sentence, made = str(said.get("sentence", "")), False
            if said["kind"] == "result":
                work = desks.find(self.desks, "work", running.name)
                done = Done(said["fields"], said["said"], tuple(said["written"]))
                try:
                    sentence = done.said
                    state = work.apply(self.state, **done.fields)
                    saving.note(self._saved, state, done.written)
                    self._become(history.done(self.history, state, desks.label(work.run)))
                    made = True
                except InputError as error:
                    sentence = str(error)
            self._tell({"kind": "ended", "work": running.name, "sentence": " ".join(sentence.split()), "made": made})

    def _look(self, message: dict[str, Any], answer: dict[str, Any]) -> Event:
        fields = {name: value for name, value in message.items() if name not in ("look", "id")}
        try:
            look = desks.find(self.desks, "looks", str(message["look"]))
            seen = look(self.state, **desks.arguments(look, fields))
        except Exception as error:
            return {**_refused(error), **answer}
        return {"kind": "seen", "type": seen.kind, **answer, **seen.said, "data": seen.data}

    def _sections(self, state: State | None = None) -> dict[str, dict[str, Any]]:
        return {desk.name: desk.shown(self.state if state is None else state) for desk in self.desks}

    def _state_event(self, changed: dict[str, dict[str, Any]]) -> Event:
        steps = {"undo": self.history.past, "redo": self.history.future}
        labels = {name: past[-1].label if past else "" for name, past in steps.items()}
        running = self.running.name if self.running is not None else ""
        return {"kind": "state", "revision": self.revision, "changed": changed, "running": running, **labels}

    def _tell(self, event: Event) -> Event:
        for hears in tuple(self._listeners):
            hears(event)
        return event


def _fields(message: dict[str, Any]) -> dict[str, Any]:
    """What of a message are its function's own arguments."""
    return {name: value for name, value in message.items() if name not in ("do", "work", "id", "gesture")}


def _refused(error: Exception) -> Event:
    """An error in a sentence; one that is no fault of the user's is shown in full where the server runs."""
    if isinstance(error, InputError):
        return {"kind": "refused", "sentence": " ".join(str(error).split())}
    if isinstance(error, OSError) and error.strerror:
        of = f" ({Path(str(error.filename)).name[:60]})" if error.filename else ""
        return {
            "kind": "refused",
            "sentence": f"the files must let themselves be read and written: {error.strerror}{of}",
        }
    traceback.print_exception(error)
    return {"kind": "refused", "sentence": f"this went wrong, and is a fault of tooncap: {error!r}"}


def _unknown() -> list[Event]:
    raise InputError('a message must be an object with "do", "work" or "look": reload the page')

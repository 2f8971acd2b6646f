"""The command that opens the workbench."""

from pathlib import Path


def workbench(file: Path | None = None, *, no_open: bool = False) -> str:
    """Open the workbench: the same work by hand and by eye, in a browser on this machine.

    Whatever is done there is saved by itself; ^C ends it.

    Parameters
    ----------
    file
        A clip, a *.shot.toml, a *.motion.json or a *.cast.toml; or the folder to work in.  Here, if not given.
    no_open
        Print the address only, and leave it to you to open it.
    """
    import webbrowser

    from capture.errors import InputError
    from retarget.workbench.serving import server
    from retarget.workbench.session import Session

    at = Path() if file is None else file
    if not at.exists():
        raise InputError(f"the workbench opens a file or folder that is there, {at} is not: give another")
    session = Session(at) if at.is_dir() else Session(at.parent, at.name)
    serving = server.start(session)
    try:
        print(f"the workbench is at {serving.address} until you press ^C", flush=True)
        if not no_open:
            webbrowser.open(serving.address)
        serving.wait()
    except KeyboardInterrupt:
        serving.stop()
    if lost := session.save():
        raise InputError(
            lost[0]["sentence"].replace("not saved yet, but kept here and tried again", "not all is saved")
        )
    return f"{session.state.folder}: all is saved"
